"""Prediction errors behind `estimate`: studies of several recordings, refusals, words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, Df, Dq, I, One, Parameter, R, Recording, Se, UnusableInput
from bondgraph.graph.drives import Drive
from bondgraph.signals.recording import Split
from identification.estimation import Normal, Nuisances, Study, Vary, estimate
from identification.estimation.archive import open_fit, save_fit
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.methods import FitOptions, FitTask
from identification.estimation.methods.prediction_error import PredictionError
from identification.validation import judge
from identification.validation.source import from_estimation
from identification.validation.validation_data import FREE_RUN
from tests.identification.estimation.plants import caught, falling
from tests.identification.estimation.prediction.plants import (
    DAMPING,
    MASS,
    STIFFNESS,
    UNITS,
    euler_maruyama,
    random_force,
    spring,
)
from tests.settled import simulate

DT, N, SIGMA, NOISE = 0.02, 600, 0.3, 5e-4
BARE = Nuisances(offsets=False, lags=False)


def recording(
    seed: int, n: int = N, both: bool = False, sigma: float = SIGMA, offset: float = 0.0
) -> Recording:
    rng = np.random.default_rng(seed)
    u = random_force(n, rng)
    x = euler_maruyama(u[:, None], DT, sigma, rng)[:, 0]
    channels = {"F[N]": u, "x[m]": x + NOISE * rng.standard_normal(n) + offset}
    if both:
        channels["s[m/s]"] = np.gradient(x, DT) + 0.05 * rng.standard_normal(n)
    return Recording.from_arrays(f"r{seed}", channels, fs=1 / DT)


def all_train(n: int = N) -> Split:
    return Split(slice(0, n), slice(n, n), "all")


def test_two_recordings_with_chain_and_process_noise() -> None:
    records = [recording(1, offset=0.01), recording(2, 400, offset=0.01)]
    study = Study(
        spring(stiffness=260.0), records, splits=[all_train(), all_train(400)],
        process_noise=("m",), nuisances=Nuisances(offsets=True, lags=False),
    )  # fmt: skip
    found = estimate(study, method="prediction_error")
    assert found.status is FitStatus.CONVERGED
    for name, true in (("m", MASS), ("d", DAMPING), ("k", STIFFNESS)):
        e = found.estimate_of(name)
        wide = 0.5 * (e.ci95[1] - e.ci95[0])
        assert abs(e.value - true) < 1.6 * wide
        assert e.value == pytest.approx(true, rel=0.25)
    offsets = [e for e in found.nuisances if e.name.startswith("offset x")]
    assert len(offsets) == 2
    for e in offsets:
        assert abs(e.value - 0.01) < 1.6 * 0.5 * (e.ci95[1] - e.ci95[0])
    (level,) = (n for n in found.notes if n.startswith("sigma m"))
    assert float(level.split()[3]) == pytest.approx(SIGMA, rel=0.15)
    assert found.estimate_of("sigma m").value == pytest.approx(SIGMA, rel=0.15)
    # what is shown is the free run of the fitted values
    assert found.rmse()["x"] > 5 * NOISE


def test_without_process_noise_it_agrees_with_single_shooting() -> None:
    study = Study(spring(stiffness=230.0), recording(3, sigma=0.0), nuisances=BARE,
                  splits=all_train(), process_noise=("m",))  # fmt: skip
    a, b = (estimate(study, method=m) for m in ("prediction_error", "single_shooting"))
    for name in ("m", "d", "k"):
        e = b.estimate_of(name)
        wide = 0.5 * (e.ci95[1] - e.ci95[0])
        assert abs(a.values[name] - e.value) < 0.3 * wide


def test_a_recording_without_a_sensor_misses_it() -> None:
    records = [recording(4, both=True), recording(5)]
    study = Study(
        spring(both=True), records, nuisances=BARE, splits=[all_train(), all_train()],
        process_noise=("m",),
    )  # fmt: skip
    found = estimate(study, method="prediction_error")
    assert found.status is FitStatus.CONVERGED
    assert found.values["k"] == pytest.approx(STIFFNESS, rel=0.1)
    assert [found.sensors(r) for r in (0, 1)] == [("x", "s"), ("x",)]


def test_a_recording_without_an_integrating_sensor_lacks_its_state() -> None:
    """Nothing but the sensor holds the position: without it there is no state to disturb."""
    with BondGraph("slide") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 0.7, unit="kg")
        body >> R("d", 1.0, unit="N*s/m")
        body >> Dq("x", unit="m")
        body >> Df("s", unit="m/s")
    records, h = [], DT / 20
    for seed, channels in ((10, ("x", "s")), (11, ("s",))):
        rng = np.random.default_rng(seed)
        u, q, p = random_force(N, rng), 0.0, 0.0
        seen = np.zeros((N, 2))
        for i in range(N - 1):
            for j in range(20):
                force = u[i] + (u[i + 1] - u[i]) * j / 20
                p += h * (force - DAMPING * p / MASS) + SIGMA * np.sqrt(h) * rng.standard_normal()
                q += h * p / MASS
            seen[i + 1] = q, p / MASS
        noisy = dict(
            zip(("x", "s"), (seen + 0.02 * rng.standard_normal(seen.shape)).T, strict=True)
        )
        values = {"F[N]": u, **{f"{n}[{UNITS[n]}]": noisy[n] for n in channels}}
        records.append(Recording.from_arrays(f"r{seed}", values, fs=1 / DT))
    study = Study(
        g, records, nuisances=BARE, splits=[all_train(), all_train()], process_noise=("m", "q_x")
    )
    found = estimate(study, method="prediction_error")
    assert found.filtered is not None
    assert [s.shape[1] for s in found.filtered.state] == [2, 1]
    for name, true in (("m", MASS), ("d", DAMPING), ("sigma m", SIGMA)):
        e = found.estimate_of(name)
        assert abs(e.value - true) < 1.6 * 0.5 * (e.ci95[1] - e.ci95[0])


def test_priors_bounds_and_fixed_parameters_count() -> None:
    free = (Vary("m", prior=Normal(0.6, 1e-4)), Vary("k", upper=180.0, start=150.0))
    study = Study(
        spring(), recording(6), free=free, fixed={"d": 2.0}, nuisances=BARE, splits=all_train(),
        process_noise=("m",),
    )  # fmt: skip
    found = estimate(study, method="prediction_error")
    assert found.values["m"] == pytest.approx(0.6, abs=1e-3)
    assert found.values["d"] == 2.0
    assert found.estimate_of("k").at_bound


def test_a_parameter_of_each_recording_and_its_command_offsets() -> None:
    study = Study(
        spring(), [recording(8), recording(9)], (Vary("k", own=True), "m", "d"),
        nuisances=Nuisances(offsets=False, lags=False, commands=True), process_noise=("m",),
        splits=[all_train(), all_train()],
    )  # fmt: skip
    found = estimate(study, method="prediction_error")
    assert found.status is FitStatus.CONVERGED
    stiffness = [e for e in found.estimates if e.name.startswith("k @")]
    forces = [e for e in found.nuisances if e.name.startswith("offset_F @")]
    assert len(stiffness) == len(forces) == 2
    for group, true in ((stiffness, STIFFNESS), (forces, 0.0)):
        for e in group:
            assert abs(e.value - true) < 1.6 * 0.5 * (e.ci95[1] - e.ci95[0])


def test_one_step_predictions_are_told_as_what_they_are(tmp_path: Path) -> None:
    """A spring that pushes away: its free run leaves the record."""
    study = Study(falling(), caught(500), nuisances=BARE, splits=all_train(500), hold="hold")
    found = estimate(study, method="prediction_error", max_iterations=3)
    assert found.run == "one-step predictions of caught, each from the readings before it"
    assert from_estimation(found).run == found.run
    assert f"simulated as {found.run}" in str(judge(found))
    save_fit(found, tmp_path / "fit.npz")
    assert open_fit(tmp_path / "fit.npz").run == found.run
    tame = Study(spring(), recording(3, 200, sigma=0.0), nuisances=BARE, splits=all_train(200))
    made = estimate(tame, method="prediction_error", max_iterations=3)
    assert made.run == ""
    assert from_estimation(made).run == FREE_RUN


def test_what_it_cannot_do_is_refused() -> None:
    tau = Parameter("tau", 0.5 * DT, "s", lower=0.0)
    late = spring().with_parameters([tau]).with_element("F", drive=Drive(delay="tau"))
    r = recording(7)
    cases: list[tuple[BondGraph, dict[str, object], str]] = [
        (late, {}, "dead time"),
        (spring(), {"window": 100}, "whole recordings"),
        (spring(), {"nuisances": Nuisances(clock=1e-4)}, "clock"),
    ]
    for graph, more, words in cases:
        study = Study(graph, r, **more)  # type: ignore[arg-type]
        with pytest.raises(UnusableInput, match=words):
            estimate(study, method="prediction_error")


def test_default_lets_noise_into_every_state() -> None:
    rng = np.random.default_rng(1)
    u = random_force(200, rng)
    x = np.asarray(simulate(spring(), DT * np.arange(200), {"F": u})["x"])
    r = Recording.from_arrays("r", {"F[N]": u, "x[m]": x + NOISE * rng.standard_normal(200)},
                              fs=1 / DT)  # fmt: skip
    study = Study(spring(), r, splits=all_train(200))
    setting = study.first_setting
    stack = study.stack(setting)
    method = PredictionError()
    method.check(study)
    made = method.solve(FitTask(study, setting, stack, stack.start(), FitOptions()))
    assert sum(n.startswith("sigma") for n in made.notes) == 2
    assert made.filtered is not None
    assert [e.name for e in made.filtered.noises] == ["sigma p_m", "sigma q_k", "noise x"]
    assert any("lags" in n for n in made.notes)
    assert made.covariance is not None
    assert np.linalg.eigvalsh(made.covariance).min() > -1e-12
