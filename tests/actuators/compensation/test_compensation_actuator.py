"""The virtual actuator against the independent bench, and the tracking numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from actuators.compensation import VirtualActuator, actuator_like, loop_thickness, tracking
from bondgraph import TF, BondGraph, C, Dq, I, One, R, Se, Zero
from bondgraph.hysteresis import AlJanaideh
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray
from bondsight.cli.compensate import bench_model
from hardware.virtual import ModelPlant

MODEL = AlJanaideh.stack_2hz()
RATE = 20_000.0
NOMINAL = actuator_like(MODEL)
LINEAR = VirtualActuator(1.5e-6, (), ())


def bench(graph: BondGraph, voltage: FloatArray, substeps: int) -> FloatArray:
    """The model's exact steps under a held voltage."""
    plant = ModelPlant(graph, "V_in", "x", step=1.0 / (RATE * substeps))
    x = plant.advance(np.repeat(voltage, substeps)).x
    return np.concatenate([[0.0], x[substeps - 1 :: substeps][:-1]])


def test_slipping_elements_agree_with_the_bench() -> None:
    rng = np.random.default_rng(2)
    voltage = np.repeat(rng.uniform(0.0, 100.0, 12), 60)
    voltage = np.convolve(voltage, np.ones(20) / 20.0, "same")
    for actuator in (NOMINAL, NOMINAL.aged(3, 0.1)):
        own = actuator.run(voltage, RATE, substeps=20)
        other = bench(bench_model(actuator), voltage, 20)
        assert np.abs(own - other).max() < 2e-4 * np.ptp(other)
        # the default sub-steps are coarser
        assert np.abs(actuator.run(voltage, RATE) - other).max() < 4e-3 * np.ptp(other)


def creeping(a: VirtualActuator) -> BondGraph:
    """The stack with the actuator's numbers, a retarded charge beside its dielectric for each."""
    with BondGraph("creeping") as g:
        loop, node, force, body = One("loop"), Zero("node"), Zero("force"), One("body")
        Se("V_in", unit="V") >> loop >> R("R_e", a.resistance, unit="ohm")
        inner = One("inner")
        loop >> inner
        inner >> node >> C("C", a.capacitance, unit="F")
        for j, (ratio, time) in enumerate(zip(a.creep_ratios, a.creep_times, strict=True)):
            slow = One(f"slow_{j}")
            capacitance = ratio * a.capacitance
            node >> slow >> C(f"C_{j}", capacitance, unit="F")
            slow >> R(f"R_{j}", time / capacitance, unit="ohm")
        body >> force >> TF("T", ratio=1.0 / a.transducer, unit="C/m") >> inner
        force >> C("k", stiffness=a.stiffness, unit="N/m")
        body >> I("m", a.mass, unit="kg")
        body >> R("b", a.damping, unit="N*s/m")
        body >> Dq("x", unit="m")
    return g


def test_creep_agrees_with_the_bench() -> None:
    ratios, times = (0.05, 0.08), (2e-3, 10e-3)
    actuator = replace(LINEAR, creep_ratios=ratios, creep_times=times)
    voltage = np.where(np.arange(800) < 400, 60.0, 20.0)
    other = bench(creeping(actuator), voltage, 20)
    assert np.abs(actuator.run(voltage, RATE, substeps=20) - other).max() < 1e-6 * np.ptp(other)
    gain = actuator.capacitance * actuator.transducer
    last = actuator.run(np.full(4000, 10.0), RATE)[-1]
    assert last == pytest.approx(10.0 * gain * (1.0 + sum(ratios)), rel=1e-6)


def test_amplifier_is_a_first_order_lag() -> None:
    slow = replace(LINEAR, amplifier_time=2e-3)
    x = slow.run(np.full(200, 1.0), RATE) / (LINEAR.capacitance * LINEAR.transducer)
    t = np.arange(200) / RATE
    delay = 0.05e-3  # the faster poles
    assert np.abs(x - (1.0 - np.exp(-np.maximum(t - delay, 0.0) / 2e-3))).max() < 0.03


def test_the_actuator_has_the_published_loop() -> None:
    voltage = 50.0 - 50.0 * np.cos(np.linspace(0.0, 6.0 * np.pi, 6001))
    x = NOMINAL.run(voltage, 2000.0)
    published, _ = MODEL.run(voltage)
    assert np.abs(x - published).max() < 2e-3 * np.ptp(published)


def test_bad_actuators() -> None:
    with pytest.raises(UnusableInput, match="slip_gains and slip_limits differ"):
        VirtualActuator(1e-6, (1.0,), ())
    with pytest.raises(UnusableInput, match="sub-steps"):
        NOMINAL.run(np.zeros(3), RATE, substeps=1)
    assert NOMINAL.aged(5, 0.1) == NOMINAL.aged(5, 0.1)
    assert NOMINAL.aged(5, 0.1) != NOMINAL.aged(6, 0.1)


def test_tracking_numbers() -> None:
    wanted = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
    t = tracking(wanted, wanted + np.array([0.0, 0.0, 0.0, 0.3, 0.4]))
    assert t.largest == pytest.approx(0.4)
    assert t.rms == pytest.approx(math.sqrt(0.25 / 5))
    assert t.relative == pytest.approx(t.rms / 2.0)
    assert t.thickness == pytest.approx(0.4)
    with pytest.raises(UnusableInput):
        tracking(wanted, wanted[:-1])
    with pytest.raises(UnusableInput):
        tracking(np.ones(3), np.ones(3))


def test_thickness_of_a_known_loop() -> None:
    """A lag of phase phi makes a sine an ellipse of thickness 2 A sin(phi)."""
    phase = np.linspace(0.0, 6.0 * np.pi, 30001)
    lagging = np.sin(phase - 0.1)
    assert loop_thickness(np.sin(phase), lagging) == pytest.approx(2.0 * math.sin(0.1), rel=1e-4)
