"""Cutting, joining and thinning of recordings, by rules that are written into their notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput
from identification.datasets import protocol
from identification.datasets.public_set import Protocol
from identification.study.joined import provenance

__all__ = ["boundary_split", "joined", "noted", "part_of", "thinned", "train_of"]


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


def train_of(found: Protocol, part: str) -> Recording:
    """Return a training record by the end of its name.

    Raises
    ------
    UnusableInput
        There is none.
    """
    for r in found.train:
        if r.name.endswith(f"/{part}"):
            return r
    raise UnusableInput(f"{found.about.name}: no training record {part}; get the whole set")


def part_of(dataset: str, part: str, folder: str | None) -> Recording:
    """Return one record of a public set, whichever part of its protocol it is in.

    Raises
    ------
    UnusableInput
        There is none, or the set is not there.
    """
    found = protocol(dataset, folder)
    return found.tests[part] if part in found.tests else train_of(found, part)
