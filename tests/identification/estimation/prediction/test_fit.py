"""Fits on data with and without process noise: values, intervals, coverage, words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.laws import Coulomb, Polynomial, StopSum
from bondgraph.support.arrays import Array
from identification.estimation import Estimation, FitStatus, Vary, estimate
from identification.estimation.prediction.fit import FilterFit, fit_filter
from identification.estimation.prediction.likelihood import evaluate
from identification.estimation.prediction.words import remarks
from identification.estimation.single_record import fit
from identification.study.problem import Problem
from tests.identification.estimation.prediction.plants import (
    DAMPING,
    MASS,
    STIFFNESS,
    euler_maruyama,
    filter_of,
    random_force,
    recording_of,
    spring,
    study_of,
)
from tests.settled import simulate

DT, N, SIGMA, NOISE = 0.02, 600, 0.3, 5e-4
TRUTH = {"m": MASS, "d": DAMPING, "k": STIFFNESS}
RUNS = 24


@pytest.fixture(scope="module")
def fits() -> list[tuple[FilterFit, FilterFit]]:
    """With process noise at the momentum, and without (single shooting), on the same data."""
    rng = np.random.default_rng(11)
    u = np.stack([random_force(N, rng) for _ in range(RUNS)], axis=1)
    x = euler_maruyama(u, DT, SIGMA, rng, runs=RUNS) + NOISE * rng.standard_normal((N, RUNS))
    records = [recording_of(x[:, i], DT, u[:, i]) for i in range(RUNS)]
    return [
        (fit_filter(filter_of(spring(), r, ("m",))), fit_filter(filter_of(spring(), r)))
        for r in records
    ]


def hits(fit: FilterFit, truth: Mapping[str, float] = TRUTH) -> list[bool]:
    """Whether the 95 % intervals of a right noise model hold the truth."""
    sd = np.sqrt(np.diag(fit.covariance))
    inside = []
    for i, f in fit.kalman.stack.free.items():
        low, high = (f.value(fit.theta[i] + k * 1.96 * sd[i]) for k in (-1, 1))
        inside.append(low <= truth[f.parameter.name] <= high)
    return inside


def value(fit: FilterFit, name: str) -> float:
    (found,) = (
        f.value(fit.theta[i]) for i, f in fit.kalman.stack.free.items() if f.parameter.name == name
    )
    return found


def one_step_error(found: Estimation) -> Array:
    assert found.filtered is not None
    error = found.problem().data.readings - found.filtered.reading[0]
    return np.asarray(np.sqrt(np.mean(error**2, axis=0)))


def test_intervals_cover_with_process_noise_and_fail_without(
    fits: list[tuple[FilterFit, FilterFit]],
) -> None:
    assert all(a.status is FitStatus.CONVERGED for a, _ in fits)
    right = np.array([hits(a) for a, _ in fits])
    wrong = np.array([hits(b) for _, b in fits])
    # 72 intervals: 68.4 expected at 95 %, below 63 with a probability of one in a hundred
    assert right.sum() >= 63
    assert wrong.sum() <= 50
    spread = [np.std([value(f, "k") for f in column]) for column in zip(*fits, strict=True)]
    assert spread[0] < 0.8 * spread[1]


def test_noise_levels_are_found(fits: list[tuple[FilterFit, FilterFit]]) -> None:
    found = [{e.name: e for e in a.noises()} for a, _ in fits]
    assert np.mean([f["sigma m"].value for f in found]) == pytest.approx(SIGMA, rel=0.03)
    assert np.mean([f["noise x"].value for f in found]) == pytest.approx(NOISE, rel=0.03)
    covered = [f["sigma m"].ci95[0] <= SIGMA <= f["sigma m"].ci95[1] for f in found]
    assert sum(covered) >= 20


def test_innovations_are_white_only_with_process_noise(
    fits: list[tuple[FilterFit, FilterFit]],
) -> None:
    studies = [f.kalman.study for f in fits[0]]
    good, poor = (estimate(s, method="prediction_error") for s in studies)
    assert good.filtered is not None
    assert poor.filtered is not None
    e = good.filtered.innovation[0][:, 0]
    assert np.std(e) == pytest.approx(1.0, abs=0.1)
    assert not any("not white" in n for n in good.notes)
    assert any("not white" in n for n in poor.notes)
    assert any("fit of output errors" in n for n in poor.notes)
    assert one_step_error(good)[0] < 0.5 * good.rmse("train")["x"]
    assert one_step_error(poor)[0] == pytest.approx(poor.rmse("train")["x"], rel=1e-6)
    assert good.filtered.log_likelihood > poor.filtered.log_likelihood + 100


def test_filtered_states_are_nearer_than_a_free_run() -> None:
    rng = np.random.default_rng(3)
    u = random_force(N, rng)[:, None]
    x = euler_maruyama(u, DT, SIGMA, rng)
    record = recording_of(x + 2e-3 * rng.standard_normal(x.shape), DT, u[:, 0])
    found = estimate(study_of(spring(), record, ("m",)), method="prediction_error")
    assert found.filtered is not None
    i = found.problem().dynamics.state_names.index("q_k")
    filtered = np.std(found.filtered.state[0][:, i] - x[:, 0])
    assert filtered < 0.8 * 2e-3
    assert filtered < 0.3 * np.std(found.simulated[0] - x)


def test_without_process_noise_it_is_the_fit_of_output_errors() -> None:
    # of most records the likelihood is largest without any process noise: this is one
    rng = np.random.default_rng(7)
    u = random_force(N, rng)
    x = np.asarray(simulate(spring(), DT * np.arange(N), {"F": u})["x"])
    start = {"m": 0.65, "d": 1.2, "k": 260.0}
    study = study_of(
        spring(), recording_of(x + NOISE * rng.standard_normal(N), DT, u), ("m",),
        free=[Vary(n, start=v) for n, v in start.items()],
    )  # fmt: skip
    data = replace(study.stack().problems[0].data, floor=np.array([NOISE]))
    other = fit(Problem(spring(), data, starts=start, lags=False, offsets=False))
    found = estimate(study, method="prediction_error")
    assert found.status is FitStatus.CONVERGED
    at_bound = found.estimate_of("sigma m")
    assert at_bound.value == 0.0
    assert any("ask for no process noise at m" in n for n in found.notes)
    assert at_bound.at_bound
    for e in other.estimates:
        mine = found.estimate_of(e.name)
        wide = 0.5 * (mine.ci95[1] - mine.ci95[0])
        assert abs(mine.value - e.value) < 0.05 * wide
        assert 0.5 * (e.ci95[1] - e.ci95[0]) == pytest.approx(wide, rel=0.25)
    # the largest diffusion that 95 % leave: a loss of 1.92 of the log-likelihood
    best = fit_filter(filter_of(spring(), study.recordings, ("m",), free=study.free))
    theta = best.theta.copy()
    theta[best.kalman.slots.sigma] = np.log(at_bound.ci95[1])
    loss = best.at.log_likelihood - evaluate(best.kalman, theta, False).log_likelihood
    assert 1.0 < loss < 4.0


def test_an_unstable_plant_in_closed_loop() -> None:
    """A pendulum on its head, held by a controller: a free run leaves the record, a filter not."""
    rng = np.random.default_rng(8)
    n, dt, sub, stiffness = 1500, 0.02, 40, -15.0
    h, q, p = dt / sub, 0.0, 0.0
    reference = 0.1 * np.repeat(rng.standard_normal(n // 25), 25)
    u, y = np.empty(n), np.empty(n)
    last = 0.0
    for k in range(n):
        y[k] = q + 1e-3 * rng.standard_normal()
        u[k] = -40.0 * (y[k] - reference[k]) - 4.0 * (y[k] - last) / dt
        last = y[k]
        for kick in 0.05 * np.sqrt(h) * rng.standard_normal(sub):
            q, p = q + h * p / MASS, p + h * (u[k] - 0.5 * p / MASS - stiffness * q) + kick
    with BondGraph("pendulum") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 0.4, unit="kg")
        body >> R("d", 1.0, unit="N*s/m")
        # a store may not create energy: gravity is a law beside a weak spring
        tip = Polynomial(size=10.0, orders=(1,), unit="N")
        body >> C("k", stiffness=1.0, unit="N/m", law=tip, fixed=True)
        body >> Dq("x", unit="m")
    g = g.with_values({"a_1_k": -10.0})
    study = study_of(g, recording_of(y, dt, u), ("m",), n_sub=2, hold="hold")
    found = estimate(study, method="prediction_error")
    assert found.status is FitStatus.CONVERGED
    for name, true in (("m", MASS), ("d", 0.5), ("a_1_k", stiffness - 1.0)):
        low, high = found.estimate_of(name).ci95
        assert low < true < high
        assert high - low < 0.4 * abs(true) + 0.4
    assert found.estimate_of("sigma m").value == pytest.approx(0.05, rel=0.25)
    # single shooting from the same start: 30 s are many times the time the pendulum takes to fall
    free_run = estimate(study.changed(process_noise=()), method="prediction_error")
    assert free_run.status is not FitStatus.CONVERGED
    assert abs(free_run.values["a_1_k"] - stiffness + 1.0) > 2.0
    assert not free_run.rmse("train")["x"] < 10 * np.std(y)
    assert any("intervals are not to be trusted" in n for n in free_run.notes)


def test_what_a_filter_neglects_is_said() -> None:
    rng = np.random.default_rng(5)
    u = random_force(200, rng)
    laws = (
        ("d", Coulomb(0.4), "jumps where its argument changes sign"),
        ("k", StopSum((0.005,), 40.0, 40.0, unit="N/m"), "memory of k follows the filtered"),
    )
    for element, law, words in laws:
        g = spring().with_element(element, law=law)
        x = simulate(g, DT * np.arange(200), {"F": u})["x"]
        record = recording_of(x + NOISE * rng.standard_normal(200), DT, u)
        found = fit_filter(filter_of(g, record, ("m",)), max_iterations=8)
        assert any(words in r for r in remarks(found))
        assert np.isfinite(found.at.log_likelihood)


def test_interrupt_keeps_the_best_so_far() -> None:
    rng = np.random.default_rng(5)
    u = random_force(200, rng)[:, None]
    x = euler_maruyama(u, DT, SIGMA, rng)
    free = ("m", "d", Vary("k", start=300.0))
    model = filter_of(spring(), recording_of(x, DT, u[:, 0]), ("m",), free=free)
    heard: list[float] = []

    def stop(iteration: int, value: float) -> None:
        heard.append(value)
        if iteration == 3:
            raise KeyboardInterrupt

    found = fit_filter(model, progress=stop)
    assert found.status is FitStatus.CANCELLED
    assert found.at.log_likelihood == heard[-1]


def test_extended_filter_covers_with_a_nonlinear_spring() -> None:
    """A hardening spring under process noise: the linearised filter's intervals still hold."""
    rng = np.random.default_rng(21)
    runs, h, cubic = 16, DT / 40, 4.0
    u = np.stack([random_force(N, rng, size=8.0) for _ in range(runs)], axis=1)
    q, p, x = np.zeros(runs), np.zeros(runs), np.zeros((N, runs))
    for i in range(N - 1):
        for j in range(40):
            force = u[i] + (u[i + 1] - u[i]) * j / 40 - STIFFNESS * q - cubic * (q / 0.05) ** 3
            kick = SIGMA * np.sqrt(h) * rng.standard_normal(runs)
            p = p + h * (force - DAMPING * p / MASS) + kick
            q = q + h * p / MASS
        x[i + 1] = q
    assert np.abs(x).max() > 0.07  # the cubic force is then no small one
    x = x + NOISE * rng.standard_normal(x.shape)
    law = Polynomial(half=0.05, size=5.0, orders=(3,), unit="N")
    g = spring().with_element("k", law=law).with_values({"a_3_k": 2.0})
    inside: list[bool] = []
    for i in range(runs):
        record = recording_of(x[:, i], DT, u[:, i])
        found = fit_filter(filter_of(g, record, ("m",), n_sub=2))
        inside += hits(found, {**TRUTH, "a_3_k": cubic})
    # 64 intervals: 60.8 expected at 95 %
    assert sum(inside) >= 56
