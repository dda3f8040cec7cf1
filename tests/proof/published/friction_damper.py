"""Friction damper with free play: fitted to harmonic runs, judged on two earthquakes."""

from __future__ import annotations

import numpy as np

from bondgraph.signals.recording import Recording
from identification.datasets.public_set import Protocol
from identification.estimation import Estimation
from tests.proof.published.models.band_brake import band_brake
from tests.proof.published.outcome import Outcome, Reached, split_hash
from tests.proof.published.staging import Progress, channels, fitted_start, rms, stage

RUNS = ("harmonic_0p25Hz_1p5in_36lb", "harmonic_0p5Hz_1in_30lb", "harmonic_1Hz_0p5in_36lb")
EDGE = 16
"""Samples at both ends that are edges of the filter of the converted copy."""
LENGTH = 2048
"""Samples of a run that train at most: 8 s."""
FREE = ("k", "gap_k", "F_1_c", "F_2_c")
WINDOWS = {
    "earthquake_imperial_valley_DBE": (768, 1920, 0.440),
    "earthquake_kocaeli_MCE": (1536, 3584, 0.628),
}
"""Part -> samples on which errors are published, and that of the LuGre law of D. Coble et al."""


SLACK = {"q_k": 0.0}
"""The band in the middle of its play: the rest under the first velocity, however small that is, is
a slider that has moved for ever."""


def fit(runs: list[Recording], *, progress: Progress | None = None) -> Estimation:
    """Fit stiffness, gap and both levels of friction to all runs at once, each from slack."""
    return stage(
        band_brake(), runs, FREE, initial=SLACK, n_sub=1, max_iterations=30, progress=progress
    )


def relative_error(
    made: Estimation, quake: Recording, first: int, last: int
) -> tuple[float, float]:
    """Return norm of the error over norm of the force less its mean, and the error's rms (N)."""
    part = quake.slice(0, last)
    simulated = fitted_start(band_brake(), part, made.values, 0, begins=SLACK)[first:, 0]
    force = quake["F"][first:last]
    error = rms(force - simulated)
    return error / float(np.std(force)), error


def run(parts: Protocol, share: float, progress: Progress | None) -> Outcome:
    """Run the protocol; parameters as `tests.proof.published.catalogue.run_protocol`."""
    whole = [parts[f"train/{name}"] for name in RUNS]
    runs = [r.slice(EDGE, EDGE + round(share * min(LENGTH, r.n - 2 * EDGE))) for r in whole]
    made = fit([r.select({"v": "v", "F": "F"}) for r in runs], progress=progress)
    errors, notes = [], []
    for name, (first, last, published) in WINDOWS.items():
        part, error = relative_error(made, parts.tests[name], first, last)
        errors.append(Reached(name, part, "of the spread", published))
        notes.append(f"{name}: {error:.0f} N rms")
    return Outcome(
        "friction_damper", parts.about.title, False,
        "the first 8 s of three harmonic runs (36 and 30 lb; published: 13 runs) train; the "
        "published windows of two earthquakes judge, from the measured velocity alone",
        split_hash(*(("train", channels(r)) for r in runs)),
        0, tuple(errors), values=made.values,
        notes=(*notes, "the published displacement of the earthquakes is probably half too large"),
    )  # fmt: skip
