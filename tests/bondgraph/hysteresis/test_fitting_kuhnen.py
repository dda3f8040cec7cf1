"""Plays and dead zones fitted together: recovery, optimality, normalisation, descent."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import Ang, BadInput, BadParameter, DeadZones
from bondgraph.hysteresis import PrandtlIshlinskii as Plays
from bondgraph.hysteresis.fitting import fit_kuhnen, fit_weights
from bondgraph.hysteresis.fitting.kuhnen_stages import dead_zone_columns

quick = settings(max_examples=15, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)
X = 5.0 * np.linspace(0.2, 1.0, 3000) * np.sin(np.linspace(0.0, 40.0, 3000))


def random_truth(rng: np.random.Generator) -> Ang:
    """Slopes of both stages within a factor of three; dead zones on both sides."""
    thresholds = (0.0, 0.5, 1.2, 2.0, 3.0)
    plays = np.diff(rng.uniform(0.4, 1.2, 5), prepend=0.0)
    left, right = rng.uniform(0.5, 1.5, (2, 3))
    right[0] = left[0]
    outward = (*np.diff(left)[::-1], left[0], *np.diff(right))
    return Ang(Plays(thresholds, tuple(plays)), DeadZones((-1.8, -0.7, 0.0, 0.6, 1.5), outward))


def mean_slope(stage: DeadZones, y: Any) -> float:
    low, high = min(0.0, y.min()), max(0.0, y.max())
    ends = stage.run([low, high])[0]
    return float((ends[1] - ends[0]) / (high - low))


@quick
@given(seed=seeds)
def test_exact_records_give_the_operator_back(seed: Any) -> None:
    """Up to the factor that can be moved from one stage to the other."""
    truth = random_truth(np.random.default_rng(seed))
    y, _ = truth.run(X)
    fit = fit_kuhnen(X, y, truth.play, truth.dead_zone.inverse().thresholds, max_steps=0)
    assert fit.rms < 1e-9
    assert mean_slope(fit.inverse_dead_zone, y) == pytest.approx(1.0)
    factor = fit.operator.play.weights[0] / truth.play.weights[0]
    np.testing.assert_allclose(
        fit.operator.play.weights, factor * np.array(truth.play.weights), atol=1e-7
    )
    np.testing.assert_allclose(
        fit.operator.dead_zone.weights, np.array(truth.dead_zone.weights) / factor, atol=1e-7
    )
    assert fit.active_plays == fit.active_dead_zones == ()


@quick
@given(seed=seeds)
def test_the_descent_lowers_the_output_error_to_the_noise(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    truth = random_truth(rng)
    y = truth.run(X)[0] + rng.normal(0.0, 0.05, X.size)
    fit = fit_kuhnen(X, y, truth.play, truth.dead_zone.inverse().thresholds)
    assert fit.rms <= fit.rms_convex
    assert fit.rms == pytest.approx(0.05, rel=0.08)
    modelled = fit.operator.run(X, fit.memory)[0]
    assert fit.rms == pytest.approx(np.sqrt(np.mean((modelled - y) ** 2)))
    back = fit.operator.inverse().run(modelled, fit.operator.inverse_memory(fit.memory))[0]
    np.testing.assert_allclose(back, X, atol=1e-9)


def quadratic_program(y: Any, thresholds: Any, zones: Any, minimum: float, plays: bool) -> float:
    """Solve the joint problem by another method; return its least mean square error."""
    stage = DeadZones(zones, (1.0,) * len(zones))
    bank = Plays(thresholds, (1.0,) * len(thresholds))
    phi = np.hstack((bank.regressors(X), -dead_zone_columns(stage, y)))
    n, zero = len(thresholds), stage.zero_index
    slopes = np.zeros((phi.shape[1], phi.shape[1]))
    slopes[:n, :n] = np.tril(np.ones((n, n))) if plays else np.eye(n)
    for j in range(len(zones)):
        reach = range(min(j, zero), max(j, zero) + 1)
        slopes[n + j, [n + k for k in reach]] = 1.0
    low = np.full(phi.shape[1], minimum)
    low[:n] *= np.ptp(y) / np.ptp(X)
    if not plays:
        low[1:n] = 0.0
    ends = dead_zone_columns(stage, np.array([y.min(), y.max()]))
    mean = np.append(np.zeros(n), (ends[1] - ends[0]) / (y.max() - y.min()))
    rows = np.vstack((slopes, mean))
    hessian = phi.T @ phi / y.size
    options = {"print_iter": False, "print_header": False, "print_info": False, "error_on_fail": 0}
    solver = ca.conic(
        "joint", "qrqp", {"h": ca.DM(hessian).sparsity(), "a": ca.DM(rows).sparsity()}, options
    )
    found = solver(
        h=ca.DM(hessian), a=ca.DM(rows), lba=np.append(low, 1.0), uba=np.append(low * 0 + 1e6, 1.0)
    )
    w = np.array(found["x"]).ravel()
    assert np.all(rows[:-1] @ w > low - 1e-8)
    assert abs(mean @ w - 1.0) < 1e-8
    return float(np.mean((phi @ w) ** 2))


@pytest.mark.parametrize("constraint", ["prefix_sums", "non_negative"])
@pytest.mark.parametrize("minimum", [1e-3, 0.8])
def test_the_convex_fit_is_the_minimum(constraint: Any, minimum: Any) -> None:
    """Against a general solver of quadratic programs, with and without active bounds."""
    rng = np.random.default_rng(11)
    truth = random_truth(rng)
    y = truth.run(X)[0] + rng.normal(0.0, 0.05, X.size)
    zones = (-1.5, -0.5, 0.0, 0.5, 1.5)
    fit = fit_kuhnen(X, y, truth.play, zones, constraint, minimum=minimum, max_steps=0)
    plays, _ = fit.operator.play.run(X)
    joint = np.mean((plays - fit.inverse_dead_zone.run(y)[0]) ** 2)
    other = quadratic_program(y, truth.play.thresholds, zones, minimum, constraint == "prefix_sums")
    assert joint == pytest.approx(other, rel=1e-6)
    if minimum == 0.8:
        assert fit.active_plays or fit.active_dead_zones


def test_bounds_hold_and_are_reported() -> None:
    truth = Ang(Plays((0, 1), (1.0, 0.5)), DeadZones((0.0, 1.0), (1.0, -0.97)))
    y, _ = truth.run(X)
    fit = fit_kuhnen(X, y, (0, 1), (0.0, 1.0), minimum=0.7)
    outward = np.cumsum(fit.inverse_dead_zone.weights)
    assert fit.active_dead_zones == (0,)
    assert outward[0] == pytest.approx(0.7)
    assert mean_slope(fit.inverse_dead_zone, y) == pytest.approx(1.0)


def test_the_ang_operator_of_the_stack() -> None:
    """Eq. (6.3): the 13 plays and the dead zone come back from a decaying record."""
    truth = Ang.stack_2hz()
    x = 60.0 * np.linspace(1.0, 0.1, 6000) * np.sin(np.linspace(0.0, 80.0, 6000))
    y, _ = truth.run(x)
    fit = fit_kuhnen(x, y, truth.play, truth.dead_zone.inverse().thresholds)
    assert fit.rms < 1e-9 * np.ptp(y)
    factor = truth.dead_zone.weights[0] / fit.operator.dead_zone.weights[0]
    found = np.array(fit.operator.play.weights) / factor
    np.testing.assert_allclose(found, truth.play.weights, atol=1e-6 * 11.13e-9)
    bend = fit.operator.dead_zone
    assert bend.weights[1] / bend.weights[0] == pytest.approx(0.21 / 1.47)
    assert bend.thresholds[1] / factor == pytest.approx(342.58e-9)


def test_dead_zones_follow_an_asymmetric_loop_better() -> None:
    """A loop that is no member of either class: plays that saturate smoothly upward."""
    x = np.tile(50.0 - 50.0 * np.cos(2 * np.pi * np.arange(1000) / 1000), 3)
    y = 5e-6 * np.tanh(2e5 * Ang.stack_2hz().play.run(x)[0])
    r = np.linspace(0.0, 48.0, 13)
    plain = fit_weights(r, x, y)
    bent = fit_kuhnen(x, y, r, np.linspace(0.0, 2.4e-6, 9))
    assert bent.rms < 0.1 * plain.rms
    assert bent.rms < bent.rms_convex


def test_zones_and_plays_without_evidence_are_named() -> None:
    truth = Ang(Plays((0, 1), (1.0, 0.5)), DeadZones((0.0, 1.0), (1.0, 0.5)))
    x = np.abs(X)
    y, _ = truth.run(x)
    fit = fit_kuhnen(x, y, (0, 1, 7), (-2.0, 0.0, 1.0, 50.0))
    assert fit.rms < 1e-10
    assert [s.index for s in fit.unexcited_plays] == [2]
    assert [s.index for s in fit.unexcited_dead_zones] == [0, 3]
    assert "d' = 50" in fit.unexcited_dead_zones[1].name
    assert "does not pass" in fit.unexcited_dead_zones[1].reason
    assert fit.operator.dead_zone.weights[0] == fit.operator.dead_zone.weights[3] == 0.0


def test_unknown_past() -> None:
    truth = random_truth(np.random.default_rng(2))
    x = X[::-1]
    y, _ = truth.run(x, truth.initial_memory(x[0], (-3.0, 3.0, -3.0, 3.0)))
    zones = truth.dead_zone.inverse().thresholds
    fit = fit_kuhnen(x, y, (*truth.play.thresholds, 20.0), zones, memory="unknown")
    assert 0 < fit.start < 1500
    assert fit.rms < 1e-9
    assert [s.index for s in fit.unexcited_plays] == [5]
    modelled = fit.operator.run(x[fit.start :], fit.memory)[0]
    np.testing.assert_allclose(modelled, y[fit.start :], atol=1e-9)


def test_a_record_that_stands_once_the_past_is_forgotten_is_named() -> None:
    x = np.append(0.0, np.full(80, 10.0))
    with pytest.raises(BadInput, match=r"x is constant at 10 over the .* samples that are scored"):
        fit_kuhnen(x, x, (0, 1), (0.0, 2.0), memory="unknown")
    late = np.append(0.0, 10.0 + np.linspace(0.0, 1.0, 80))
    with pytest.raises(BadInput, match="y is constant at 10"):
        fit_kuhnen(late, x, (0, 1), (0.0, 2.0), memory="unknown")


LINE = [0.0, 1.0, 2.0, 3.0, 1.0]


@pytest.mark.parametrize(
    ("x", "y", "zones", "options", "error", "words"),
    [
        ([0, 1, np.nan, 1, 1], LINE, (0.0,), {}, BadInput, r"x\[2\] = nan"),
        (LINE, LINE[:2], (0.0,), {}, BadInput, "x has 5 samples but y has 2"),
        (LINE, LINE, (1.0, 2.0), {}, BadParameter, "number 0 once"),
        (LINE, LINE, 0.0, {}, BadParameter, "dead_zone_thresholds = 0.0 must be a sequence"),
        (LINE, LINE, (0.0, 2.0, 1.0), {}, BadParameter, "not above"),
        (LINE, LINE, (0.0, 0.5, 1.0, 1.5, 2.0), {}, BadInput, "5 samples cannot determine 2"),
        (LINE, LINE, (0.0,), {"constraint": "none"}, BadParameter, "'none'"),
        (LINE, LINE, (0.0,), {"minimum": 1.0}, BadParameter, "minimum = 1.0"),
        (LINE, LINE, (0.0,), {"max_steps": -1}, BadParameter, "max_steps = -1"),
        (LINE, [-v for v in LINE], (0.0,), {}, BadInput, "y falls where x rises"),
    ],
)
def test_bad_input_is_named(
    x: Any, y: Any, zones: Any, options: Any, error: Any, words: Any
) -> None:
    with pytest.raises(error, match=words):
        fit_kuhnen(x, y, (0, 1), zones, **options)
