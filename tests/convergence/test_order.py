"""The step against an independent integrator (Radau) on the continuous right-hand side."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators import stack_bond_graph
from bondgraph import BondGraph
from bondgraph.equations.codegen import program
from bondgraph.laws import PiecewiseLinear, Polynomial, QuadraticDrag
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import compile_model
from tests.settled import simulate
from tests.spring import spring


def duffing(drag: bool = False) -> BondGraph:
    friction = QuadraticDrag(0.2) if drag else None
    return spring(1.0, 0.3, 4.0, Polynomial(size=1.0, orders=(3,)), friction)


def radau(graph: BondGraph, p: Any, u_of_t: Any, t: Any, x0: Any, tight: float = 1e-9) -> Any:
    """Outputs, shape (len(t), n_y), by Radau with tight tolerances."""
    rhs = program(graph).rhs

    def right(s: float, x: Any, which: int) -> Any:
        return rhs(s, x, [], u_of_t(s), p, [], 0)[which].full().ravel()

    scale = np.maximum(np.abs(x0), 1e-12)
    out = solve_ivp(right, (t[0], t[-1]), x0, "Radau", t, args=(0,), rtol=tight, atol=tight * scale)
    assert out.success
    return np.array([right(s, x, 1) for s, x in zip(t, out.y.T, strict=True)])


@pytest.mark.parametrize("drag", [False, True])
def test_smooth_laws_against_radau(drag: bool) -> None:
    model = compile_model(duffing(drag))
    p = model.vector({"a_3_k": 3.0})
    t = np.linspace(0, 4, 81)
    x0 = np.array([1.0 if n == "q_k" else -0.5 for n in model.states])
    reference = radau(duffing(drag), p, lambda s: [0.7 * s], t, x0)
    run = simulate(model, t, {"F": 0.7 * t}, {"a_3_k": 3.0}, x0=x0, accuracy=1e-8)
    assert np.abs(run["x"] - reference[:, 0]).max() < 3e-6


def test_order_two() -> None:
    """Halving the sub-step of a cubic spring quarters the error."""
    model = compile_model(duffing())
    p = model.vector({"a_3_k": 3.0})
    t = np.linspace(0, 4, 41)
    x0 = np.array([1.0 if n == "q_k" else 0.0 for n in model.states])
    u = 0.7 * t[:, None]
    reference = radau(duffing(), p, lambda s: [0.7 * s], t, x0)[:, 0]
    errors = [
        np.abs(run_record(model, p, u, 0.1, x0, n_sub=n).y[:, 0] - reference).max()
        for n in (1, 2, 4, 8, 16)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((orders[1:] > 1.9) & (orders[1:] < 2.1)), orders


def test_kinked_law_converges() -> None:
    """A piecewise-linear spring: the kinks cost the order, not the convergence."""
    g = spring(1.0, 0.3, 4.0, PiecewiseLinear((-1.0, -0.4, 0.4, 1.0), 1.0))
    model = compile_model(g)
    free = [n for n in model.parameter_names if n.startswith("c_")]
    p = model.vector({n: c for n, c in zip(free, (1.5, 2.0), strict=True)})
    x0 = np.array([0.9 if n == "q_k" else 0.0 for n in model.states])
    u = np.zeros((41, 1))
    runs = [run_record(model, p, u, 0.1, x0, n_sub=n).y[:, 0] for n in (4, 16, 64, 256)]
    errors = [np.abs(r - runs[-1]).max() for r in runs[:-1]]
    assert errors[1] < errors[0] / 6
    assert errors[2] < 1e-5


@pytest.mark.parametrize("printed", [False, True])
def test_linear_stack_at_any_step(printed: bool) -> None:
    """The printed set has R_e C = 70 ns (stiffness ratio 1e7); the step need not know."""
    more: dict[str, Any] = (
        {"capacitance": 13.9e-9, "transducer": 3.52, "mass": 16e-3} if printed else {}
    )
    graph = stack_bond_graph(sensors=("x", "i"), **more)
    model = compile_model(graph)
    p = model.nominal()
    for step in (1e-4, 1e-5):
        t = step * np.arange(21)
        volt = 1e6 * t
        run = run_record(model, p, volt[:, None], step, np.zeros(3))
        reference = radau(graph, p, lambda s: [1e6 * s], t, np.zeros(3), 1e-7)
        size = np.abs(reference).max(axis=0)
        assert np.all(np.abs(run.y - reference).max(axis=0) < 1e-6 * size)
    if printed:
        a = model.matrices(p).full()[:3, :3]
        fastest = np.abs(np.linalg.eigvals(a)).max()
        assert 1 / fastest < 75e-9
