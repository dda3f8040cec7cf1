"""The plants that only the exam has, and the laws that only it hides."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pytest

from actuators.models.plants import plant_model
from bondgraph.graph.elements import TwoPort, Valued
from bondgraph.support.arrays import FloatArray as Array
from hardware.simulators.generator.case import canonical
from hardware.simulators.generator.drawing import draw
from hardware.simulators.generator.laws_exam import EXAM_LAWS
from hardware.simulators.generator.native import Row, run
from hardware.simulators.generator.parameters import EXAM_PLANTS
from tests.hardware.simulators.generator.excited import excited, moved
from tests.settled import simulate


@pytest.mark.parametrize("plant", EXAM_PLANTS)
def test_two_codes_agree_on_the_plain_plant(plant: str) -> None:
    public, values = EXAM_PLANTS[plant], moved(plant)
    graph = plant_model(plant)
    graph = graph.with_values({n: 1 / v if n == "A" else v for n, v in values.items()})
    u = np.cumsum(np.random.default_rng(3).standard_normal(400))
    u -= u[0]  # both start at rest
    made = excited(plant, (), u)
    got = simulate(graph, np.arange(400) * public.step, {public.source[0]: u})
    for c, name in enumerate(public.sensors):
        expected = made.readings[:, c]
        assert np.abs(got[name] - expected).max() < 1e-6 * np.abs(expected).max(), name


@pytest.mark.parametrize("plant", EXAM_PLANTS)
def test_the_model_has_the_public_names_and_values(plant: str) -> None:
    graph, public = plant_model(plant), EXAM_PLANTS[plant]
    assert graph.check() == ()
    assert {e.name for e in graph.of_type(Valued, TwoPort)} == set(public.nominal)
    for name, (value, _) in public.nominal.items():
        own = graph.parameters[name].value
        assert (1 / own if name == "A" else own) == pytest.approx(value), name


def test_what_integrates_and_what_comes_to_rest() -> None:
    p = moved("cylinder")
    made = excited("cylinder", (), np.full(3000, 1e-4), 20)
    speed = 1e-4 / (p["A"] + p["b"] / (p["A"] * p["R_l"]))
    assert np.diff(made.readings[-500:, 1]) / 1e-3 == pytest.approx(speed, rel=1e-6)
    p = moved("servo")
    made = excited("servo", (), np.full(3000, 0.2), 20)
    assert made.readings[-1, 1] == pytest.approx(0.2 / (p["b_1"] + p["b_2"]), rel=1e-6)
    p = moved("oven")
    made = excited("oven", (), np.full(4000, 30.0), 20)
    second = 30 * p["R_out"]
    assert made.readings[-1] == pytest.approx([second + 30 * p["R_12"], second], rel=1e-6)


def row(law: str, slot: int, *numbers: float) -> Row:
    return Row(EXAM_LAWS[law].kind, slot, EXAM_LAWS[law].states, numbers)


def servo_twist(effects: tuple[Row, ...], u: Array) -> float:
    return float(excited("servo", effects, u).seen[2, 1])


def test_a_gap_lets_its_damper_go() -> None:
    u = 0.3 * np.sin(np.arange(2000) * 0.05)
    gap = 0.02
    grips = excited("servo", (Row(13, 2, 0, (gap,)),), u)
    frees = excited("servo", (row("letting_go_gap", 2, gap, 3.0, 0.1 * gap),), u)
    assert np.abs(grips.readings - frees.readings)[:, 1].max() > 1e-3
    # within a gap that is never crossed nothing at all connects the load to the rotor
    wide = excited("servo", (row("letting_go_gap", 2, 1e3, 3.0, 1.0),), u)
    assert np.abs(wide.readings[:, 1]).max() < 1e-12 * np.abs(wide.readings[:, 0]).max()
    # a gap of another spring leaves this damper alone
    other = excited("servo", (Row(26, 2, 0, (1e3, 5.0, 1.0)),), u)
    assert np.abs(other.readings[:, 1]).max() > 0


PROBE = (0.2, 8.0e3, 0.02, 1e-6, 200.0, 1e-5)
"""The probe with hardly any damping and without its coil."""


def swinging(effects: tuple[Row, ...], u: Array) -> Array:
    made = run("probe", PROBE, effects, u, sub=60, hold="linear")
    assert made is not None
    return made.readings[:, 0]


def test_relays_take_energy_and_never_give_it() -> None:
    rng = np.random.default_rng(4)
    u = np.zeros(1500)
    u[1:300] = 3 * rng.standard_normal(299)
    u[1000:1100] = 2 * rng.standard_normal(100)  # starts anew from within the old loops
    plain, lossy = swinging((), u), swinging((row("relay_continuum", 1, 20.0, 1e-3),), u)
    for free in (slice(320, 1000), slice(1120, 1500)):
        peaks = np.max(np.abs(lossy[free].reshape(-1, 20)), axis=1)
        assert np.all(np.diff(peaks) < 0.02 * peaks[0])
        assert peaks[-1] / peaks[0] < 0.7
        kept = np.max(np.abs(plain[free].reshape(-1, 20)), axis=1)
        assert kept[-1] / kept[0] > 0.9


def test_relays_wipe_out_small_loops() -> None:
    """A small detour that is crossed again leaves no trace: the way on is as if it never was."""
    knots: dict[str, list[float]] = {
        "direct": [0, 6, -5, 6],
        "detour": [0, 6, -5, 3, 1, 2, 1.5, 3, 6],
    }
    law = (row("relay_continuum", 1, 4.0, 5e-4),)
    ends = []
    for path in map(np.asarray, knots.values()):
        lengths = np.r_[0, np.cumsum(np.abs(np.diff(path)))] * 80
        u = np.interp(np.arange(int(lengths[-1]) + 400), lengths, path)
        ends.append(swinging_damped(law, u)[-1])
    virgin = swinging_damped(law, np.interp(np.arange(900), [0, 480], [0, 6]))[-1]
    assert ends[1] == pytest.approx(ends[0], rel=1e-4)
    assert abs(virgin - ends[0]) < 1e-3 * abs(virgin)
    # but a detour that is not closed is remembered
    u = np.interp(np.arange(1500), [0, 480, 960, 1060], [0, 6, 0, 1.0])
    assert abs(swinging_damped(law, u)[-1] - swinging_damped(law, u / 6)[-1]) > 0.1 * abs(virgin)


def swinging_damped(effects: tuple[Row, ...], u: Array) -> Array:
    made = run("probe", (0.2, 8e3, 60.0, *PROBE[3:]), effects, u, sub=40, hold="linear")
    assert made is not None
    return made.readings[:, 0]


@pytest.mark.parametrize("law", ["lugre", "slip_bristles"])
def test_bristles_hold_before_they_slip(law: str) -> None:
    numbers = {
        "lugre": (0.05, 50.0, 0.02, 0.04, 0.5, 1.0),
        "slip_bristles": (100.0, 1e-3, 24.0),
    }[law]
    push = np.sin(np.pi * np.minimum(np.arange(800) / 600, 1.0)) ** 2
    weak, strong = 0.01 * push, 0.5 * push
    held = excited("servo", (row(law, 1, *numbers),), weak)
    free = excited("servo", (), weak)
    slipped = excited("servo", (row(law, 1, *numbers),), strong)
    # below the breakaway it goes back where it was; above it stays away
    assert abs(held.readings[-1, 0]) < 0.2 * np.abs(held.readings[:, 0]).max()
    assert abs(held.readings[-1, 0]) < 1e-2 * abs(free.readings[-1, 0])
    assert abs(slipped.readings[-1, 0]) > 0.5 * np.abs(slipped.readings[:, 0]).max()


def test_a_spread_of_units_creeps_through_decades() -> None:
    values = [20.0, 8e-6, 5.0, 0.5, 5e6, 950.0]
    law = row("spread_creep", 4, 0.02, 16.0, 4 / 5000, 1.9, 1.0)
    made = run("stack", values, (law,), np.full(8000, 40.0), sub=20)
    assert made is not None
    x = made.readings[:, 1]
    late = [x[k] for k in (60, 240, 960, 3840)]
    growth = np.diff(late)
    # as much in each fourfold time: the sign of a wide spread, while one unit would have settled
    assert np.all(growth > 0.4 * growth.max())


def test_an_amplifier_is_limited_in_slew_and_rings() -> None:
    # the oven's heater stands for a scope: with a large store its temperature integrates
    values = [1.0, 1e9, 1.0, 1e9]
    u = np.full(200, 10.0)
    law = row("amplifier_slew", 100, 0.3, 0.3, 0.1)
    made = run("oven", values, (law,), u, sub=200, hold="zero")
    assert made is not None
    out = np.diff(made.readings[:, 0]) / 5.0
    assert np.abs(np.diff(out)[12:18] / 5.0 - 0.1).max() < 0.02
    assert out[-1] == pytest.approx(10.0, rel=1e-6)
    quick = run("oven", values, (row("amplifier_slew", 100, 0.3, 0.3, 1e9),), u, sub=200)
    assert quick is not None
    assert np.diff(quick.readings[:, 0]).max() > 5.0 * 10.0 * 1.15


def test_an_orifice_leaks_by_the_root() -> None:
    # at rest the flow through the leak is what goes in
    values = [1.0, 1e12, 1.0, 1e12]
    temperatures = []
    for flow in (1.0, 2.0):
        law = row("orifice_leak", 0, 0.5, 1e-3)
        made = run("oven", values, (law,), np.full(4000, flow), sub=20)
        assert made is not None
        temperatures.append(made.readings[-1, 0])
    assert temperatures[1] / temperatures[0] == pytest.approx(4.0, rel=1e-3)
    assert temperatures[0] == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "entropy", "count", "expected"),
    [
        ("trial", "a" * 64, None, "0b396265a581b2a5"),
        ("development", 0, 500, "cf92917c49241c58"),
        ("reduced", "r", None, "5c0a4be580ce50b9"),
    ],
)
def test_the_draws_of_the_trial_are_what_they_were(
    kind: str, entropy: str | int, count: int | None, expected: str
) -> None:
    cases = [nine_digits(case.plain()) for case in draw(kind, entropy, count)]
    assert hashlib.sha256(canonical(cases)).hexdigest()[:16] == expected


def nine_digits(value: Any) -> Any:
    """Round all numbers: the last bits of an exponential differ between processors."""
    match value:
        case float():
            return float(f"{value:.9g}")
        case dict():
            return {k: nine_digits(v) for k, v in value.items()}
        case list() | tuple():
            return [nine_digits(v) for v in value]
        case _:
            return value
