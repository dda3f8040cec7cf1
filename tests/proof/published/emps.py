"""EMPS: parameters by prediction errors, and the position of a free run on the held-out part."""

from __future__ import annotations

from collections.abc import Mapping

from bondgraph.signals.recording import Recording, Split
from identification.datasets.public_set import Protocol
from identification.estimation import NO_NUISANCES, Estimation, Study, estimate
from tests.proof.published.models.positioning_axis import positioning_axis
from tests.proof.published.outcome import Compared, Outcome, Reached, split_hash
from tests.proof.published.staging import (
    Progress,
    channels,
    fitted_start,
    joined,
    rms,
    scaled,
    stage,
)

PUBLISHED = {
    "M": ("M", 95.1, "kg"),
    "F_v": ("F_v", 203.5, "N*s/m"),
    "F_c_F_v": ("F_c", 20.4, "N"),
    "F_0": ("-offset", 3.16, "N"),
}
"""Names of the model -> name, value and unit of the benchmark (Janot, Gautier, Brunot, 2019)."""

TOLERANCE = 0.03


def fit(recording: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit mass, friction and offset by prediction errors, with process noise on the momentum.

    The loop is closed and friction is not exactly Coulomb's: errors of the simulated position
    would weight the slow part of what the model leaves out, errors of a Kalman filter's prediction
    take it as a random force. The drive holds its command between samples.
    """
    n = recording.n
    study = Study(
        positioning_axis(), recording, splits=Split(slice(0, n), slice(n, n), "all samples train"),
        hold="hold", nuisances=NO_NUISANCES, process_noise=("M",),
    )  # fmt: skip
    return estimate(study, method="prediction_error", progress=progress)


def refit(
    recording: Recording, values: Mapping[str, float], *, progress: Progress | None = None
) -> Estimation:
    """Fit the free run of a whole record from `values`: the parameters for a simulation."""
    return stage(
        positioning_axis(), [recording], tuple(PUBLISHED), values, hold="hold", n_sub=1,
        max_iterations=40, progress=progress,
    )  # fmt: skip


def run(parts: Protocol, share: float, progress: Progress | None) -> Outcome:
    """Run the protocol; parameters as `tests.proof.published.catalogue.run_protocol`."""
    train = parts.train[0].slice(0, round(share * parts.train[0].n))
    (name, test), *_ = parts.tests.items()
    held = fit(train, progress=scaled(progress, 0.0, 0.4))
    simulating = refit(train, held.values, progress=scaled(progress, 0.4, 0.6))
    oracle = refit(test, held.values)
    errors = tuple(
        Reached(f"position, {how}", 1e3 * position_error(values, test, parts.init), "mm")
        for how, values in (
            ("fit of the free run", simulating.values),
            ("fit of prediction errors", held.values),
            ("fit of this part itself", oracle.values),
        )
    )
    notes = [
        "prediction errors: process noise on the momentum, its size estimated; input held",
        "nothing holds the position of a free run: a force of 0.2 N that the law misses moves it "
        "by 1 mm in a second; fitted to the held-out part itself it leaves what is printed third",
    ]
    whole = held
    if not parts.official and share == 1.0:
        whole = fit(joined(train, test), progress=scaled(progress, 0.6, 0.95))
        alone = ", ".join(f"{PUBLISHED[n][0]} {held.values[n]:.5g}" for n in PUBLISHED)
        notes.append("parameters beside published ones: of the whole record, as those are")
        notes.append(f"of the training part alone: {alone}")
    compared = tuple(
        Compared(shown, whole.values[own], unit, value, TOLERANCE)
        for own, (shown, value, unit) in PUBLISHED.items()
    )
    return Outcome(
        "emps", parts.about.title, bool(parts.official) and share == 1.0,
        f"train: {train.n} samples; test: {name}, {test.n} samples, from the measured force alone; "
        "its initial state is fitted to its init samples",
        split_hash(("train", channels(train)), ("test", channels(test))),
        parts.init, errors, compared,
        values=whole.values, notes=tuple(notes),
    )  # fmt: skip


def position_error(values: Mapping[str, float], test: Recording, init: int) -> float:
    """Root mean square error of a free run from the force alone, m."""
    simulated = fitted_start(positioning_axis(), test, values, init, hold="hold")
    return rms((test["x"] - simulated[:, 0])[init:])
