"""Sizing against the numbers of the thesis, against models, and as a printed sheet."""

from __future__ import annotations

import argparse
import doctest
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from actuators import stack_lumped
from actuators.stack.sizing import (
    P_840_1,
    STACKS,
    blocking_force,
    ceramic_stiffness,
    current_per_frequency,
    dissipated_power,
    effective_mass,
    electrical_energy,
    frequency_limit,
    generated_voltage,
    operating_point,
    peak_current,
    peak_power,
    resonance_frequency,
    sine_slew,
    slew_limit,
    stack_capacitance,
    stack_mass,
)
from actuators.stack.sizing_sheet import sizing_sheet
from bondgraph import UnknownName, UnusableInput
from bondgraph.equations.derivation import equations
from bondgraph.signals.quantity import engineering, quantity
from bondsight.cli.sizing import add_sizing_command, sheet
from tests.settled import simulate


@pytest.mark.parametrize(
    "module",
    ["actuators.stack.sizing", "actuators.stack.sizing_sheet", "bondgraph.signals.quantity"],
)
def test_examples_run(module: str) -> None:
    assert doctest.testmod(import_module(module)).failed == 0


# -- numbers of the thesis, recomputed -----------------------------------------------------
def test_amplifier_numbers() -> None:
    assert peak_current(100.0, 1.5e-6, 100.0) == pytest.approx(47e-3, abs=0.5e-3)
    assert frequency_limit(0.2, 1.5e-6, 100.0) == pytest.approx(424.0, abs=0.5)
    assert slew_limit(0.2, 1.5e-6) == pytest.approx(0.133e6, abs=500.0)
    assert current_per_frequency(1.5e-6, 100.0, 15e-6) == pytest.approx(10.0)
    assert sine_slew(frequency_limit(0.2, 1.5e-6, 100.0), 100.0) == pytest.approx(
        slew_limit(0.2, 1.5e-6)
    )


def test_mechanical_numbers() -> None:
    assert resonance_frequency(65e6, 16e-3) == pytest.approx(10.1e3, abs=50.0)
    assert resonance_frequency(65e6, effective_mass(16e-3)) == pytest.approx(17.6e3, abs=50.0)
    assert stack_mass(7800.0, 1.13e-4, 18e-3) == pytest.approx(15.87e-3, abs=5e-6)
    assert ceramic_stiffness(25e-6, 18e-3, 20.7e-12) == pytest.approx(67e6, abs=0.5e6)
    assert ceramic_stiffness(1.13e-4, 18e-3, 20.7e-12) == pytest.approx(303e6, abs=0.5e6)
    assert stack_mass(7800.0, 25e-6, 18e-3) == pytest.approx(3.5e-3, abs=5e-5)
    assert blocking_force(57e6, 15e-6) == pytest.approx(855.0)


def test_capacitance_of_a_stack() -> None:
    eps = 1750 * 8.8541878128e-12
    assert stack_capacitance(180, eps, 25e-6, 100e-6) == pytest.approx(0.697e-6, abs=1e-9)


# -- formulas against independent computations ---------------------------------------------
def test_current_against_the_derivative_of_the_charge() -> None:
    t = np.linspace(0.0, 1.0, 200_001) / 50.0
    u = 50 - 50 * np.cos(2 * np.pi * 50.0 * t)
    i = np.gradient(1.5e-6 * u, t)
    assert peak_current(50.0, 1.5e-6, 100.0) == pytest.approx(i.max(), rel=1e-4)
    charging = np.abs(i).mean() / 2  # the amplifier's positive supply gives every second half
    assert 50.0 * 1.5e-6 * 100.0 == pytest.approx(charging, rel=1e-4)
    assert peak_power(50.0, 1.5e-6, 100.0, 120.0) == pytest.approx(120.0 * i.max(), rel=1e-4)


def test_heat_against_the_lossy_capacitor() -> None:
    omega, c, tan_delta = 2 * np.pi * 200.0, 1.5e-6, 0.02
    amplitude = 50.0
    conductance = omega * c * tan_delta
    assert dissipated_power(200.0, c, 100.0, tan_delta) == pytest.approx(
        conductance * amplitude**2 / 2
    )


def test_operating_point_against_the_model() -> None:
    """The lumped stack against a spring is the same model with a stiffer spring behind it."""
    values = {n: p.value for n, p in equations(stack_lumped()).parameters.items()}
    k, load = values["k"], 20e6
    free = values["T"] * 100.0 / k
    time = np.linspace(0.0, 1e-3, 5)
    run = simulate(stack_lumped(), time, {"V_in": np.full(5, 100.0)}, {"k": k + load})
    point = operating_point(k, free, load)
    assert run["x"][-1] == pytest.approx(point.displacement, rel=1e-9)
    assert point.force == pytest.approx(load * point.displacement)
    assert k * (free - point.displacement) == pytest.approx(point.force)


def test_largest_work_is_a_quarter() -> None:
    k, free = 60e6, 15e-6
    loads = k * np.geomspace(0.1, 10, 201)
    work = [operating_point(k, free, x).work for x in loads]
    assert loads[int(np.argmax(work))] == pytest.approx(k)
    assert max(work) == pytest.approx(k * free**2 / 8)
    weight = operating_point(k, free, 0.0, 100.0)
    assert weight.displacement == pytest.approx(free)
    assert weight.work == pytest.approx(100.0 * free)


def test_generator_against_the_constitutive_stack() -> None:
    """Open leads: ``q = 0`` in ``F = k x - T V``, ``q = T x + C V`` gives the same voltage."""
    k, t, free = 65e6, 3.52, 1.5e-6
    clamped = free - t**2 / k
    x_v = np.linalg.solve([[k, -t], [t, clamped]], [500.0, 0.0])
    assert generated_voltage(500.0, t / k, free) == pytest.approx(-x_v[1], rel=1e-12)
    assert electrical_energy(free, 10.0) == pytest.approx(75e-6)


# -- sheet --------------------------------------------------------------------------------
def test_sheet_as_text_and_html() -> None:
    s = sizing_sheet(P_840_1)
    text = str(s)
    for line in ("855 N", "47.12 mA", "424.4 Hz", "133.3 kV/s", "10 A/(Hz*m)", "not given"):
        assert line in text
    assert all(len(line) < 100 for line in text.splitlines())
    assert s["frequency limit"] == pytest.approx(424.4, abs=0.1)
    html = s._repr_html_()
    assert html.startswith("<table>")
    assert html.count("<tr>") == len(s.rows) + len({r.section for r in s.rows})
    with pytest.raises(UnknownName, match="Did you mean 'resonance'"):
        s["resonanc"]


def test_sheet_warns() -> None:
    assert sizing_sheet(P_840_1).warnings == ()
    hard = sizing_sheet(P_840_1, frequency=2000.0, load_mass=0.5, load_stiffness=600e6)
    text = " ".join(hard.warnings)
    assert "drive needs 942.5 mA" in text
    assert "below twice" not in text
    fast = sizing_sheet(P_840_1, frequency=2000.0, load_mass=1.0)
    assert any("below twice the drive frequency" in w for w in fast.warnings)
    assert any("preload the stack" in w for w in fast.warnings)
    assert "warning: " in str(fast)


@pytest.mark.parametrize("options", [
    {"load_force": 600.0, "frequency": 900.0, "load_mass": 0.7},
    {"load_force": 20.0, "load_stiffness": 30e6, "frequency": 900.0, "load_mass": 0.7},
    {"frequency": 300.0, "load_mass": 2.0},
])  # fmt: skip
def test_warned_forces_are_those_of_the_motion(options: dict[str, float]) -> None:
    """Force on the tip along the sine: the load, its spring, and mass times acceleration."""
    s = sizing_sheet(P_840_1, current=10.0, **options)
    turn = np.linspace(0.0, 2 * np.pi, 401)
    stroke, mass, w = s["displacement"], s["effective mass"], 2 * np.pi * options["frequency"]
    assert stroke is not None
    assert mass is not None
    x = 0.5 * stroke * (1.0 - np.cos(turn))
    force = options.get("load_force", 0.0) + options.get("load_stiffness", 0.0) * x
    force = force + mass * w**2 * 0.5 * stroke * np.cos(turn)
    for limit, word, most in (
        (1000.0, "press with", float(force.max())), (50.0, "pulls with", float(-force.min()))
    ):  # fmt: skip
        said = [w for w in s.warnings if word in w]
        assert bool(said) == (most > limit)
        assert not said or engineering(most, "N", 4) in said[0]


def test_the_load_is_held_at_the_end_of_the_stroke() -> None:
    """The voltage may rest there: speed relieves a sine, not the stack that stands."""
    stiff = replace(P_840_1, push_force=300.0)
    s = sizing_sheet(stiff, load_stiffness=40e6, load_mass=0.5, frequency=900.0, current=10.0)
    assert s["force"] is not None
    assert any(f"press with up to {engineering(s['force'], 'N', 4)}" in w for w in s.warnings)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0, "N", "0 N"), (999.96, "Hz", "1 kHz"), (1e-15, "F", "0.001 pF"),
        (-0.0025, "m", "-2.5 mm"), (5.3333e-3, "kg", "5.333 g"), (2e12, "Hz", "2000 GHz"),
    ],
)  # fmt: skip
def test_engineering(value: float, unit: str, text: str) -> None:
    assert engineering(value, unit, 4) == text


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: peak_current(-1.0, 1.0, 1.0), "frequency = -1 must be positive"),
        (lambda: effective_mass(-1.0), "mass = -1 must be 0 or more"),
        (lambda: operating_point(1e6, 1e-6, 0.0, 2.0), "blocked at 1 N"),
        (lambda: sizing_sheet(P_840_1, voltage_pp=120.0), "120 V exceed the 100 V"),
        (lambda: quantity("2 kg", "F", "--set c"), "kg is not a unit of this quantity"),
        (lambda: quantity("fast", "Hz", "--frequency"), "does not start with a number"),
        (lambda: sheet("P-840.1", {}, ["mass"]), "write NAME=VALUE"),
    ],
)
def test_refusals(call: Any, words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        call()


def test_command(capsys: pytest.CaptureFixture[str]) -> None:
    parser = argparse.ArgumentParser()
    add_sizing_command(parser.add_subparsers())
    words = ["sizing", "--frequency", "1kHz", "--current=300 mA", "--load-mass", "100 g"]
    options = parser.parse_args([*words, "--set", "tan_delta=1.5%"])
    assert options.run(options) == 0
    printed = capsys.readouterr().out
    assert "at 1 kHz, amplifier 300 mA" in printed
    assert "warning: the drive needs 471.2 mA" in printed
    assert "176.7 mW" in printed
    with pytest.raises(UnknownName, match=r"Did you mean 'P-840\.1'"):
        options.run(parser.parse_args(["sizing", "P-841"]))
    assert parser.parse_args(["sizing"]).stack in STACKS
    assert sheet("P-840.1", {"voltage": "50V"})["free displacement"] == pytest.approx(7.5e-6)
