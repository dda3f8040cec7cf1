"""Cutting, joining and thinning of recordings, by rules that are written into their notes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput
from identification.datasets import LoadedRecording
from identification.study.joined import provenance

__all__ = [
    "apart", "at_boundary", "boundary_split", "in_pieces", "joined", "noted", "stretches_of",
    "thinned",
]  # fmt: skip


def noted(recording: Recording, note: str) -> Recording:
    """Return the recording with one more note."""
    return replace(recording, meta={**recording.meta, "notes": (*recording.notes, note)})


def thinned(recording: Recording, factor: int) -> Recording:
    """Return every `factor`-th sample, without a filter: the noise stays as white as it was."""
    kept = recording.decimate(factor, unfiltered=tuple(recording.channels))
    meta = {**recording.meta, "notes": (*recording.notes, f"every {factor}th sample is kept")}
    return replace(kept, meta=meta)


def joined(name: str, parts: Sequence[Recording], note: str) -> Recording:
    """Return recordings of one rate one after the other, on one time base from 0.

    What else the first one knows of itself stays; hashes and notes are those of all.

    Raises
    ------
    UnusableInput
        Rates or channels differ.
    """
    first = parts[0]
    for r in parts[1:]:
        if not np.isclose(r.dt, first.dt, rtol=1e-3) or set(r.channels) != set(first.channels):
            raise UnusableInput(
                f"{name}: {r.name} and {first.name} differ in rate or channels; join equal ones"
            )
    channels = {k: np.concatenate([r[k] for r in parts]) for k in first.channels}
    time = np.arange(sum(r.n for r in parts), dtype=np.float64) * first.dt
    known = provenance(parts)
    known["meta"] = {**first.meta, **known["meta"]}
    return noted(replace(first, name=name, time=time, channels=channels, **known), note)


def boundary_split(recording: Recording, boundary: int, rule: str, *, skip: int = 0) -> Split:
    """Return the split at one sample; the first `skip` samples of both parts are not scored.

    Raises
    ------
    UnusableInput
        A part would be empty.
    """
    if not skip < boundary < recording.n - skip:
        raise UnusableInput(
            f"{recording.name}: no split at sample {boundary} of {recording.n} without the first "
            f"{skip} samples of each part; get the whole record"
        )
    return Split(slice(skip, boundary), slice(boundary + skip, recording.n), rule, score_from=skip)


def at_boundary(
    name: str,
    note: str,
    rule: str,
    *,
    before: int | None = None,
    after: int | None = None,
    skip: int = 0,
    channels: Sequence[str] = (),
) -> Callable[[Recording, Recording], LoadedRecording]:
    """Return what joins a training and a test part and splits them at their boundary.

    Of the two, `before` and `after` samples are kept, all if not given; also all `channels`.
    """

    def prepared(first: Recording, last: Recording) -> LoadedRecording:
        first = first.slice(None if before is None else first.n - before)
        whole = joined(name, (first, last.slice(0, after)), note)
        whole = whole.select({k: k for k in channels or whole.channels})
        return LoadedRecording(whole, boundary_split(whole, first.n, rule, skip=skip))

    return prepared


def apart(
    name: str, held: int, rule: str, channels: Mapping[str, str] | None = None
) -> Callable[..., LoadedRecording]:
    """Return what joins recordings that start from states of their own; the last `held` judge.

    Where the further ones begin is in ``meta["breaks"]``; a diagnosis takes them by `stretches_of`.
    """

    def prepared(*parts: Recording) -> LoadedRecording:
        if channels is not None:
            parts = tuple(r.select(channels) for r in parts)
        ends = np.cumsum([r.n for r in parts])
        made = joined(name, parts, f"{len(parts)} recordings, each from a state of its own")
        meta = {**made.meta, "breaks": tuple(int(e) for e in ends[:-1])}
        edge = int(ends[-held - 1])
        return LoadedRecording(
            replace(made, meta=meta), Split(slice(0, edge), slice(edge, made.n), rule)
        )

    return prepared


def in_pieces(recording: Recording, size: int) -> LoadedRecording:
    """Return a recording in pieces of `size` samples from states of their own; every third judges.

    For a plant that nothing holds: in a free run a small force that is not modelled moves it ever
    further. What is left over at the end is not used.
    """
    pieces = [
        replace(recording.slice(a, a + size), name=f"{recording.name} {a}")
        for a in range(0, recording.n - size + 1, size)
    ]
    order = [p for i, p in enumerate(pieces) if i % 3 < 2], pieces[2::3]
    rule = f"pieces of {size} samples, each from a state of its own; every third judges"
    return apart(recording.name, len(order[1]), rule)(*order[0], *order[1])


def stretches_of(recording: Recording) -> tuple[Recording, ...]:
    """Return the recordings that `apart` joined; the recording itself if it is in one piece."""
    ends = (0, *recording.meta.get("breaks", ()), recording.n)
    if len(ends) == 2:
        return (recording,)
    return tuple(
        replace(recording.slice(first, last), name=str(part["name"]), meta=dict(part["meta"]))
        for part, (first, last) in zip(recording.meta["parts"], pairwise(ends), strict=True)
    )
