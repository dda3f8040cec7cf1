"""Silverbox: official parts, free-run simulation of multisine and arrow."""

from __future__ import annotations

import os
import time

from actuators.benchmarks.silverbox import silverbox
from bondgraph.signals import Recording
from identification.data import protocol
from identification.estimation import Estimation, Nuisances
from identification.published.outcome import Outcome, Reached, split_hash
from identification.published.staging import Progress, channels, free_run_error, scaled, stage

__all__ = ["TARGETS", "fit", "run"]

TARGETS = {"multisine": 0.30, "arrow_full": 0.40, "arrow_no_extrapolation": 0.27}
"""Largest errors, mV."""

LINEAR = ("m", "d", "k")
BENT = ("a_2_N", "a_3_N", "tau")
FIRST = 9000  # samples of the first stages
SKIP = 300  # samples in which the transient of the start dies out


def fit(train: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit six parameters and the reading's offset: linear, then bent, then on all samples."""
    graph, first = silverbox(), train.slice(0, min(FIRST, train.n))
    options = {"hold": "band-limited", "n_sub": 8, "skip": SKIP}
    options["nuisances"] = Nuisances(lags=False)
    straight = {"a_2_N": 0.0, "a_3_N": 0.0, "tau": 0.0}
    made = stage(graph, [first], LINEAR, straight, progress=scaled(progress, 0.0, 0.1), **options)
    for record, share in ((first, 0.3), (train, 0.9)):
        say = scaled(progress, share - 0.2, share)
        made = stage(graph, [record], (*LINEAR, *BENT), made.values, progress=say, **options)
    return made


def run(
    folder: str | os.PathLike[str] | None = None,
    *,
    share: float = 1.0,
    progress: Progress | None = None,
) -> Outcome:
    """Run the protocol.

    Parameters
    ----------
    folder : path, optional
        Folder of the recordings; `BONDSIGHT_RECORDINGS` if not given.
    share : float
        Part of the training samples that is used, from their start; below 1 the outcome is a
        trial and does not count as official.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1.
    """
    begin = time.perf_counter()
    parts = protocol("silverbox", folder)
    train = parts.train[0].slice(0, round(share * parts.train[0].n))
    made = fit(train, progress=progress)
    init = parts.init
    errors = tuple(
        Reached(n, 1e3 * free_run_error(made, r, "y", state=init, skip=init), "mV", TARGETS[n])
        for n, r in parts.tests.items()
    )
    return Outcome(
        "silverbox", parts.about.title, bool(parts.official) and share == 1.0,
        "train: first 75 % of the multisines; test: their last 25 %, the arrow, the arrow's first "
        "32000 samples; the initial state of a test is fitted to its init samples",
        split_hash(("train", channels(train)), *(("test", channels(r)) for r in parts.tests.values())),
        init, errors, values=made.values, seconds=time.perf_counter() - begin,
        notes=(f"{len(made.free)} parameters, band-limited input",),
    )  # fmt: skip
