"""The fit: exact derivatives, true parameters within their intervals, bounds, words."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.fractional_delay import delayed
from bondgraph.signals.recording import Split
from identification.estimation import single_record
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import best, fit
from identification.study.data import Data
from identification.study.joint import NUISANCE_LAG
from identification.study.problem import Problem
from identification.study.residual import Point, evaluate, slots, start_point
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 1500, 0.01, 2e-4
TRUTH = {"m": 0.5, "d": 2.0, "k": 200.0}


def measured(offset: float = 0.0, lag: float = 0.0, noise: float = NOISE, n: int = N) -> Data:
    t = np.asarray(DT * np.arange(n), np.float64)
    rng = np.random.default_rng(5)
    u = np.cumsum(rng.standard_normal(n)) * 0.3 + 4 * np.sin(2 * np.pi * 1.1 * t)
    x = delayed(np.asarray(simulate(spring(), t, {"F": u})["x"]), lag)[0] + offset
    x = x + noise * rng.standard_normal(n)
    cut = 2 * n // 3
    split = Split(slice(0, cut), slice(cut, n), "last third")
    return Data("run", t, {"F": u}, x[:, None], ("x",), np.array([NOISE]), split)


@pytest.fixture(scope="module")
def data() -> Data:
    return measured(offset=3e-3, lag=0.1)


def test_a_fit_without_finite_sensitivities_keeps_its_values(
    data: Data, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> None:
        raise np.linalg.LinAlgError("the sensitivities are not finite")

    monkeypatch.setattr(single_record, "inverse_information", none)
    f = fit(Problem(spring(), data), max_iterations=1)
    assert {e.name for e in f.estimates} == {"m", "d", "k"}
    assert all(e.ci95[0] < 1e-290 * e.value < 1e290 * e.value < e.ci95[1] for e in f.estimates)


def test_true_parameters_lie_in_their_intervals(data: Data) -> None:
    # force, mass, damping and stiffness: all three show in the displacement from a known force
    f = fit(Problem(spring(0.65, 1.2, 260.0), data))
    assert f.status is FitStatus.CONVERGED
    assert f.chi2("test") == pytest.approx(1.0, abs=0.15)
    for e in f.estimates:
        low, high = e.ci95
        wide = 0.5 * (high - low)
        assert abs(e.value - TRUTH[e.name]) < 1.6 * wide, e
        assert e.value == pytest.approx(TRUTH[e.name], rel=0.02)
    found = {e.name: e for e in f.nuisances}
    assert found["offset x"].value == pytest.approx(3e-3, abs=1e-4)
    assert found["delay x"].value == pytest.approx(0.1 * DT, abs=0.03 * DT)
    assert not found["delay x"].at_bound


def test_delay_is_a_nuisance_only_within_its_bounds() -> None:
    f = fit(Problem(spring(), measured(lag=2.0)), max_iterations=15)
    (late,) = (e for e in f.nuisances if e.name == "delay x")
    assert late.at_bound
    assert late.value == pytest.approx(NUISANCE_LAG * DT)
    assert f.chi2("test") > 2


def test_declared_delay_is_found() -> None:
    tau = Parameter("tau", 0.5 * DT, "s", lower=0.0)
    g = spring().with_parameters([tau]).with_element("F", drive=Drive(delay="tau"))
    f = fit(Problem(g, measured(lag=2.3), starts={"tau": DT}))
    assert f.values["tau"] == pytest.approx(2.3 * DT, abs=0.05 * DT)
    assert f.chi2("test") < 1.3


def test_bounds_are_kept(data: Data) -> None:
    g = spring(k=150.0)
    g = g.with_element("k", stiffness="stiff").with_parameters(
        [Parameter("stiff", 150.0, "N/m", lower=100.0, upper=160.0)]
    )
    f = fit(Problem(g, data), max_iterations=20)
    (e,) = (e for e in f.estimates if e.name == "stiff")
    assert 100.0 <= e.value <= 160.0 * (1 + 1e-9)
    assert e.at_bound


def test_fixed_parameters_stay(data: Data) -> None:
    f = fit(Problem(spring(d=3.0), data, fixed=("d",)), max_iterations=5)
    assert f.values["d"] == 3.0
    assert "d" not in {e.name for e in f.estimates}


def test_status_of_a_broken_start(data: Data) -> None:
    bad = replace(data, readings=np.full_like(data.readings, np.nan))
    f = fit(Problem(spring(), bad))
    assert f.status is FitStatus.BROKEN
    assert f.cost == np.inf
    assert "failed" in f.status.value
    good = fit(Problem(spring(), data), max_iterations=1)
    assert good.status is FitStatus.ITERATIONS
    assert "max_iterations" in good.status.value
    assert best([f, good]) is good


def test_problem_and_fit_travel_to_other_processes(data: Data) -> None:
    problem = Problem(spring(), data, starts={"k": 210.0})
    before = evaluate(problem, start_point(problem))
    again = pickle.loads(pickle.dumps(problem))
    after = evaluate(again, start_point(again))
    assert np.array_equal(before.residual, after.residual)
    f = fit(problem, max_iterations=3)
    assert pickle.loads(pickle.dumps(f)).values == f.values


# -- exact derivatives ------------------------------------------------------------------------
def problem_of(kind: str) -> tuple[Problem, float]:
    data = measured(n=400)
    tau = Parameter("tau", 0.5 * DT, "s", lower=0.0)
    if kind == "windows":
        return Problem(spring(), data, window=60), 0.0
    if kind == "declared_drive":
        g = spring().with_parameters([tau]).with_element("F", drive=Drive(delay="tau"))
        return Problem(g, data, starts={"tau": 1.3 * DT}), 0.0
    if kind == "declared_sensor":
        g = spring().with_parameters([tau]).with_element("x", delay="tau")
        return Problem(g, data, starts={"tau": 1.3 * DT}), 0.0
    if kind == "source_offsets":
        return Problem(spring(), data, source_offsets=True), 0.0
    if kind == "hold":
        return Problem(spring(), replace(data, hold="hold"), n_sub=2), 0.0
    return Problem(spring(), data), 0.13 if kind == "lag" else 0.0


KINDS = ("plain", "lag", "windows", "declared_drive", "declared_sensor", "source_offsets", "hold")


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_match_differences(kind: str) -> None:
    problem, lag = problem_of(kind)
    at = slots(problem)
    here = start_point(problem)
    theta = here.theta + 0.02 * np.sin(1 + np.arange(at.size))
    theta[at.lags] = lag
    theta[at.delays] = here.theta[at.delays]
    point = Point(theta, here.states + 1e-3)
    e = evaluate(problem, point)
    assert e.jacobian.shape == (e.residual.size, at.size)
    plain = evaluate(problem, point, derivatives=False)
    assert np.allclose(plain.residual, e.residual, rtol=1e-9, atol=1e-9)
    for j in range(at.size):
        if kind not in ("lag", "plain") and at.lags.start <= j < at.lags.stop:
            continue
        h = 1e-5
        up, down = theta.copy(), theta.copy()
        up[j], down[j] = up[j] + h, down[j] - h
        rise = evaluate(problem, Point(up, point.states), derivatives=False).residual
        fall = evaluate(problem, Point(down, point.states), derivatives=False).residual
        exact, numeric = -e.jacobian[:, j], (rise - fall) / (2 * h)
        size = np.linalg.norm(numeric) + 1e-12
        if kind == "plain" and at.lags.start <= j < at.lags.stop:
            continue  # the kernel is centred anew at zero
        assert np.linalg.norm(exact - numeric) < 2e-3 * size, j
    for i, (rows, local) in enumerate(e.local):
        for k in range(local.shape[1]):
            h = 1e-6
            up, down = point.states.copy(), point.states.copy()
            up[i, k], down[i, k] = up[i, k] + h, down[i, k] - h
            rise = evaluate(problem, Point(theta, up), derivatives=False).residual[rows]
            fall = evaluate(problem, Point(theta, down), derivatives=False).residual[rows]
            numeric = (rise - fall) / (2 * h)
            assert np.linalg.norm(-local[:, k] - numeric) < 1e-4 * np.linalg.norm(numeric)
