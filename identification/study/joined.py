"""Several recordings of one system as one: each from a state of its own, the last ones held out."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput


def joined(recordings: Sequence[Recording]) -> tuple[Recording, tuple[int, ...]]:
    """Put recordings behind one another; returns them and where the further ones begin.

    The provenance is that of all of them, see `provenance`.

    Raises
    ------
    UnusableInput
        If there is none, or channels, units or sampling differ.
    """
    if not recordings:
        raise UnusableInput("no recording given; give at least one")
    first = recordings[0]
    if len(recordings) == 1:
        return first, ()
    step = float(np.median(np.diff(first.time)))
    for r in recordings[1:]:
        missing = [c for c in first.channels if c not in r.channels]
        if missing:
            raise UnusableInput(
                f"{r.name} has no channel {', '.join(missing)}, {first.name} has; recordings that "
                "are diagnosed together need the same channels"
            )
        other = float(np.median(np.diff(r.time)))
        if abs(other - step) > 1e-6 * step:
            raise UnusableInput(
                f"{r.name} is sampled every {other:.6g} s, {first.name} every {step:.6g} s; "
                "resample one of them"
            )
        wrong = [c for c in first.channels if first.units[c] != r.units[c]]
        if wrong:
            raise UnusableInput(
                f"{wrong[0]} is in {r.units[wrong[0]]} in {r.name} and in "
                f"{first.units[wrong[0]]} in {first.name}; correct a header"
            )
    edges = np.cumsum([r.n for r in recordings])
    headers = {c: f"{c}[{first.units[c]}]" if first.units[c] else c for c in first.channels}
    channels = {headers[c]: np.concatenate([r[c] for r in recordings]) for c in headers}
    name = " + ".join(r.name for r in recordings)
    both = replace(Recording.from_arrays(name, channels, fs=1.0 / step), **provenance(recordings))
    return both, tuple(int(e) for e in edges[:-1])


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


def split_of(recordings: Sequence[Recording]) -> Split:
    """Hold out the last third of the recordings, at least one."""
    sizes = [r.n for r in recordings]
    held = max(1, len(sizes) // 3)
    edge = sum(sizes[:-held])
    rule = f"the last {held} of {len(sizes)} recordings held out"
    return Split(slice(0, edge), slice(edge, sum(sizes)), rule)
