"""Wiener-Hammerstein circuit: official parts, free-run simulation of the last 78,800 samples."""

from __future__ import annotations

import os
import time

from actuators.benchmarks.wiener_hammerstein import wiener_hammerstein
from bondgraph.signals import Recording
from identification.data import protocol
from identification.estimation import Estimation, Nuisances
from identification.published.outcome import Compared, Outcome, Reached, split_hash
from identification.published.staging import Progress, channels, free_run_error, scaled, stage

__all__ = ["TARGET", "fit", "run"]

TARGET = 0.30
"""Largest error, mV."""

FIRST = 12_000  # samples of the first stage
SKIP = 200


def fit(train: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit both filters, the diode network and the reading's offset at once, from ideal filters."""
    graph = wiener_hammerstein()
    names = tuple(n for n, p in graph.parameters.items() if not p.fixed)
    options = {"hold": "band-limited", "n_sub": 4, "skip": SKIP}
    options["nuisances"] = Nuisances(lags=False)
    first = train.slice(0, min(FIRST, train.n))
    made = stage(graph, [first], names, progress=scaled(progress, 0.0, 0.2), **options)
    return stage(graph, [train], names, made.values, progress=scaled(progress, 0.2, 0.9), **options)


def run(
    folder: str | os.PathLike[str] | None = None,
    *,
    share: float = 1.0,
    progress: Progress | None = None,
) -> Outcome:
    """Run the protocol; parameters as `identification.published.silverbox.run`."""
    begin = time.perf_counter()
    parts = protocol("wiener_hammerstein", folder)
    train = parts.train[0].slice(0, round(share * parts.train[0].n))
    made = fit(train, progress=progress)
    (test,) = parts.tests.values()
    init = parts.init
    error = 1e3 * free_run_error(made, test, "y", state=init, skip=init)
    return Outcome(
        "wiener_hammerstein", parts.about.title, bool(parts.official) and share == 1.0,
        "train: samples 5200 to 105199; test: 105200 to 183999, its initial state fitted to its "
        "init samples",
        split_hash(("train", channels(train)), ("test", channels(test))),
        init, (Reached("last 78,800 samples", error, "mV", TARGET),),
        values=made.values, seconds=time.perf_counter() - begin,
        notes=(f"{len(made.free)} parameters, band-limited input",),
    )  # fmt: skip
