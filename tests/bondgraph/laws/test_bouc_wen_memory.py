"""Bouc-Wen beside a slope: the solution of its equation, softening or hardening."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from bondgraph.hysteresis import BoucWen
from bondgraph.laws import BoucWenMemory
from bondgraph.support.ops import CASADI, NUMPY, SYMPY

LAWS = {
    "Bouc-Wen": BoucWenMemory(0.6, 1.2, 0.7),
    "Bouc-Wen hardens": BoucWenMemory(0.6, 0.8, -1.1, reach=1.5),
}
CORNERS = (0.0, 1.1, 0.4, 1.7, -1.5, -0.2, -0.9, 0.8)


def run(law: BoucWenMemory, path: Any, p: Any) -> Any:
    memory, found = law.initial_memory(path[0]), []
    for s in path:
        memory = law.advance(NUMPY, s, memory, p)
        found.append(p[0] * float(memory[1]))
    return np.array(found)


@pytest.mark.parametrize(
    ("beta", "gamma"), [(1.2, 0.7), (1.0, -1.0), (0.8, -1.1), (0.3, 0.9), (0.0, -0.5), (4.0, 4.0)]
)
def test_one_step_is_the_solution_of_the_equation(beta: float, gamma: float) -> None:
    """``dz/ds = 1 - |z| (gamma + beta sgn(ds z)) / reach``, integrated between the corners."""
    law, p = BoucWenMemory(reach=1.5), (0.6, beta, gamma)
    got, z, wanted = run(law, CORNERS, p), 0.0, [0.0]
    for a, b in pairwise(CORNERS):
        side = np.sign(b - a)

        def slope(s: float, z: Any, side: float = side) -> Any:
            return 1.0 - np.abs(z) * (gamma + beta * np.sign(side * z)) / 1.5

        z = float(solve_ivp(slope, (a, b), [z], rtol=1e-10, atol=1e-12).y[0, -1])
        wanted.append(0.6 * z)
    np.testing.assert_allclose(got, wanted, atol=1e-8)
    # samples on the way do not matter
    many = [s for a, b in pairwise(CORNERS) for s in np.linspace(a, b, 8)[1:]]
    np.testing.assert_allclose(run(law, [CORNERS[0], *many], p)[::7], got, atol=1e-12)


def test_where_it_is_bounded_it_is_the_operator() -> None:
    operator = BoucWen(slope=0.0, gain=0.6, growth=1.0, beta=0.8, gamma=0.4)
    path = np.cumsum(np.random.default_rng(2).normal(size=60))
    wanted, _ = operator.run(path, operator.initial_memory(path[0], (path[0], 0.0)))
    np.testing.assert_allclose(run(BoucWenMemory(reach=2.0), path, (0.6, 1.6, 0.8)), wanted)


@pytest.mark.parametrize("law", LAWS.values(), ids=list(LAWS))
@pytest.mark.sampled(every=2)
def test_back_ends_and_the_implicit_solution_agree(law: BoucWenMemory) -> None:
    p = tuple(q.value for q in law.parameters("e"))
    m, (s, free, gain, last) = ca.SX.sym("m", 2), map(ca.SX.sym, "sfgl")
    memory = tuple(ca.vertsplit(m))
    value = law.deviation(CASADI, s, memory, p)
    compiled = ca.Function("law", [s, m], [value, ca.jacobian(value, s)])
    solve = ca.Function("w", [free, gain, last, m], [law.solve(free, gain, memory, p, last)])
    x, at = sp.Symbol("x", real=True), law.initial_memory(0.0)
    for i, place in enumerate((0.7, 0.2, -1.1, -0.4, 0.9)):
        plain = float(law.deviation(NUMPY, place, at, p))
        w, slope = map(float, compiled(place, list(at)))
        assert w == pytest.approx(plain, abs=1e-12)
        upper, lower = (float(law.deviation(NUMPY, place + h, at, p)) for h in (1e-6, -1e-6))
        assert slope == pytest.approx((upper - lower) / 2e-6, rel=1e-6)
        if i % 2:
            symbolic = sp.sympify(law.deviation(SYMPY, x, at, p)).subs(x, place)
            assert float(symbolic) == pytest.approx(plain, abs=1e-12)
        found = float(solve(place, -0.3, plain, list(at)))
        there = float(law.deviation(NUMPY, place - 0.3 * found, at, p))
        assert found == pytest.approx(there, abs=1e-9)
        at = tuple(map(float, law.advance(NUMPY, place, at, p)))


@pytest.mark.parametrize(
    ("beta", "gamma"), [(0.8, -1.1), (0.0, -1.1), (1.2, 0.7), (0.4, 0.9), (0.0, 0.9)]
)
def test_a_closed_cycle_loses_energy_by_beta_alone(beta: float, gamma: float) -> None:
    """The same curve leads up and down without it; a loop that hardens ends above its slope."""
    path = np.sin(np.linspace(0.0, 4 * np.pi, 1201))
    y = run(BoucWenMemory(), path, (1.0, beta, gamma))
    lost = float(np.sum(0.5 * (y[601:] + y[600:-1]) * np.diff(path[600:])))
    assert (y.max() > 1.0) == (beta + gamma < 0)
    assert (lost > 0.1) if beta else abs(lost) < 1e-5
