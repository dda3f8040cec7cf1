"""Laws of drives and sensors: slew limit, rectifier, rounding."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import C, R, Se, Zero
from bondgraph.graph.sensors import De
from bondgraph.laws import Rectifier, Rounding, SlewLimit
from bondgraph.laws.along import along
from bondgraph.laws.law import Law
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import exact_form
from bondgraph.simulation.start import equilibrium, inputs_of
from bondgraph.support.ops import CASADI, NUMPY, SYMPY

UNEVEN = SlewLimit(0.02, even=False, falling=0.05)
LAWS: tuple[Law, ...] = (SlewLimit(0.02), UNEVEN, Rectifier(0.7), Rounding(0.3, 0.05, 0.8))
STEP = 1e-3


def numbers(law: Law) -> list[float]:
    p = [q.value for q in law.parameters("e")]
    return [*p, STEP] if law.timed else p


def walk(n: int) -> np.ndarray:
    return np.cumsum(0.07 * np.random.default_rng(2).standard_normal(n))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_back_ends_agree(law: Law) -> None:
    p, x = numbers(law), sp.Symbol("x", real=True)
    s, m = ca.SX.sym("s"), ca.SX.sym("m", law.n_memory)
    ms = tuple(ca.vertsplit(m)) if law.n_memory else ()
    compiled = ca.Function(
        "law", [s, m], [law.deviation(CASADI, s, ms, p), ca.vertcat(*law.advance(CASADI, s, ms, p))]
    )
    memory = law.initial_memory(0.0)
    for value in walk(30):
        plain = float(law.deviation(NUMPY, value, memory, p))
        assert float(compiled(value, list(memory))[0]) == pytest.approx(plain, abs=1e-12)
        symbolic = sp.sympify(law.deviation(SYMPY, x, memory, p)).subs(x, value)
        assert float(symbolic) == pytest.approx(plain, abs=1e-12)
        memory = law.advance(NUMPY, value, memory, p)
    even = {} if law is not UNEVEN else {"even": False}
    assert law.structure == type(law)(**even).structure
    assert law.energy == "signal"


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_derivatives_against_differences(law: Law) -> None:
    p = numbers(law)
    s, q = ca.SX.sym("s"), ca.SX.sym("q", len(p))
    memory = law.advance(NUMPY, 0.1, law.initial_memory(0.0), p)
    w = law.deviation(CASADI, s, memory, tuple(ca.vertsplit(q)))
    slopes = ca.Function("slopes", [s, q], [ca.jacobian(w, s), ca.jacobian(w, q)])
    for value in (-0.93, -0.21, 0.02, 0.37, 1.4):
        by_s, by_p = slopes(value, p)
        h = 1e-7
        ends = [float(law.deviation(NUMPY, value + d, memory, p)) for d in (h, -h)]
        if law.name == "rounding":  # the rounding error counts as a number, see the class
            assert float(by_s) == 0.0
        else:
            assert float(by_s) == pytest.approx((ends[0] - ends[1]) / (2 * h), abs=1e-6)
        for i in range(1 if law.name == "rounding" else len(p)):
            higher, lower = list(p), list(p)
            higher[i] *= 1 + 1e-6
            lower[i] *= 1 - 1e-6
            ends = [float(law.deviation(NUMPY, value, memory, v)) for v in (higher, lower)]
            change = (ends[0] - ends[1]) / (2e-6 * p[i])
            assert float(by_p[i]) == pytest.approx(change, rel=1e-5, abs=1e-7)


def amplifier(slowness: float) -> BondGraph:
    law = SlewLimit(slowness, 0.01)
    with BondGraph("amplifier") as g:
        node = Zero("out")
        Se("u", unit="V", drive=Drive(law=law)) >> node
        node >> R("load", 10.0, unit="ohm")
        node >> De("y", unit="V")
    return g


def test_slew_limit_over_a_record() -> None:
    """Equal to a plain loop; derivative by the slowness equal to differences."""
    n, dt = 400, 1e-3
    u = np.where(np.arange(n) % 100 < 50, 0.0, 1.0) + 0.3 * np.sin(0.05 * np.arange(n))
    compiled = exact_form(amplifier(0.03))
    assert compiled is not None
    at = compiled.parameter_names.index("slowness_u")

    def run(slowness: float, directions: tuple[int, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
        p = compiled.vector({"slowness_u": slowness})
        inputs = inputs_of(compiled, {"u": u}, dt * np.arange(n))
        made = run_record(
            compiled, p, inputs, dt, equilibrium(compiled, p, inputs[0]), directions=directions
        )
        return made.y[:, 0], made.dy

    y, dy = run(0.03, (at,))
    wanted = [u[0]]
    for v in u[1:]:
        wanted.append(wanted[-1] + float(np.clip(v - wanted[-1], -dt / 0.03, dt / 0.03)))
    np.testing.assert_allclose(y, wanted, atol=1e-12)
    np.testing.assert_allclose(u + along(SlewLimit(), u, dt, [0.03]), wanted, atol=1e-12)
    h = 1e-7
    difference = (run(0.03 + h)[0] - run(0.03 - h)[0]) / (2 * h)
    # where a ramp meets the command the derivative jumps: all samples but those few agree
    close = np.isclose(dy[:, 0, 0], difference, rtol=1e-5, atol=1e-5)
    assert close.mean() > 0.98
    np.testing.assert_allclose(run(0.0)[0], u, atol=1e-12)


def test_rising_and_falling_have_limits_of_their_own() -> None:
    dt, u = 0.01, np.sin(np.linspace(0.0, 12.0, 300))
    wanted = [u[0]]
    for v in u[1:]:
        wanted.append(wanted[-1] + float(np.clip(v - wanted[-1], -dt / 0.5, dt / 0.3)))
    law, memory, stepped = SlewLimit(0.3, even=False, falling=0.5), (float(u[0]),), []
    for v in u:
        stepped.append(v + law.deviation(NUMPY, v, memory, (0.3, 0.5, dt)))
        memory = law.advance(NUMPY, v, memory, (0.3, 0.5, dt))
    np.testing.assert_allclose(stepped, wanted, atol=1e-12)
    assert law.structure != SlewLimit(0.3).structure


def test_rectifier_and_rounding() -> None:
    s = np.array([-1.3, -0.2, 0.0, 0.4])
    np.testing.assert_allclose(s + Rectifier().deviation(NUMPY, s, (), (1.0,)), np.abs(s))
    rounded = s + Rounding().deviation(NUMPY, s, (), (1.0, 0.25, 0.1))
    np.testing.assert_allclose((rounded - 0.1) / 0.25, np.round((s - 0.1) / 0.25), atol=4e-6)
    assert Rounding(0.1).structure == Rounding(0.2, 0.3).structure
    assert C("c", 1.0).law is None
