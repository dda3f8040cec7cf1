"""Which samples of a record fit and which judge, by one stated rule."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.signals.repeating import first_peak, likeness, refined
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput

if TYPE_CHECKING:
    from bondgraph.signals.recording import Recording


@dataclass(frozen=True, slots=True)
class Split:
    """Which samples fit, which samples judge.

    Parameters
    ----------
    train, test : slice or tuple of slice
        Samples scored in the fit and held out of it.
    rule : str
        The rule in words.
    rest : slice or None
        Leading samples with a constant input: noise floor only, never scored in train.
    score_from : int
        First sample to score; a simulation may start before it to settle.
    looked_at : slice or tuple of slice
        Samples held out of the fit that choices between fits have looked at; not scored in test.
    """

    train: slice | tuple[slice, ...]
    test: slice | tuple[slice, ...]
    rule: str
    rest: slice | None = None
    score_from: int = 0
    looked_at: slice | tuple[slice, ...] = ()


def stretches(part: slice | tuple[slice, ...]) -> tuple[slice, ...]:
    """Return the stretches of one part of a split."""
    return part if isinstance(part, tuple) else (part,)


def whole(part: slice | tuple[slice, ...]) -> slice:
    """Return the samples from the first to the last stretch of one part, gaps included.

    Examples
    --------
    >>> whole((slice(0, 2), slice(4, 6)))
    slice(0, 6, None)
    """
    parts = stretches(part)
    return slice(parts[0].start, parts[-1].stop) if parts else slice(0, 0)


def kept_back(split: Split) -> tuple[Split, Split]:
    """Divide what is held out: what choices may look at, and what they may not.

    Of many stretches two in five are kept back, spread over the record; of few the last two fifths
    of each. Where that leaves too few samples, nothing is kept back.

    Returns
    -------
    seen, unseen : Split
        With the same training samples.
    """
    parts = stretches(split.test)
    if len(parts) >= FEW:
        seen = tuple(p for i, p in enumerate(parts) if i % 5 not in KEPT)
        unseen = tuple(p for i, p in enumerate(parts) if i % 5 in KEPT)
    else:
        ends = [p.start + 3 * (p.stop - p.start) // 5 for p in parts]
        seen = tuple(slice(p.start, e) for p, e in zip(parts, ends, strict=True))
        unseen = tuple(slice(e, p.stop) for p, e in zip(parts, ends, strict=True))
    if sum(p.stop - p.start for p in unseen) < LEAST_KEPT:
        return split, split
    told = "two fifths of what is held out take no part in any choice either, and say the gain"
    rule = f"{split.rule}; {told}"
    return replace(split, test=seen), replace(split, test=unseen, rule=rule, looked_at=seen)


FEW = 5
"""Stretches from which some are kept back whole."""
KEPT = (1, 3)
LEAST_KEPT = 40
"""Samples that are worth keeping back."""


def interleaved(start: int, stop: int, blocks: int = 30, every: int = 3) -> Split:
    """Hold out every third of short stretches: both parts see every level, band and time.

    Parameters
    ----------
    start, stop : int
        Samples to divide.
    blocks : int
        Number of stretches.
    every : int
        One of so many is held out.
    """
    edges = np.linspace(start, stop, blocks + 1).astype(int)
    parts = [slice(int(a), int(b)) for a, b in pairwise(edges) if b > a]
    test = tuple(p for i, p in enumerate(parts) if i % every == every - 1)
    train = tuple(p for i, p in enumerate(parts) if i % every != every - 1)
    which = {2: "second", 3: "third"}.get(every, f"{every}th")
    rule = (
        f"every {which} of {len(parts)} equal stretches of the record is held out, no parameter is "
        "fitted to it"
    )
    return Split(train, test, rule)


def default_split(
    recording: Recording,
    fraction: float = 1.0 / 3.0,
    drive: str | ArrayLike | None = None,
    watched: Collection[str] | None = None,
) -> Split:
    """Hold out the last part of a record, by one stated rule: that of a fit.

    A diagnosis holds out stretches all over a long record (`interleaved`). Here the last `fraction`
    of the samples is. If a drive is given: leading samples in which it stays within 1 % of its
    range for at least 2 % of the record, and in which nothing `watched` moves, are rest and not
    scored (a drive that is constant drives all the same); if it is periodic afterwards
    (autocorrelation of at least 0.98 at some lag up to half the record), train and test are whole
    periods counted back from the end, at least one each, and what is left before the first whole
    period is run-in, before `score_from`. A rest that leaves a single sample is none.

    Parameters
    ----------
    recording : Recording
        N samples.
    fraction : float
        Held-out part, between 0 and 1 (exclusive).
    drive : str or array_like, optional
        The input: a channel name or (N,) values.
    watched : collection of str, optional
        Channels that rest with it; all when not given.

    Returns
    -------
    Split
        Slices of samples; test is empty only if there is one sample.

    Raises
    ------
    UnusableInput
        If the fraction or the shape of the drive is wrong.

    Examples
    --------
    >>> from bondgraph.signals.recording import Recording
    >>> r = Recording.from_arrays("demo", {"x[m]": [0.0, 1.0, 2.0]}, fs=1.0)
    >>> default_split(r).test
    slice(2, 3, None)
    """
    if not 0.0 < fraction < 1.0:
        raise UnusableInput(f"{recording.name}: hold out between 0 and 1, not {fraction!r}")
    n, rest, period = recording.n, None, None
    if drive is not None:
        u = recording[drive] if isinstance(drive, str) else np.asarray(drive, dtype=np.float64)
        if u.shape != (n,):
            raise UnusableInput(f"{recording.name}: the drive has shape {u.shape}, not ({n},)")
        rest = _rest(u)
        if rest and n - rest.stop < 2:
            rest = None  # nothing would be left to fit and to judge
        known = recording.channels if watched is None else watched
        if rest and any(_moves(np.asarray(recording[c]), rest) for c in known):
            rest = None
        period = _period(u[rest.stop if rest else 0 :])
    start = rest.stop if rest else 0
    left = n - start
    said = f"; rest of {start} samples not scored" if rest else ""
    whole = int((left + 0.5) / period) if period else 0
    if period and whole >= 2:
        held = min(max(1, round(fraction * whole)), whole - 1)
        first = max(start, n - round(whole * period))
        cut = n - round(held * period)
        rule = f"last {held} of {whole} whole periods of {period:.6g} samples held out{said}"
        return Split(slice(first, cut), slice(cut, n), rule, rest, first)
    held = min(max(1, round(fraction * left)), left - 1)
    rule = f"last {fraction:.3g} of {left} samples held out{said}"
    return Split(slice(start, n - held), slice(n - held, n), rule, rest, start)


def _rest(u: FloatArray) -> slice | None:
    """Leading samples in which the drive stays within 1 % of its range, if 2 % of the record."""
    span = float(np.ptp(u))
    if span == 0.0:
        return None
    moving = np.maximum.accumulate(u) - np.minimum.accumulate(u) > 0.01 * span
    stop = int(np.argmax(moving))
    return slice(0, stop) if stop >= max(2, 0.02 * u.size) else None


def _moves(y: FloatArray, rest: slice) -> bool:
    """Whether a channel goes far in a stretch: more than its own roughness, and than slow noise."""
    inside = y[rest]
    if inside.size < LEAST:
        return False
    parts = np.array_split(inside, min(PARTS, inside.size // 16))
    went = float(np.ptp([p.mean() for p in parts]))
    rough = float(np.mean([p.std() for p in parts])) / np.sqrt(parts[-1].size)
    return bool(went > max(MOVES * float(np.ptp(y)), ROUGH * rough))


LEAST = 32
"""Samples of a rest in which anything can be seen to move."""
PARTS = 16
"""Parts of a rest whose means are compared."""
MOVES = 0.2
"""Part of the range of a channel by which these differ in one that moves."""
ROUGH = 6.0
"""Standard errors of such a mean by which they differ by chance."""


def _period(u: FloatArray) -> float | None:
    """Period of a drive in samples (fractions possible), None if it does not repeat."""
    if u.size < 8 or np.ptp(u) == 0.0:
        return None
    r = likeness(u - u.mean())
    first, _ = first_peak(r, 0.98)
    return refined(r, first, 0.1) if first else None
