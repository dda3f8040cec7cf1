"""Several records under one vector of unknowns: exact derivatives, steps as of dense algebra."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.split import Split
from bondgraph.support.arrays import FloatArray as Array
from identification.estimation import Nuisances, SettledSetting, Study, Vary
from identification.estimation.levenberg_marquardt import FitStatus, minimise
from identification.estimation.single_record import fit, judge
from identification.study.data import data_for
from identification.study.joint import (
    STATE_WEIGHT,
    JointPoint,
    JointProblem,
    refine_states,
    stack_of,
)
from identification.study.problem import Problem
from identification.study.residual import evaluate, windows
from tests.identification.estimation.plants import record, spring

TAU = Parameter("tau", 0.013, "s", lower=0.0)
FLOOR = {"x": 1e-4}


@cache
def made(kind: str) -> JointProblem:
    graph = spring(m=0.6, speed=True)
    free: list[str | Vary] = ["m", Vary("d", own=True), "k"]
    if kind == "delays":
        graph = graph.with_parameters([TAU]).with_element("F", drive=Drive(delay="tau"))
        free.append("tau")
    nuisances = Nuisances(
        offsets=kind != "delays", lags=kind not in ("delays", "known"),
        clock=2e-4 if kind in ("clocks", "everything") else 0.0, commands=kind == "everything",
    )  # fmt: skip
    two = [record(160, seed=1, name="a"), record(120, 60.0, 2, name="b")]
    study = Study(
        graph, two, free=free, nuisances=nuisances, n_sub=2,
        window=40 if kind == "windows" else None,
        initial={"q_k": 0.01} if kind == "known" else "free",
        hold="band-limited" if kind == "everything" else "linear",
    )  # fmt: skip
    setting: SettledSetting = study.first_setting
    if kind in ("coloured", "everything"):
        colours = ((np.array([1.0, -0.8]),), (np.array([1.0, -1.2, 0.5]),))
        setting = replace(setting, whitening=colours)
    return study.stack(setting)


def somewhere(stack: JointProblem) -> JointPoint:
    """Return a point off the start where no kernel is centred anew."""
    begin = stack.start()
    theta = begin.theta + 0.05 * np.sin(1 + np.arange(stack.n))
    lower, upper = stack.bounds
    theta[upper <= lower] = begin.theta[upper <= lower]
    for i, name in enumerate(stack.names):
        if name.startswith("delay ") and upper[i] > lower[i]:
            theta[i] = 0.12 + 0.03 * (i % 3)
    states = tuple(s + 0.01 * np.cos(np.arange(s.size)).reshape(s.shape) for s in begin.states)
    return JointPoint(theta, states)


def residuals(stack: JointProblem, point: JointPoint) -> Array:
    return np.concatenate([e.residual for e in stack.evaluate(point, derivatives=False)])


def jacobian(stack: JointProblem, point: JointPoint) -> Array:
    """Of the residuals by the global unknowns, then by the initial states of all windows."""
    rows = []
    found = stack.evaluate(point)
    for r, e in enumerate(found):
        wide = np.zeros((e.residual.size, stack.n))
        wide[:, stack.columns[r]] = e.jacobian * stack.factors[r]
        rows.append(wide)
    return -np.concatenate(rows)


KINDS = ("plain", "clocks", "coloured", "delays", "windows", "known", "everything")


@pytest.mark.parametrize("kind", KINDS)
def test_jacobian_of_all_unknowns_matches_differences(kind: str) -> None:
    stack = made(kind)
    point = somewhere(stack)
    exact = jacobian(stack, point)
    lower, upper = stack.bounds
    for j in np.flatnonzero(upper > lower):
        h = 1e-5
        ends = []
        for sign in (1, -1):
            theta = point.theta.copy()
            theta[j] += sign * h
            ends.append(residuals(stack, JointPoint(theta, point.states)))
        numeric = (ends[0] - ends[1]) / (2 * h)
        size = np.linalg.norm(numeric)
        assert size > 0, stack.names[j]
        assert np.linalg.norm(exact[:, j] - numeric) < 2e-4 * size, stack.names[j]


@pytest.mark.parametrize("kind", KINDS)
def test_columns_of_the_states_match_differences(kind: str) -> None:
    stack = made(kind)
    point = somewhere(stack)
    found = stack.evaluate(point)
    for r, p in enumerate(stack.problems):
        for i, (rows, local) in zip(stack.scored(r), found[r].local, strict=True):
            assert local.shape[1] == p.free_states.size
            for k, at in enumerate(p.free_states):
                h = 1e-4 * p.state_scale[at]
                ends = []
                for sign in (1, -1):
                    states = [s.copy() for s in point.states]
                    states[r][i, at] += sign * h
                    moved = JointPoint(point.theta, tuple(states))
                    ends.append(stack.evaluate(moved, derivatives=False)[r].residual[rows])
                numeric = (ends[0] - ends[1]) / (2 * h)
                miss = np.linalg.norm(-local[:, k] - numeric)
                assert miss < 1e-5 * np.linalg.norm(numeric)


@pytest.mark.parametrize("kind", ["plain", "clocks", "coloured", "windows", "known"])
def test_step_is_that_of_dense_least_squares(kind: str) -> None:
    """With all states as unknowns beside theta, priors and the pull of the states as rows."""
    stack = made(kind)
    near = minimise(stack, stack.start(), max_iterations=8).point
    lower, upper = stack.bounds
    bent = near.theta + 1e-3 * np.where(upper > lower, np.cos(np.arange(stack.n)), 0.0)
    point = JointPoint(np.clip(bent, lower, upper), near.states)
    found = stack.evaluate(point)
    step = stack.step(stack.normal(found, point), point, 0.0)
    assert (step.theta[upper > lower] > lower[upper > lower]).all()
    assert (step.theta[upper > lower] < upper[upper > lower]).all()
    solved, states = dense_step(stack, point)
    assert step.theta - point.theta == pytest.approx(solved, rel=1e-5, abs=1e-8)
    for r, p in enumerate(stack.problems):
        moved = (step.states[r] - point.states[r]) / p.state_scale
        for i in stack.scored(r):
            expected = np.array([states[r, i, at] for at in p.free_states])
            assert moved[i, p.free_states] == pytest.approx(expected, rel=1e-4, abs=1e-7)


def dense_step(
    stack: JointProblem, point: JointPoint
) -> tuple[Array, dict[tuple[int, int, int], float]]:
    found = stack.evaluate(point)
    places = [
        (r, i, int(at))
        for r, p in enumerate(stack.problems)
        for i in stack.scored(r)
        for at in p.free_states
    ]
    by_theta = -jacobian(stack, point)
    by_state = np.zeros((by_theta.shape[0], len(places)))
    pull = np.zeros(len(places))
    first = 0
    for r, p in enumerate(stack.problems):
        for i, (rows, local) in zip(stack.scored(r), found[r].local, strict=True):
            for k, at in enumerate(p.free_states):
                j = places.index((r, i, int(at)))
                block = slice(first + rows.start, first + rows.stop)
                by_state[block, j] = local[:, k] * p.state_scale[at]
                if p.window is None:
                    pull[j] = (point.states[r][i] - p.rest_state)[at] / p.state_scale[at]
        first += found[r].residual.size
    weight, centre = stack.prior
    none = np.zeros((stack.n, len(places)))
    matrix = np.vstack([
        np.hstack([by_theta, by_state]),
        np.hstack([none.T, STATE_WEIGHT * np.eye(len(places))]),
        np.hstack([np.diag(weight), none]),
    ])  # fmt: skip
    right = np.concatenate([
        *(e.residual for e in found), -STATE_WEIGHT * pull, weight * (centre - point.theta)
    ])  # fmt: skip
    lower, upper = stack.bounds
    free = np.concatenate([upper > lower, np.ones(len(places), bool)])
    solved = np.zeros(free.size)
    solved[free] = np.linalg.lstsq(matrix[:, free], right, rcond=None)[0]
    return solved[: stack.n], dict(zip(places, map(float, solved[stack.n :]), strict=True))


def test_gradient_of_the_cost_is_zero_where_the_descent_ends() -> None:
    stack = made("plain")
    ended = minimise(stack, stack.start(), tolerance=1e-12, max_iterations=60)
    assert ended.status in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS)
    system = stack.normal(ended.evaluations, ended.point)
    step = np.linalg.pinv(system.factor) @ system.right
    error = np.linalg.norm(np.linalg.pinv(system.factor), axis=1)
    lower, upper = stack.bounds
    inside = (ended.point.theta > lower) & (ended.point.theta < upper)
    assert (np.abs(step[inside]) < 0.02 * error[inside]).all()
    assert (np.diff(ended.trace) <= 0).all()


@pytest.mark.parametrize(
    ("far", "status"), [(False, FitStatus.CONVERGED), (True, FitStatus.NO_PROGRESS)]
)
def test_where_no_step_lowers_the_cost_the_promise_tells_the_optimum_from_a_kink(
    monkeypatch: pytest.MonkeyPatch, far: bool, status: FitStatus
) -> None:
    """At an optimum rounding may make every step look worse; on the way there it may not."""
    stack = made("plain")
    begin = somewhere(stack) if far else minimise(stack, stack.start(), tolerance=1e-12).point
    cost = stack.cost(stack.evaluate(begin), begin)

    def worse(_: JointProblem, evaluations: Any, point: JointPoint) -> float:
        return cost if np.array_equal(point.theta, begin.theta) else cost * (1 + 1e-12)

    monkeypatch.setattr(JointProblem, "cost", worse)
    ended = minimise(stack, begin)
    assert ended.status is status
    assert np.array_equal(ended.point.theta, begin.theta)


def test_shared_and_own_unknowns_and_their_labels() -> None:
    stack = made("plain")
    assert stack.names[:2] == ("m", "d @a")
    assert "d @b" in stack.names
    assert stack.names.count("m") == stack.names.count("k") == 1
    a, b = stack.columns
    shared = {stack.names[i] for i in set(a) & set(b)}
    assert shared == {"m", "k"}
    assert sorted({*a, *b}) == list(range(stack.n))


def test_dead_time_counts_in_samples_of_each_record() -> None:
    stack = made("delays")
    begin = stack.start()
    for r, dt in enumerate((0.01, 1 / 60)):
        p, local = stack.problems[r], stack.local(begin, r)
        at = len(p.free) + len(p.data.names)
        assert local.theta[at] * dt == pytest.approx(0.013)


def test_a_dead_time_declared_fixed_is_held_and_others_start_where_declared() -> None:
    r = record(120)
    for fixed in (True, False):
        tau = replace(TAU, fixed=fixed)
        graph = spring().with_parameters([tau]).with_element("F", drive=Drive(delay="tau"))
        problem = Problem(
            graph, data_for(graph, r, Split(slice(0, 120), slice(0, 0), "all"), FLOOR)
        )
        stack = stack_of((problem,))
        at = stack.names.index("tau")
        assert stack.start().theta[at] * r.dt == pytest.approx(TAU.value)
        lower, upper = (b[at] * r.dt for b in stack.bounds)
        assert (lower == upper) == fixed
        assert not fixed or lower == pytest.approx(TAU.value)


def test_gathering_undoes_the_parting() -> None:
    stack = made("delays")
    point = somewhere(stack)
    back = stack.gathered([stack.local(point, r) for r in range(2)])
    assert back.theta == pytest.approx(point.theta, rel=1e-14)


def test_priors_count_once_for_shared_unknowns() -> None:
    one = made("plain")
    point = somewhere(one)
    found = one.evaluate(point)
    weight, centre = one.prior
    total = sum(float(e.residual @ e.residual) for e in found)
    total += float(np.sum((weight * (point.theta - centre)) ** 2))
    for r, p in enumerate(one.problems):
        away = (point.states[r] - p.rest_state) / p.state_scale
        total += float(np.sum((STATE_WEIGHT * away) ** 2))
    rows = sum(e.residual.size for e in found)
    assert one.cost(found, point) == pytest.approx(total / rows, rel=1e-12)


def test_states_of_windows_improve_one_by_one() -> None:
    stack = made("windows")
    point = somewhere(stack)
    for r, p in enumerate(stack.problems):
        local = stack.local(point, r)
        better = refine_states(p, local)
        assert np.array_equal(better.theta, local.theta)
        before, after = (
            stack.evaluate(JointPoint(point.theta, (*point.states[:r], s, *point.states[r + 1 :])))[
                r
            ]
            for s in (local.states, better.states)
        )
        for rows, _ in before.local:
            old, new = before.residual[rows], after.residual[rows]
            assert new @ new <= old @ old * (1 + 1e-9)
        assert after.residual @ after.residual < 0.5 * (before.residual @ before.residual)


def judged(stack: JointProblem) -> JointProblem:
    """Return the first record alone, of whose windows the last half judges."""
    p = stack.problems[0]
    split = Split(slice(0, p.data.n // 2), slice(p.data.n // 2, p.data.n), "halves")
    return stack_of((replace(p, data=replace(p.data, split=split), built=p.dynamics),))


def test_what_is_scored_is_the_same_without_the_windows_that_judge() -> None:
    stack = judged(made("windows"))
    p, local = stack.problems[0], stack.local(stack.start(), 0)
    whole, scored = (evaluate(p, local, scored=s) for s in (False, True))
    assert np.array_equal(scored.residual, whole.residual)
    assert np.array_equal(scored.jacobian, whole.jacobian)
    for (rows, columns), (here, same) in zip(scored.local, whole.local, strict=True):
        assert rows == here
        assert np.array_equal(columns, same)
    train = p.data.mask("train")
    assert np.array_equal(scored.y[train], whole.y[train])
    assert np.isnan(scored.y[~train]).all()
    assert np.isfinite(whole.y).all()


@pytest.fixture
def one_by_one() -> Iterator[None]:
    """Windows run one after the other, where their runs can be counted."""
    with patch.object(Problem, "apart", False):
        yield


@pytest.mark.usefixtures("one_by_one")
def test_no_window_runs_without_need() -> None:
    stack = judged(made("windows"))
    p, point = stack.problems[0], stack.start()
    run, runs = type(p.dynamics).run, Counter[int]()

    def counted(dynamics: Any, ready: Any, u: Array, *more: Any, **named: Any) -> Any:
        runs[u.ctypes.data] += 1
        return run(dynamics, ready, u, *more, **named)

    own = {p.inputs[windows(p)[i]].ctypes.data for i in stack.scored(0)}
    assert p.state_scale.all()  # known from a run of its own
    with patch.object(type(p.dynamics), "run", counted):
        refine_states(p, stack.local(point, 0), passes=1)
        assert runs == dict.fromkeys(own, 2)
        runs.clear()
        found = minimise(stack, point, max_iterations=2).evaluations[0]
    assert {n for u, n in runs.items() if u not in own} == {1}
    assert np.isfinite(found.y).all()


@pytest.mark.usefixtures("one_by_one")
def test_windows_with_nothing_to_gain_run_once() -> None:
    stack = judged(made("windows"))
    p = stack.problems[0]
    settled = refine_states(p, stack.local(stack.start(), 0))
    with patch.object(
        type(p.dynamics), "run", autospec=True, side_effect=type(p.dynamics).run
    ) as run:
        again = refine_states(p, settled)
    assert run.call_count == len(stack.scored(0))
    assert np.array_equal(again.states, settled.states)


@pytest.mark.usefixtures("one_by_one")
def test_beyond_a_limit_nothing_is_simulated() -> None:
    stack = judged(made("windows"))
    p, local = stack.problems[0], stack.local(stack.start(), 0)
    whole = evaluate(p, local, scored=True)
    total = float(whole.residual @ whole.residual)
    assert np.array_equal(
        evaluate(p, local, scored=True, limit=1.01 * total).residual, whole.residual
    )
    stopped = evaluate(p, local, scored=True, limit=0.1 * total)
    assert np.isinf(stopped.residual).all()
    assert np.isnan(stopped.y).sum() > np.isnan(whole.y).sum()


def test_a_fit_may_be_judged_later() -> None:
    p = judged(made("windows")).problems[0]
    once, later = (fit(p, max_iterations=2, judged=j) for j in (True, False))
    assert np.isnan(later.simulated[p.data.mask("test")]).all()
    found = judge(later)
    assert np.array_equal(found.point.states, once.point.states)
    assert np.array_equal(found.simulated, once.simulated)
    assert np.isfinite(found.simulated).all()
