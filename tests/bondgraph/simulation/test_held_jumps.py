"""Commands that jump at the samples and act on a law at once: the law begins each step anew."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bondgraph import BondGraph, C, De, One, R, Se, Zero
from bondgraph.equations.codegen import program_of
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Law, NonlinearResistance
from bondgraph.simulation.exact_run import prepare, run_prepared, run_record
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.radau.native import prepare_general, run_general
from bondgraph.simulation.simulate import simulate, simulate_general
from hardware.virtual.steppers import ExactMarch
from tests.beside import beside

STEP, N = 5e-5, 120
R_1, C_1, CUBIC = 1e3, 1e-6, 0.6


def circuit(law: Law) -> BondGraph:
    with BondGraph("circuit") as g:
        loop, node = One("loop"), Zero("node")
        Se("V", unit="V") >> loop >> node
        loop >> R("R_1", beside(law, R_1), unit="ohm", law=law)
        node >> C("C_1", C_1, unit="F")
        node >> R("R_L", 1e4, unit="ohm")
        node >> De("v", unit="V")
    return g


def cubic() -> BondGraph:
    return circuit(NonlinearResistance(1.0, 1e-3)).with_values({"a_3_R_1": CUBIC})


def hysteretic() -> BondGraph:
    law = Hysteretic(PrandtlIshlinskii((0.0, 1e-3, 3e-3), (1.2e3, 500.0, 900.0)))
    return circuit(law)


MODELS: dict[str, Callable[[], BondGraph]] = {"cubic": cubic, "hysteretic": hysteretic}


def volts() -> Any:
    """A new voltage every ten samples."""
    return np.repeat(np.random.default_rng(8).uniform(-8, 8, N // 10), 10)[:, None]


def reference() -> Any:
    """The voltage of the cubic circuit by a general integrator, sample by sample."""

    def rate(_: float, v: Any, source: float) -> Any:
        def left(i: float) -> float:
            return float(R_1 * i + CUBIC * (i / 1e-3) ** 3 - (source - v[0]))

        return (brentq(left, -1.0, 1.0, xtol=1e-18, rtol=1e-14) - v[0] / 1e4) / C_1

    v, found = np.zeros(1), [0.0]
    for u in volts()[:-1, 0]:
        made = solve_ivp(rate, (0, STEP), v, args=(u,), rtol=1e-11, atol=1e-13, method="DOP853")
        v = made.y[:, -1]
        found.append(v[0])
    return np.array(found)


@pytest.mark.parametrize("compiler", [True, False])
def test_the_error_falls_with_the_square_of_the_sub_step(compiler: bool, monkeypatch: Any) -> None:
    if not compiler:
        monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    from bondgraph.simulation import lure_kernel

    lure_kernel._runner.cache_clear()
    model, exact = compile_model(cubic()), reference()
    errors = []
    for n_sub in (2, 4, 8, 16):
        run = run_record(
            model, model.nominal(), volts(), STEP, np.zeros(1), n_sub=n_sub, hold="hold"
        )
        errors.append(np.abs(run.y[:, 0] - exact).max())
    lure_kernel._runner.cache_clear()
    assert errors[0] < 1e-4 * np.ptp(exact)
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert (ratios > 3.5).all()
    assert (ratios < 4.5).all()


def test_a_play_sees_where_its_argument_jumped_to() -> None:
    """The current is largest just after a jump and falls from there: a turning point."""
    model = compile_model(hysteretic())
    p, x0 = model.nominal(), np.zeros(1)
    options: dict[str, Any] = {"hold": "hold"}
    coarse, fine = (run_record(model, p, volts(), STEP, x0, n_sub=n, **options) for n in (2, 64))
    assert np.abs(coarse.y - fine.y).max() < 1e-5 * np.ptp(fine.y)
    assert np.ptp(fine.w) > 1.0  # volts: the plays move


@pytest.mark.parametrize("name", MODELS)
def test_derivatives_against_central_differences(name: str) -> None:
    model = compile_model(MODELS[name]())
    p, u, x0 = model.nominal(), volts(), np.array([1.1e-6])
    options: dict[str, Any] = {"n_sub": 2, "hold": "hold"}
    n_p = len(p)
    run = run_record(model, p, u, STEP, x0, directions=range(n_p), state_directions=True, **options)
    for d in range(n_p + 1):
        moved = np.append(p, x0)
        size = 1e-6 * (abs(moved[d]) or 1.0)
        ends = []
        for sign in (1, -1):
            at = moved.copy()
            at[d] += sign * size
            ends.append(run_record(model, at[:n_p], u, STEP, at[n_p:], **options).y)
        expected = (ends[0] - ends[1]) / (2 * size)
        np.testing.assert_allclose(
            run.dy[:, :, d], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max()
        )


@pytest.mark.parametrize("name", MODELS)
def test_every_sub_step_passes_through_the_samples(name: str) -> None:
    model = compile_model(MODELS[name]())
    ready = prepare(model, model.nominal(), STEP, 4)
    coarse = run_prepared(ready, volts(), np.zeros(1), "hold")
    fine = run_prepared(ready, volts(), np.zeros(1), "hold", every_substep=True)
    np.testing.assert_array_equal(coarse.y, fine.y[::4])


@pytest.mark.parametrize(
    "law",
    [
        NonlinearResistance(1.0, 1e-3),
        Hysteretic(PrandtlIshlinskii((0.0, 1e-3, 3e-3), (1.2e3, 500.0, 900.0))),
    ],
)
def test_a_bench_that_is_asked_in_pieces(law: Law) -> None:
    graph, command = circuit(law), volts()[:, 0]
    values = {"a_3_R_1": CUBIC} if isinstance(law, NonlinearResistance) else {}
    whole, parts = (ExactMarch(compile_model(graph), "V", values, STEP, 2) for _ in range(2))
    kept = parts.snapshot()
    expected = whole.advance(command)
    for _ in range(2):  # the second time from the snapshot
        found = [parts.advance(command[a : a + 7]) for a in range(0, N, 7)]
        np.testing.assert_array_equal(np.concatenate(found), expected)
        parts.restore(kept)


@pytest.mark.parametrize("compiler", [True, False])
@pytest.mark.parametrize("name", MODELS)
def test_the_general_step_goes_the_same_way(name: str, compiler: bool, monkeypatch: Any) -> None:
    if not compiler:
        monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    graph, commands = MODELS[name](), {"V": volts()[:, 0]}
    time = STEP * np.arange(N)
    exact = simulate(graph, time, commands, accuracy=1e-7)
    found = simulate_general(graph, time, commands)
    assert found.steps_per_sample <= 4
    assert np.abs(found["v"] - exact["v"]).max() < 1e-5 * np.ptp(exact["v"])


def test_derivatives_of_the_general_step() -> None:
    program = program_of(equations(hysteretic()))
    p, u, x0 = np.array(program.nominal), volts(), np.array([1.1e-6])
    n_p = p.size

    def ran(p: Any, x0: Any, **options: Any) -> Any:
        return run_general(prepare_general(program, p, STEP, 2, **options), u, x0, "hold")

    run = ran(p, x0, directions=range(n_p), state_directions=True)
    for d in range(n_p + 1):
        at = np.append(p, x0)
        ends = []
        for size in (1e-6 * at[d], -1e-6 * at[d]):
            moved = at.copy()
            moved[d] += size
            ends.append(ran(moved[:n_p], moved[n_p:]).y)
        expected = (ends[0] - ends[1]) / (2e-6 * at[d] or np.inf)
        size = np.abs(expected).max()
        np.testing.assert_allclose(run.dy[:, :, d], expected, rtol=1e-5, atol=1e-6 * size)
