"""What a study refuses before a simulation: samples, counts and values that cannot be used."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput

SHORTEST_WINDOW = 3


def admit_recordings(recordings: Sequence[object]) -> None:
    """Refuse what is no recording."""
    for r in recordings:
        if not isinstance(r, Recording):
            raise UnusableInput(
                f"a study takes recordings, not {type(r).__name__}; make one with "
                "Recording.read (a file), Recording.from_pandas or Recording.from_arrays"
            )


def require_time_step(recording: Recording) -> None:
    """Refuse a recording of a single sample."""
    if recording.n < 2:
        raise UnusableInput(
            f"recording {recording.name!r} has {recording.n} sample; a fit needs at least two, and "
            "in practice many more than unknowns"
        )


def admit_split(split: Split, recording: Recording) -> Split:
    """Return the split with plain sample numbers; refuse samples that do not exist."""
    where = f"split of {recording.name!r}"
    if isinstance(split.train, tuple) or isinstance(split.test, tuple):
        raise UnusableInput(
            f"{where}: a study takes one stretch to fit and one to judge; give two slices"
        )
    train = _plain(split.train, recording.n, f"{where}, train")
    test = _plain(split.test, recording.n, f"{where}, test")
    if train.stop <= train.start:
        raise UnusableInput(f"{where}: there is no training sample; give train some of them")
    both = min(train.stop, test.stop) - max(train.start, test.start)
    if both > 0:
        raise UnusableInput(
            f"{where}: {both} samples are in train and in test; held-out samples must be others"
        )
    return replace(split, train=train, test=test)


def _plain(part: slice, n: int, where: str) -> slice:
    if part.step not in (None, 1):
        raise UnusableInput(f"{where}: step {part.step}; give consecutive samples")
    for edge in (part.start, part.stop):
        if edge is not None and not -n <= edge <= n:
            raise UnusableInput(f"{where}: sample {edge} lies outside of the {n} samples")
    start, stop, _ = part.indices(n)
    return slice(start, max(start, stop))


def admit_counts(
    window: int | None, n_sub: int | None, init: int, judged: Sequence[Recording]
) -> None:
    """Refuse window lengths, sub-steps and run-ins that mean nothing."""
    for name, value, least in (("window", window, SHORTEST_WINDOW), ("n_sub", n_sub, 1)):
        if value is not None and not (_whole(value) and value >= least):
            raise UnusableInput(f"{name} = {value!r}: give a whole number of at least {least}")
    if not _whole(init) or init < 0 or init == 1:
        raise UnusableInput(f"init = {init!r}: give 0 (from rest) or at least 2 samples")
    for r in judged:
        if init >= r.n:
            raise UnusableInput(
                f"init = {init} leaves nothing to judge of {r.name!r}, which has {r.n} samples"
            )


def _whole(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def admit_sign(values: Mapping[str, float], known: Mapping[str, Parameter]) -> None:
    """Refuse negative values of parameters that physics keeps positive."""
    for n, v in values.items():
        if known[n].positive and v < 0:
            raise UnusableInput(
                f"{n} = {v:g} must be positive: check sign and unit, or declare "
                f"Parameter({n!r}, ..., positive=False)"
            )


FARTHEST = 1e6
"""Times the largest reading up to which an offset of its sensor may be: no unit makes more."""


def admit_offset(name: str, sensor: str, unit: str, values: Iterable[float], read: float) -> None:
    """Refuse an offset of a sensor (its start or its bounds) that no reading is anywhere near.

    Parameters
    ----------
    name : str
        The parameter.
    read : float
        Largest magnitude that the sensor reads in any recording, SI.
    """
    for v in values:
        if np.isfinite(v) and abs(v) > FARTHEST * read > 0:
            raise UnusableInput(
                f"{name} = {v:g} {unit}, of the offset of sensor {sensor}, is {abs(v) / read:.2g} "
                f"times its largest reading, {read:.4g} {unit}: check the digits; SI is meant"
            )


def distinct_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names, numbered where two are the same."""
    found: list[str] = []
    for i, n in enumerate(names):
        label, k = (f"{n}#{i + 1}" if names.count(n) > 1 else n), i + 1
        while label in found or (label != n and label in names):
            k += len(names)
            label = f"{n}#{k}"
        found.append(label)
    return tuple(found)


def admit_noise(name: str, levels: float | Sequence[float], sizes: Sequence[int]) -> None:
    """Refuse noise levels that are none, or not one for each recording.

    Parameters
    ----------
    sizes : sequence of int
        Samples of each recording, those to judge included.
    """
    try:
        if isinstance(levels, str | bool) or levels is None:
            raise TypeError(levels)
        found = np.asarray(levels, float)
        if found.ndim > 1:
            raise TypeError(levels)
    except (TypeError, ValueError):
        raise UnusableInput(f"noise of {name} = {levels!r}: give a deviation, SI") from None
    if found.ndim and found.size in sizes and found.size != len(sizes):
        raise UnusableInput(
            f"noise of {name}: a deviation for every sample ({found.size}); give one, SI, that "
            "holds throughout, or cut the recording where the noise changes"
        )
    if found.ndim and found.size != len(sizes):
        raise UnusableInput(
            f"noise of {name}: {found.size} deviations for {len(sizes)} recordings (those to "
            "judge included); give one, or one each"
        )
    for level in found.ravel():
        if not 0 < level < np.inf:
            raise UnusableInput(f"noise of {name} = {level}: give a positive deviation, SI")
