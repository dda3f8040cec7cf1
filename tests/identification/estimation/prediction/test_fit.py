"""Fits on data with and without process noise: values, intervals, coverage, words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.laws import Coulomb, Polynomial, StopSum
from bondgraph.simulation.simulate import simulate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.prediction import (
    PredictionFit,
    PredictionModel,
    evaluate,
    fit_prediction,
)
from identification.estimation.single_record import fit
from identification.study.problem import Problem
from tests.identification.estimation.prediction.plants import (
    DAMPING,
    MASS,
    STIFFNESS,
    data_of,
    euler_maruyama,
    random_force,
    spring,
)

Array = np.ndarray
DT, N, SIGMA, NOISE = 0.02, 600, 0.3, 5e-4
TRUTH = {"m": MASS, "d": DAMPING, "k": STIFFNESS}
RUNS = 24


@pytest.fixture(scope="module")
def fits() -> list[tuple[PredictionFit, PredictionFit]]:
    """With process noise at the momentum, and without (single shooting), on the same data."""
    rng = np.random.default_rng(11)
    u = np.stack([random_force(N, rng) for _ in range(RUNS)], axis=1)
    x = euler_maruyama(u, DT, SIGMA, rng, runs=RUNS) + NOISE * rng.standard_normal((N, RUNS))
    found = []
    for i in range(RUNS):
        data = data_of(x[:, i], DT, u[:, i], floor=NOISE)
        with_noise = fit_prediction(PredictionModel(spring(), (data,), ("m",)))
        found.append((with_noise, fit_prediction(PredictionModel(spring(), (data,)))))
    return found


def hits(fit: PredictionFit) -> list[bool]:
    """Whether the 95 % intervals of a right noise model hold the truth."""
    sd = np.sqrt(np.diag(fit.covariance))
    inside = []
    for i, f in enumerate(fit.model.free):
        low, high = (f.value(fit.theta[i] + k * 1.96 * sd[i]) for k in (-1, 1))
        inside.append(low <= TRUTH[f.parameter.name] <= high)
    return inside


def test_intervals_cover_with_process_noise_and_fail_without(
    fits: list[tuple[PredictionFit, PredictionFit]],
) -> None:
    assert all(a.status is FitStatus.CONVERGED for a, _ in fits)
    right = np.array([hits(a) for a, _ in fits])
    wrong = np.array([hits(b) for _, b in fits])
    # 72 intervals: 68.4 expected at 95 %, below 63 with a probability of one in a hundred
    assert right.sum() >= 63
    assert wrong.sum() <= 50
    spread = [np.std([f.values["k"] for f in column]) for column in zip(*fits, strict=True)]
    assert spread[0] < 0.8 * spread[1]


def test_noise_levels_are_found(fits: list[tuple[PredictionFit, PredictionFit]]) -> None:
    sigma = np.array([a.sigma["m"] for a, _ in fits])
    noise = np.array([a.noise["x"] for a, _ in fits])
    assert np.mean(sigma) == pytest.approx(SIGMA, rel=0.03)
    assert np.mean(noise) == pytest.approx(NOISE, rel=0.03)
    covered = [a["sigma m"].ci95[0] <= SIGMA <= a["sigma m"].ci95[1] for a, _ in fits]
    assert sum(covered) >= 20


def test_innovations_are_white_only_with_process_noise(
    fits: list[tuple[PredictionFit, PredictionFit]],
) -> None:
    good, poor = fits[0]
    e = good.predicted[0].innovation[:, 0]
    assert np.std(e) == pytest.approx(1.0, abs=0.1)
    assert not any("white" in r for r in good.remarks)
    assert any("not white" in r for r in poor.remarks)
    assert any("fit of output errors" in r for r in poor.remarks)
    assert good.rmse("train")["x"] < 0.5 * good.rmse("train", "simulated")["x"]
    assert poor.rmse("train")["x"] == pytest.approx(poor.rmse("train", "simulated")["x"], rel=1e-6)
    assert good.log_likelihood > poor.log_likelihood + 100


def test_filtered_states_are_nearer_than_a_free_run() -> None:
    rng = np.random.default_rng(3)
    u = random_force(N, rng)[:, None]
    x = euler_maruyama(u, DT, SIGMA, rng)
    data = data_of(x + 2e-3 * rng.standard_normal(x.shape), DT, u[:, 0])
    found = fit_prediction(PredictionModel(spring(), (data,), ("m",)))
    seen = found.predicted[0]
    i = found.model.state_names.index("q_k")
    filtered = np.std(seen.state[:, i] - x[:, 0])
    assert filtered < 0.8 * 2e-3
    assert filtered < 0.3 * np.std(seen.simulated - x)


def test_without_process_noise_it_is_the_fit_of_output_errors() -> None:
    # of most records the likelihood is largest without any process noise: this is one
    rng = np.random.default_rng(7)
    u = random_force(N, rng)
    x = np.asarray(simulate(spring(), DT * np.arange(N), {"F": u})["x"])
    data = data_of(x + NOISE * rng.standard_normal(N), DT, u, floor=NOISE)
    start = {"m": 0.65, "d": 1.2, "k": 260.0}
    other = fit(Problem(spring(), data, starts=start, lags=False, offsets=False))
    found = fit_prediction(PredictionModel(spring(), (data,), ("m",), starts=start))
    assert found.status is FitStatus.CONVERGED
    assert found.sigma == {"m": 0.0}
    assert any("ask for no process noise at m" in r for r in found.remarks)
    at_bound = found["sigma m"]
    assert at_bound.at_bound
    for e in other.estimates:
        mine = found[e.name]
        wide = 0.5 * (mine.ci95[1] - mine.ci95[0])
        assert abs(mine.value - e.value) < 0.05 * wide
        assert 0.5 * (e.ci95[1] - e.ci95[0]) == pytest.approx(wide, rel=0.25)
    # the largest diffusion that 95 % leave: a loss of 1.92 of the log-likelihood
    theta = found.theta.copy()
    theta[found.model.slots.sigma] = np.log(at_bound.ci95[1])
    loss = found.log_likelihood - evaluate(found.model, theta, False).log_likelihood
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
    data = replace(data_of(y, dt, u, floor=1e-3), hold="hold")
    found = fit_prediction(PredictionModel(g, (data,), ("m",), n_sub=2))
    assert found.status is FitStatus.CONVERGED
    for name, true in (("m", MASS), ("d", 0.5), ("a_1_k", stiffness - 1.0)):
        low, high = found[name].ci95
        assert low < true < high
        assert high - low < 0.4 * abs(true) + 0.4
    assert found.sigma["m"] == pytest.approx(0.05, rel=0.25)
    # single shooting from the same start: 30 s are many times the time the pendulum takes to fall
    free_run = fit_prediction(PredictionModel(g, (data,), n_sub=2))
    assert free_run.status is not FitStatus.CONVERGED
    assert abs(free_run.values["a_1_k"] - stiffness + 1.0) > 2.0
    assert not free_run.rmse("train")["x"] < 10 * np.std(y)
    assert any("intervals are not to be trusted" in r for r in free_run.remarks)


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
        data = data_of(x + NOISE * rng.standard_normal(200), DT, u)
        found = fit_prediction(PredictionModel(g, (data,), ("m",)), max_iterations=8)
        assert any(words in r for r in found.remarks)
        assert np.isfinite(found.log_likelihood)


def test_interrupt_keeps_the_best_so_far() -> None:
    rng = np.random.default_rng(5)
    u = random_force(200, rng)[:, None]
    x = euler_maruyama(u, DT, SIGMA, rng)
    model = PredictionModel(spring(), (data_of(x, DT, u[:, 0]),), ("m",), starts={"k": 300.0})
    heard: list[float] = []

    def stop(iteration: int, value: float) -> None:
        heard.append(value)
        if iteration == 3:
            raise KeyboardInterrupt

    found = fit_prediction(model, progress=stop)
    assert found.status is FitStatus.CANCELLED
    assert found.log_likelihood == heard[-1]


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
    inside = []
    for i in range(runs):
        data = data_of(x[:, i], DT, u[:, i], floor=NOISE)
        found = fit_prediction(PredictionModel(g, (data,), ("m",), n_sub=2))
        sd = np.sqrt(np.diag(found.covariance))
        for k, f in enumerate(found.model.free):
            low, high = (f.value(found.theta[k] + s * 1.96 * sd[k]) for s in (-1, 1))
            inside.append(low <= {**TRUTH, "a_3_k": cubic}[f.parameter.name] <= high)
    # 64 intervals: 60.8 expected at 95 %
    assert sum(inside) >= 56
