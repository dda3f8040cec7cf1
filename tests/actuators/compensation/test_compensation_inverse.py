"""Feedforward by inverse operators and by whole models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
import sympy as sp

from actuators import stack_bond_graph, stack_lumped
from actuators.compensation import (
    P840_1,
    UNIPOLAR,
    AnalyticMotion,
    BondGraphStack,
    DriveLimits,
    LumpedStack,
    VoltageLimit,
    acceleration_jumps,
    bond_graph_feedforward,
    bond_graph_residual,
    feedforward,
    field_law,
    limited_feedforward,
    linear_operator,
    lumped_feedforward,
    lumped_residual,
    operator_residual,
    smooth_reference,
    thesis_reference,
    voltage_steps,
)
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    BadInput,
    MaxwellResistiveCapacitor,
    NotInvertible,
    PrandtlIshlinskii,
)
from bondgraph.support.errors import UnusableInput
from tests.symbols import closed

MODELS: list[Any] = [AlJanaideh.stack_2hz(), Ang.stack_2hz()]
MAXWELL = MaxwellResistiveCapacitor.stack_2hz()
TIME = np.linspace(0.0, 2.0, 4001)
X_REF = thesis_reference(TIME).x
WIDE = DriveLimits(-200.0, 200.0)


# references


def test_the_printed_reference() -> None:
    def printed(t: float) -> float:
        if t < 0.5:
            return float(2000 * np.sin(2 * np.pi * t - np.pi / 2) + 2000)
        return float(1500 * np.sin(2 * np.pi * t - np.pi / 2) + 2500)

    expected = np.array([printed(t) for t in TIME])
    assert np.abs(1e9 * X_REF - expected).max() < 1e-9
    assert thesis_reference([-1.0]).x[0] == 0.0
    slow, fast = thesis_reference(TIME), thesis_reference(TIME / 50.0, 50.0)
    assert np.allclose(slow.x, fast.x, atol=1e-18)
    assert np.allclose(slow.a, fast.a / 2500.0, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("reference", [thesis_reference, smooth_reference])
def test_derivatives_are_those_of_the_displacement(
    reference: Callable[[Any, float], AnalyticMotion],
) -> None:
    """Central differences of each order agree where the order above is continuous."""
    h = 1e-5
    t = np.linspace(0.013, 1.9, 700)
    t = t[np.abs(t - 0.5) > 2 * h]
    here, after, before = (reference(t + d, 1.0) for d in (0.0, h, -h))
    for low, high in (("x", "v"), ("v", "a"), ("a", "j")):
        slope = (getattr(after, low) - getattr(before, low)) / (2 * h)
        size = np.abs(getattr(here, high)).max()
        assert np.abs(slope - getattr(here, high)).max() < 2e-6 * size


def test_jumps_of_the_acceleration() -> None:
    tiny = 1e-9
    for at, height in acceleration_jumps(3.0):
        m = thesis_reference([at - tiny, at + tiny], 3.0)
        assert m.a[1] - m.a[0] == pytest.approx(height, rel=1e-6)
        assert abs(m.v[1] - m.v[0]) < 4 * tiny * abs(m.a).max()
        s = smooth_reference([at - tiny, at + tiny], 3.0)
        assert abs(s.a[1] - s.a[0]) < 1e-6 * height
        assert abs(s.j[1] - s.j[0]) < 1e-5 * height
    assert acceleration_jumps()[0][1] == pytest.approx(78957e-9, rel=1e-5)
    late = np.linspace(0.6, 2.0, 50)
    assert np.allclose(smooth_reference(late).x, thesis_reference(late).x, atol=1e-18)


def test_bad_references() -> None:
    with pytest.raises(UnusableInput, match="finite record"):
        thesis_reference([0.0, np.nan])
    with pytest.raises(UnusableInput, match="must be positive"):
        smooth_reference([0.0], 0.0)


# operators


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_inverse_is_exact_from_any_memory(model: Any) -> None:
    rng = np.random.default_rng(4)
    histories = [np.zeros(1), *(np.append(rng.uniform(0, 100, 30), 0.0) for _ in range(5))]
    for history in histories:
        memory = model.run(history)[1]
        voltage, left = operator_residual(model, model, X_REF, memory, envelope=P840_1)
        assert np.abs(left).max() < 1e-11 * 1e-9
        assert np.ptp(voltage) > 80.0


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_a_used_actuator_is_not_virgin(model: Any) -> None:
    """Taking it for virgin, as the printed recursion does, leaves half a micrometre at first."""
    used = model.run(np.array([0.0, 100.0, 0.0]))[1]
    _, left = operator_residual(model, model, X_REF, used, model.initial_memory(0.0))
    assert 300e-9 < np.abs(left).max() < 600e-9


def test_published_voltage_range() -> None:
    for model, top in zip(MODELS, (83.1, 84.1), strict=True):
        voltage = feedforward(model, X_REF)
        assert voltage.min() == pytest.approx(0.0, abs=1e-9)
        assert voltage.max() == pytest.approx(top, abs=0.05)


def test_no_inverse() -> None:
    with pytest.raises(NotInvertible):
        feedforward(PrandtlIshlinskii((0.0, 1.0), (1.0, -2.0)), [0.0, 1.0])


# envelope


def test_the_envelope_is_never_left_silently() -> None:
    with pytest.raises(VoltageLimit, match=r"sample \d+ needs .* leave 0 \.\. 60 V"):
        feedforward(MODELS[0], X_REF, envelope=DriveLimits(0.0, 60.0))
    used = MODELS[0].run(np.array([0.0, 100.0, 0.0]))[1]
    with pytest.raises(VoltageLimit):
        feedforward(MODELS[0], X_REF, used)
    with pytest.raises(VoltageLimit, match="lumped"):
        lumped_feedforward(thesis_reference(TIME), MAXWELL, envelope=DriveLimits(0.0, 60.0))
    with pytest.raises(VoltageLimit, match="bond graph"):
        bond_graph_feedforward(
            smooth_reference(TIME), field_law(MODELS[1]), envelope=DriveLimits(0.0, 60.0)
        )
    with pytest.raises(UnusableInput):
        DriveLimits(1.0, 1.0)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_limited_feedforward_recovers(model: Any) -> None:
    limits = DriveLimits(0.0, 60.0)
    limited = limited_feedforward(model, X_REF, envelope=limits)
    wanted = model.inverse().run(X_REF, model.inverse_memory(model.initial_memory(0.0)))[0]
    assert limited.voltage.max() <= 60.0
    assert limited.voltage.min() >= 0.0
    x, memory = model.run(limited.voltage, model.initial_memory(0.0))
    assert np.abs(x - limited.reached).max() < 1e-20
    assert np.allclose(memory, limited.memory, atol=1e-12)
    assert 0.2 < limited.clipped.mean() < 0.8
    assert np.abs(x - X_REF)[~limited.clipped].max() < 1e-18
    # an inverse that believes in the voltage it asked for does not come back
    blind, _ = model.run(np.clip(wanted, 0.0, 60.0), model.initial_memory(0.0))
    inside = (wanted > 0.0) & (wanted < 60.0)
    assert np.abs(blind - X_REF)[inside].max() > 100e-9


def test_limited_is_the_plain_inverse_inside() -> None:
    for model in MODELS:
        limited = limited_feedforward(model, X_REF, envelope=UNIPOLAR)
        assert not limited.clipped.any()
        assert np.abs(limited.voltage - feedforward(model, X_REF)).max() < 1e-10
    with pytest.raises(BadInput):
        limited_feedforward(MODELS[0], [0.0, np.nan])
    assert feedforward(linear_operator(50e-9), [1e-6])[0] == pytest.approx(20.0)


# whole models


def test_parameters_are_those_of_the_graphs() -> None:
    """The dataclasses repeat the defaults of the factories; a graph of theirs must be the same."""
    for stack, graph in (
        (LumpedStack().graph(MAXWELL), stack_lumped()),
        (BondGraphStack().graph(MAXWELL), stack_bond_graph()),
    ):
        own = {n: q.value for n, q in equations(stack).parameters.items()}
        known = {n: q.value for n, q in equations(graph).parameters.items()}
        assert {n: v for n, v in known.items() if n != "C_nl"} == {
            n: v for n, v in own.items() if n != "C_nl"
        }


@pytest.mark.parametrize("frequency", [1.0, 50.0, 500.0])
@pytest.mark.parametrize("resistance", [0.0, 5.0])
def test_lumped_inverse_in_simulation(frequency: float, resistance: float) -> None:
    motion = smooth_reference(TIME / frequency, frequency)
    left = lumped_residual(motion, MAXWELL, LumpedStack(resistance=resistance))
    # what is left comes from the kinks of the voltage between the samples
    assert np.abs(left).max() < 0.2e-9
    assert np.sqrt(np.mean(left**2)) < 0.01e-9


def test_lumped_inverse_of_the_printed_reference() -> None:
    for frequency in (1.0, 500.0):
        motion = thesis_reference(TIME / frequency, frequency)
        assert np.abs(lumped_residual(motion, MAXWELL, LumpedStack())).max() < 0.2e-9
    # without the electro-mechanics the same voltage is far off at 500 Hz
    quasi_static = AnalyticMotion(motion.time, motion.x, *(np.zeros_like(motion.x),) * 3)
    voltage = lumped_feedforward(quasi_static, MAXWELL)
    right = lumped_feedforward(motion, MAXWELL)
    assert np.abs(voltage - right).max() > 0.05


def test_sampling_is_the_error() -> None:
    """Four times the samples, about a sixteenth of the error: V is linear between them."""
    errors = []
    for n in (500, 2000):
        time = np.linspace(0.0, 2.0, n + 1) / 500.0
        left = lumped_residual(smooth_reference(time, 500.0), MAXWELL, LumpedStack())
        errors.append(float(np.sqrt(np.mean(left**2))))
    assert errors[0] / errors[1] > 8.0


def test_steps_of_the_voltage() -> None:
    stack = LumpedStack()
    for f in (1.0, 200.0):
        start, half = voltage_steps(thesis_reference, f, MAXWELL, stack)
        first, second = (a for _, a in acceleration_jumps(f))
        per_jump = stack.mass / stack.transducer
        slope = 1.0 + stack.capacitance * float(MAXWELL.linear_slope)
        assert start == pytest.approx(per_jump * first * slope, rel=1e-9)
        assert per_jump * second * 0.99 < half < per_jump * second * slope
        assert np.abs(voltage_steps(smooth_reference, f, MAXWELL, stack)).max() < 1e-9


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
@pytest.mark.parametrize("frequency", [1.0, 500.0])
def test_bond_graph_inverse_in_simulation(model: Any, frequency: float) -> None:
    stack = BondGraphStack()
    motion = smooth_reference(TIME / frequency, frequency)
    left = bond_graph_residual(motion, field_law(model, stack), stack)
    assert np.abs(left).max() < 0.05e-9


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_field_law_is_the_operator_at_rest(model: Any) -> None:
    stack = BondGraphStack()
    x = X_REF[::20]
    dipole = stack.length / stack.transducer * x
    field, _ = field_law(model, stack).run(dipole)
    voltage = feedforward(model, x)
    assert np.abs(stack.length * field - voltage).max() < 1e-10


def test_derivation_of_the_bond_graph_inverse() -> None:
    """The voltage formula, put into the equations of the graph, leaves nothing."""
    space = closed(equations(stack_bond_graph(external_force=True)))
    rates = dict(zip(space.x, space.dxdt, strict=True))
    p = sp.Symbol("q_C_nl", real=True)
    k, m, r, t, ell, re, c = sp.symbols("k m R_nl T l R_e C_nl", positive=True)
    force, v_in = sp.symbols("F_e V_in", real=True)

    def along(e: Any) -> Any:
        return sum(e.diff(s) * rate for s, rate in rates.items())

    x = space.y[0]
    v = along(x)
    a = along(v)
    load = m * a + r * v - force
    dipole_rate = ell / t * (v + along(load) / k)
    voltage = p / c * ell + t * load + re / ell * dipole_rate
    assert sp.simplify(sp.expand(voltage - v_in)) == 0
    assert sp.simplify(ell / t * (x + load / k) - p) == 0


def test_constant_force_shifts_the_voltage() -> None:
    motion = smooth_reference(TIME)
    stack = asdict(LumpedStack())
    plain = lumped_feedforward(motion, None, envelope=WIDE)
    loaded = lumped_feedforward(motion, None, force=-10.0, envelope=WIDE)
    assert np.allclose(loaded - plain, 10.0 / stack["transducer"])
