"""Fits with many sub-steps: derivatives of few lead to the same end."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Coulomb, Polynomial
from bondgraph.signals.recording import Split
from bondgraph.signals.split import interleaved
from bondgraph.simulation.start import HOLDS
from identification.estimation import sub_steps
from identification.estimation.single_record import Fit, fit
from identification.estimation.sub_steps import (
    EASED,
    FINEST,
    IN_ALL,
    LEAST,
    begun_from,
    coarse,
    eased,
    finest_of,
    fit_from,
    refined,
    tried_from,
    with_few,
)
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import LOCATED, Point, evaluate, slots, start_point
from tests.settled import simulate
from tests.spring import spring

N, DT, MANY = 1200, 0.02, 16
NOISE = {"cubic": 5e-7, "dry": 2e-5}


def plant(law: str, **values: float) -> BondGraph:
    if law == "dry":
        return spring(friction=Coulomb(0.5)).with_values(values)
    return spring(law=Polynomial(0.0, 0.05, 4.0, (3,))).with_values({"a_3_k": 3.0} | values)


@cache
def problem(law: str) -> Problem:
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 4 * np.sin(2 * np.pi * 0.9 * t) + 2 * np.sin(2 * np.pi * 3.1 * t + 1)
    x = np.asarray(simulate(plant(law), t, {"F": u})["x"])
    y = x + NOISE[law] * np.random.default_rng(2).standard_normal(N)
    split = Split(slice(0, 800), slice(800, N), "last third")
    data = Data("run", t, {"F": u}, y[:, None], ("x",), np.array([NOISE[law]]), split)
    wrong = {"m": 0.52, "k": 208.0, "d": 2.2}
    return Problem(plant(law, **wrong), data, n_sub=MANY)


def begun(p: Problem) -> Point:
    """Return where a fit with one sub-step ends."""
    return fit(replace(p, n_sub=1)).point


def test_it_ends_where_derivatives_of_all_steps_end() -> None:
    p = problem("cubic")
    start = begun(p)
    whole, quick = fit(p, start=start), fit_from(p, start, 40)
    assert fit(replace(p, n_sub=1)).cost > 1.5 * whole.cost  # else one sub-step would do
    assert quick.cost == pytest.approx(whole.cost, rel=2e-3)
    assert quick.problem.n_sub == MANY
    assert quick.problem.correction is None
    there = evaluate(p, quick.point, derivatives=False)
    assert np.array_equal(there.y, quick.simulated)
    for a, b in zip(whole.estimates, quick.estimates, strict=True):
        half = 0.5 * (a.ci95[1] - a.ci95[0])
        assert abs(a.value - b.value) < 0.25 * half  # half a standard error
        assert b.ci95[1] - b.ci95[0] == pytest.approx(2 * half, rel=0.1)


@pytest.mark.long
def test_a_law_that_jumps_is_fitted_as_well() -> None:
    # every sub-step places the jumps anew: derivatives of all of them may end at a kink earlier
    p = problem("dry")
    start = begun(p)
    assert fit_from(p, start, 40).cost < 1.002 * fit(p, start=start).cost
    assert fit_from(p, start, 40).cost < 0.8 * fit(replace(p, n_sub=1)).cost


def test_derivatives_are_those_of_few_sub_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    p, asked = problem("cubic"), []

    def counted(problem: Problem, **more: object) -> Fit:
        asked.append(problem.n_sub)
        return fit(problem, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(sub_steps, "fit", counted)
    fit_from(p, begun(p), 40)
    assert asked
    assert max(asked) < MANY


def test_where_few_are_too_coarse_all_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    p = problem("cubic")
    monkeypatch.setattr(sub_steps, "LARGEST", 0.0)
    there = evaluate(p, begun(p), derivatives=False)
    assert with_few(p, begun(p), there) is None
    assert fit_from(p, begun(p), 40).cost == fit(p, start=begun(p)).cost


def test_sub_steps_are_refined_beside_a_dead_time() -> None:
    # the readings of a late sensor are taken between four sub-steps at least
    p = problem("cubic")
    late = p.graph.with_element("x", delay="late").with_parameters(
        [Parameter("late", 0.3 * DT, "s", lower=0.0, upper=2 * DT, scale=DT)]
    )
    found = refined(fit(replace(p, graph=late, n_sub=1), max_iterations=3), 3)
    assert found.problem.n_sub > 4


def test_one_sub_step_is_an_ordinary_fit() -> None:
    p = replace(problem("cubic"), n_sub=1)
    assert fit_from(p, start_point(p), 3).cost == fit(p, max_iterations=3).cost


def test_longer_records_are_refined_to_fewer_sub_steps() -> None:
    lengths = [100, IN_ALL // FINEST, IN_ALL // FINEST + 1, IN_ALL // LEAST, 100 * IN_ALL]
    assert [finest_of(n) for n in lengths] == [FINEST, FINEST, FINEST // 2, LEAST, LEAST]


def test_a_law_that_jumps_is_followed_to_its_jump() -> None:
    """Few sub-steps are enough then, and leave less than many in which a jump waits for an end."""
    p = problem("dry")
    found = refined(fit(replace(p, n_sub=1)), 20)
    assert found.problem.n_sub == LOCATED < LEAST
    point, (u, t) = start_point(p), (dict(p.data.commands), p.data.time)
    begun = dict(zip(p.dynamics.state_names, point.states[0], strict=True))
    whole = simulate(p.graph, t, u, x0=begun, hold=p.data.hold, accuracy=1e-9)["x"]

    def off(n_sub: int) -> float:
        y = evaluate(replace(p, n_sub=n_sub), point, derivatives=False).y
        return float(np.abs(y[:, 0] - whole).max())

    assert off(LOCATED) < 0.1 * off(LOCATED - 1)


def test_derivatives_of_followed_readings_are_those_of_their_differences() -> None:
    p = replace(problem("dry"), n_sub=LOCATED)
    point = fit(p, max_iterations=3).point
    here = evaluate(p, point)
    for i in range(slots(p).free.stop):
        ends = []
        for move in (1e-3, -1e-3):
            theta = point.theta.copy()
            theta[i] += move
            ends.append(evaluate(p, replace(point, theta=theta), derivatives=False).residual)
        slope = (ends[1] - ends[0]) / 2e-3  # the Jacobian is that of the readings
        assert np.linalg.norm(here.jacobian[:, i] - slope) < 0.02 * np.linalg.norm(slope)


@pytest.mark.parametrize("truth", ["linear", "hold"])
@pytest.mark.parametrize("n_sub", [2, 8])
def test_from_commands_without_kinks_to_others(truth: str, n_sub: int) -> None:
    # what many sub-steps change there is the behaviour between samples itself
    t = np.asarray(DT * np.arange(600), np.float64)
    rng = np.random.default_rng(0)
    u = rng.uniform(-1, 1, 600)
    x = np.asarray(simulate(spring(), t, {"F": u}, hold=truth)["x"])
    y = (x + 3e-6 * rng.standard_normal(600))[:, None]
    data = Data("run", t, {"F": u}, y, ("x",), np.array([3e-6]), interleaved(0, 600))
    smooth = replace(data, hold="band-limited")
    wrong = fit(Problem(spring(), smooth, n_sub=n_sub), max_iterations=20)
    right = fit(Problem(spring(), replace(data, hold=truth)), max_iterations=20)
    assert wrong.cost > 2 * right.cost
    other = replace(wrong.problem, data=replace(data, hold=truth))
    assert tried_from(other, wrong.point, 4).cost == pytest.approx(right.cost, rel=0.05)


@pytest.mark.parametrize("truth", HOLDS)
def test_one_correction_tells_how_commands_behave(truth: str) -> None:
    p, t = problem("cubic"), np.asarray(DT * np.arange(N), np.float64)
    x = np.asarray(simulate(plant("cubic"), t, dict(p.data.commands), hold=truth)["x"])
    y = (x + NOISE["cubic"] * np.random.default_rng(2).standard_normal(N))[:, None]
    held = {h: replace(p, data=replace(p.data, readings=y, hold=h)) for h in HOLDS}
    ends = {h: fit_from(q, begun(replace(q, n_sub=4)), 40) for h, q in held.items()}
    for h in set(HOLDS) - {truth}:
        assert tried_from(held[truth], ends[h].point, 4).cost < 0.1 * ends[h].cost
        assert tried_from(held[h], ends[truth].point, 4).cost > 10 * ends[truth].cost


@pytest.mark.parametrize("law", NOISE)
def test_a_beginning_with_few_is_said_of_many(law: str) -> None:
    p = problem(law)
    found, whole = begun_from(p, start_point(p), 4), fit(p, max_iterations=4)
    assert found.problem.n_sub == MANY
    assert found.problem.correction is None
    there = evaluate(p, found.point, derivatives=False)
    assert found.cost == pytest.approx(float(np.mean(there.residual**2)), rel=1e-9)
    assert found.cost < 2.0 * whole.cost


@pytest.mark.parametrize("law", NOISE)
def test_a_problem_that_is_eased_begins_where_the_whole_one_does(law: str) -> None:
    p = problem(law)
    light, point = eased(p), start_point(p)
    whole = evaluate(p, point, derivatives=False)
    assert MANY // EASED <= light.n_sub < MANY
    assert evaluate(light, point, derivatives=False).y == pytest.approx(whole.y, rel=1e-9)
    rough = coarse(p)
    assert rough.n_sub <= light.n_sub
    assert rough.correction is None


def test_what_needs_no_sub_steps_is_not_eased() -> None:
    p = replace(problem("cubic"), n_sub=1)
    assert eased(p) is p
    assert coarse(p) is p
