"""Several recordings of one system behind one another: each from a state of its own."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.units import read_unit
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput

ENDS = 25
"""Samples at the slow rate that a low-pass spoils at either end."""
LARGEST = 50
"""Largest denominator of a ratio of two rates; what is left of it is a clock's difference."""


def joined(recordings: Sequence[Recording]) -> tuple[Recording, tuple[int, ...]]:
    """Put recordings behind one another; returns them and where the further ones begin.

    Each keeps the time between its own samples, and is simulated by it. The provenance is that of
    all of them, see `provenance`.

    Raises
    ------
    UnusableInput
        If there is none, channels or units differ, or one rate is twice the other
        (`picked` brings them together).
    """
    if not recordings:
        raise UnusableInput("no recording given; give at least one")
    first = recordings[0]
    if len(recordings) == 1:
        return first, ()
    for r in recordings[1:]:
        missing = [c for c in first.channels if c not in r.channels]
        if missing:
            raise UnusableInput(
                f"{r.name} has no channel {', '.join(missing)}, {first.name} has; recordings that "
                "are diagnosed together need the same channels"
            )
        wrong = [c for c in first.channels if first.units[c] != r.units[c]]
        if wrong:
            raise UnusableInput(
                f"{wrong[0]} is in {r.units[wrong[0]]} in {r.name} and in "
                f"{first.units[wrong[0]]} in {first.name}; correct a header"
            )
        if not 0.5 < r.dt / first.dt < 2.0:
            raise UnusableInput(
                f"{r.name} is sampled every {r.dt:.6g} s, {first.name} every {first.dt:.6g} s; "
                "resample one of them"
            )
    both = Recording(
        " + ".join(r.name for r in recordings),
        np.concatenate(_one_time(recordings)),
        {c: np.concatenate([r[c] for r in recordings]) for c in first.channels},
        dict(first.units),
        **provenance(recordings),
    )
    return both, tuple(int(e) for e in np.cumsum([r.n for r in recordings])[:-1])


def _one_time(recordings: Sequence[Recording]) -> list[Array]:
    """Return the times of recordings that follow each other, s."""
    begin, found = float(recordings[0].time[0]), []
    for r in recordings:
        found.append(begin + r.dt * np.arange(r.n))
        begin = float(found[-1][-1]) + r.dt
    return found


def _slower(r: Recording, step: float) -> Recording:
    """Return a recording of at least twice the rate at the slower one, low-passed."""
    from scipy.signal import resample_poly

    ratio = Fraction(r.dt / step).limit_denominator(LARGEST)
    if step > LARGEST * r.dt:
        ratio = Fraction(1, round(step / r.dt))
    note = f"brought from {1 / r.dt:.6g} to {1 / step:.6g} Hz, the rate of the slowest recording"
    if r.n * ratio < 2 * ENDS + 8:
        raise UnusableInput(
            f"{r.name}: its {r.n} samples are too few to be brought from {1 / r.dt:.6g} to "
            f"{1 / step:.6g} Hz, the rate of the slowest recording; leave it out"
        )
    if ratio.numerator == 1:
        thin = _inner(r.decimate(ratio.denominator))
        return replace(thin, meta={**thin.meta, "notes": (*r.notes, note)})
    up, down = ratio.numerator, ratio.denominator
    channels = {c: resample_poly(v, up, down, padtype="line") for c, v in r.channels.items()}
    count = next(iter(channels.values())).size
    time = r.time[0] + r.dt * down / up * np.arange(count)
    known = {k: v for k, v in r.meta.items() if k != "noise"}  # the low-pass takes a part of it
    thin = replace(r, time=time, channels=channels, meta={**known, "notes": (*r.notes, note)})
    return _inner(thin)


def picked(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Take every k-th sample of faster recordings, so that no two rates are far apart.

    Their commands are followed `between_samples`, which needs no low-pass: what is held at a rate
    of its own stays so, and the noise stays what it is. Where that is too much to simulate, they
    are low-passed and brought to the slowest rate.
    """
    if len(recordings) < 2:
        return tuple(recordings)
    made = tuple(_picked(r, k) for r, k in zip(recordings, _steps(recordings), strict=True))
    slowest = max(r.dt for r in recordings)
    return tuple(r if 2 * r.dt > slowest else _slower(r, slowest) for r in made)


def between_samples(recordings: Sequence[Recording]) -> tuple[tuple[int, dict[str, Array]], ...]:
    """Return what channels do between the samples that are `picked` of their recordings.

    What is held between the samples of a fast recording is not held between fewer ones.

    Returns
    -------
    tuple of (int, dict)
        For each recording k and its channels, shape ((n - 1) k + 1,) for n samples; (1, {}) of one
        that is taken as it is.
    """
    each = zip(_steps(recordings), recordings, strict=True)
    return tuple(
        (k, {c: v[: (r.n - 1) // k * k + 1] for c, v in r.channels.items()}) if k > 1 else (1, {})
        for k, r in each
    )


FINEST = 8
"""Steps a sample that are always followed: each is simulated, in all recordings."""
IN_ALL = 2**17
"""Steps of all recordings together up to which more of them are."""


def _steps(recordings: Sequence[Recording]) -> list[int]:
    """Return how many samples of each are about one of the slowest; one alone may be one sample."""
    if len(recordings) < 2:
        return [1] * len(recordings)
    slowest = max(r.dt for r in recordings)
    nearest = [round(slowest / r.dt) for r in recordings]
    # powers of two have small multiples in common
    doubled = [2 ** round(math.log2(slowest / r.dt)) for r in recordings]
    for steps in (nearest, doubled):
        common = math.lcm(*steps)
        kept = sum(r.n // k for r, k in zip(recordings, steps, strict=True))
        if common <= FINEST or common * kept <= IN_ALL:
            return steps
    return [k if k <= FINEST else 1 for k in doubled]


def _picked(r: Recording, steps: int) -> Recording:
    if steps == 1:
        return r
    note = f"taken every {steps} samples, at about the rate of the slowest recording"
    channels = {c: v[::steps] for c, v in r.channels.items()}
    meta = {**r.meta, "notes": (*r.notes, note)}
    return replace(r, time=r.time[::steps], channels=channels, meta=meta)


def _inner(r: Recording) -> Recording:
    """Leave out the ends, where the low-pass goes on otherwise in a command than in a reading."""
    return r.slice(ENDS, r.n - ENDS)


def provenance(recordings: Sequence[Recording]) -> dict[str, Any]:
    """Return `source`, `sha256` and `meta` of recordings that are taken as one.

    Returns
    -------
    dict
        ``sha256`` is that of the file they all come from, else the SHA-256 of their hashes in
        order, one a line; empty if one of them comes from no file. ``meta["parts"]`` lists name,
        source, hash, samples and all else of each, ``meta["notes"]`` say whose they are, and
        ``meta["resolution"]`` and ``meta["noise"]`` are the largest declared for each channel.
    """
    hashes = [r.sha256 for r in recordings]
    if len(set(hashes)) == 1 or not all(hashes):
        whole = hashes[0] if all(hashes) else ""
    else:
        whole = hashlib.sha256("\n".join(hashes).encode()).hexdigest()
    parts = [
        {
            "name": r.name, "source": r.source, "sha256": r.sha256, "samples": r.n,
            "meta": dict(r.meta),
        }
        for r in recordings
    ]  # fmt: skip
    notes = tuple(dict.fromkeys(f"{r.name}: {note}" for r in recordings for note in r.notes))
    meta: dict[str, Any] = {"notes": notes, "parts": parts}
    meta |= {key: each for key in DECLARED if (each := _largest(recordings, key))}
    meta |= {"read_in": alike} if (alike := _read_alike(recordings)) else {}
    source = " + ".join(dict.fromkeys(r.source for r in recordings if r.source))
    return {"source": source, "sha256": whole, "meta": meta}


DECLARED = ("resolution", "noise")
"""What recordings may say of each channel's readings, SI."""


def _largest(recordings: Sequence[Recording], key: str) -> dict[str, float]:
    """Return the largest number that is declared for each channel."""
    found: dict[str, float] = {}
    for r in recordings:
        known = r.meta.get(key)
        for name, unit in known.items() if isinstance(known, Mapping) else ():
            found[name] = max(unit, found.get(name, 0.0))
    return found


def _read_alike(recordings: Sequence[Recording]) -> dict[str, str]:
    """Return the units in which all recordings were read."""
    first = recordings[0]
    return {
        n: u for n, u in first.read_in.items()
        if (known := read_unit(u)) is not None
        and not known.is_si
        and all(r.read_in.get(n) == u for r in recordings)
    }  # fmt: skip


def split_of(recordings: Sequence[Recording]) -> Split:
    """Hold out the last third of the recordings, at least one."""
    sizes = [r.n for r in recordings]
    held = max(1, len(sizes) // 3)
    edge = sum(sizes[:-held])
    few, word = (f"{held} ", "are") if held > 1 else ("", "is")
    rule = f"the last {few}of {len(sizes)} recordings {word} held out"
    return Split(slice(0, edge), slice(edge, sum(sizes)), rule)
