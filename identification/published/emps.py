"""EMPS: parameters by prediction errors, and the position of a free run on the held-out part."""

from __future__ import annotations

import os
import time

import numpy as np

from actuators.benchmarks.positioning_axis import positioning_axis
from bondgraph.signals import Recording, Split
from identification.data import protocol
from identification.prediction import PredictionFit, PredictionModel, fit_prediction
from identification.problem import data_for
from identification.published.outcome import Compared, Outcome, Reached, split_hash
from identification.published.staging import (
    Progress,
    channels,
    fitted_start,
    joined,
    rms,
    scaled,
)

__all__ = ["PUBLISHED", "TOLERANCE", "fit", "run"]

PUBLISHED = {
    "M": ("M", 95.1, "kg"),
    "F_v": ("F_v", 203.5, "N*s/m"),
    "F_c_F_v": ("F_c", 20.4, "N"),
    "F_0": ("-offset", 3.16, "N"),
}
"""Names of the model -> name, value and unit of the benchmark (Janot, Gautier, Brunot, 2019)."""

TOLERANCE = 0.03
FLOOR = 1e-6  # m; start value of the position's noise, which is estimated


def fit(recording: Recording, *, progress: Progress | None = None) -> PredictionFit:
    """Fit mass, friction and offset by prediction errors, with process noise on the momentum.

    The loop is closed and friction is not exactly Coulomb's: errors of the simulated position
    would weight the slow part of what the model leaves out, errors of a Kalman filter's prediction
    take it as a random force. The drive holds its command between samples.
    """
    most = 60

    def say(iteration: int, likelihood: float) -> None:
        if progress is not None:
            progress(f"log-likelihood {likelihood:.6g}", iteration / most)

    graph, n = positioning_axis(), recording.n
    split = Split(slice(0, n), slice(n, n), "all samples train")
    data = data_for(graph, recording, split, {"x": FLOOR}, "hold")
    return fit_prediction(
        PredictionModel(graph, (data,), ("M",)), max_iterations=most, progress=say
    )


def run(
    folder: str | os.PathLike[str] | None = None,
    *,
    share: float = 1.0,
    progress: Progress | None = None,
) -> Outcome:
    """Run the protocol; parameters as `identification.published.silverbox.run`."""
    begin = time.perf_counter()
    parts = protocol("emps", folder)
    train = parts.train[0].slice(0, round(share * parts.train[0].n))
    (name, test), *_ = parts.tests.items()
    held = fit(train, progress=scaled(progress, 0.0, 0.4))
    error = _position_error(held, test, parts.init)
    notes = ["process noise on the momentum, its size estimated; input held"]
    if parts.official or share < 1.0:
        whole = held
    else:
        # the published values are of the whole record
        whole = fit(joined(train, test), progress=scaled(progress, 0.45, 0.95))
        alone = ", ".join(f"{PUBLISHED[n][0]} {held.values[n]:.5g}" for n in PUBLISHED)
        notes.append(f"parameters of the training part alone, used for the free run: {alone}")
        notes.append("parameters beside published ones: of the whole record, as those are")
    compared = tuple(
        Compared(shown, whole.values[own], unit, value, TOLERANCE)
        for own, (shown, value, unit) in PUBLISHED.items()
    )
    return Outcome(
        "emps", parts.about.title, bool(parts.official) and share == 1.0,
        f"train: {train.n} samples; test: {name}, {test.n} samples, from the measured force alone; "
        "its initial state is fitted to its init samples",
        split_hash(("train", channels(train)), ("test", channels(test))),
        parts.init, (Reached("position, free run", 1e3 * error, "mm"),), compared,
        values=held.values, seconds=time.perf_counter() - begin, notes=tuple(notes),
    )  # fmt: skip


def _position_error(held: PredictionFit, test: Recording, init: int) -> float:
    graph = positioning_axis()
    simulated = fitted_start(graph, test, held.values, init, hold="hold")
    return rms((test["x"] - np.asarray(simulated[:, 0]))[init:])
