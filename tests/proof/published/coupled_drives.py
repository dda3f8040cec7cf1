"""Coupled electric drives: a sensor without sign beside one with, on a split of our own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.signals.recording import Recording, Split
from identification.datasets.public_set import Protocol
from identification.estimation import Estimation, Nuisances, Vary
from tests.proof.published.models.coupled_drives import coupled_drives
from tests.proof.published.outcome import Outcome, Reached, split_hash
from tests.proof.published.staging import Progress, channels, joined, rms, scaled, stage

UNIT = "sensor units"
FRICTIONS = (0.5, 1.0, 2.0, 3.0, 4.0)
"""Start values of the dry friction."""
OWN = "K"
"""The gain has a value in each record: with two levels of command it cannot be told from a motor
whose torque is not proportional to the voltage."""


def records(parts: Protocol, share: float = 1.0) -> tuple[list[Recording], list[Split]]:
    """Return each record whole, with its first samples as training and its last as test part."""
    found, splits = [], []
    for first, last in zip(parts.train, parts.tests.values(), strict=True):
        whole = joined(first, last)
        trained = round(share * first.n)
        rule = f"samples {parts.init} to {trained - 1} train, {first.n} to {whole.n - 1} test"
        found.append(whole)
        splits.append(Split(slice(parts.init, trained), slice(first.n, whole.n), rule))
    return found, splits


def fit(
    found: Sequence[Recording],
    splits: Sequence[Split],
    *,
    rectified: bool = True,
    friction: bool = True,
    progress: Progress | None = None,
) -> Estimation:
    """Fit all records at once: without friction, then with it if wanted."""

    def fitted(graph: BondGraph, made: Estimation | None, part: tuple[float, float]) -> Estimation:
        names = [n for n, p in graph.parameters.items() if not p.fixed]
        values = {} if made is None else made.values
        free = [Vary(n, start=values.get(n), own=n == OWN) for n in names]
        return stage(
            graph, found, free, splits=splits, hold="hold", n_sub=2,
            nuisances=Nuisances(offsets=not rectified, lags=False),
            progress=scaled(progress, *part),
        )  # fmt: skip

    smooth = fitted(coupled_drives(rectified=rectified, friction=None), None, (0.0, 0.5))
    if not friction:
        return smooth
    # dry friction makes the misfit kinked: several starts, the best in training counts
    tried = [
        fitted(
            coupled_drives(rectified=rectified, friction=f), smooth, (0.5 + 0.1 * i, 0.6 + 0.1 * i)
        )
        for i, f in enumerate(FRICTIONS)
    ]
    return min(tried, key=lambda made: _training_misfit(made, found))


def _training_misfit(made: Estimation, found: Sequence[Recording]) -> float:
    """Sum over the records of the mean square training error over the reading's variance."""
    parts = (np.mean(made.residuals("train", r) ** 2) / np.var(x["y"]) for r, x in enumerate(found))
    return float(sum(parts))


def run(parts: Protocol, share: float, progress: Progress | None) -> Outcome:
    """Run the protocol; parameters as `tests.proof.published.catalogue.run_protocol`."""
    found, splits = records(parts, share)
    kinds = {
        "rectified, dry friction": (True, True),
        "rectified, linear": (True, False),
        "signed, linear": (False, False),
    }
    errors: list[Reached] = []
    values: dict[str, float] = {}
    for i, (kind, (rectified, friction)) in enumerate(kinds.items()):
        say = scaled(progress, i / 3, (i + 1) / 3)
        made = fit(found, splits, rectified=rectified, friction=friction, progress=say)
        values = values or made.values
        for r, level in enumerate(parts.tests):
            error = rms(made.residuals("test", r))
            errors.append(Reached(f"{kind}, +-{level}", error, UNIT))
    return Outcome(
        "coupled_drives", parts.about.title, False,
        "first 400 samples of each of three records train, last 100 test; the simulation runs on "
        "from the training part",
        split_hash(*(("record", channels(r)) for r in found)),
        parts.init, tuple(errors), values=values,
        notes=("common parameters but for the gain of each record; input held",),
    )  # fmt: skip
