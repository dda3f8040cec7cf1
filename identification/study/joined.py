"""Several recordings of one system as one: each from a state of its own, the last ones held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput

Array = np.ndarray


def joined(recordings: Sequence[Recording]) -> tuple[Recording, tuple[int, ...]]:
    """Put recordings behind one another; returns them and where the further ones begin.

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
    both = Recording.from_arrays(name, channels, fs=1.0 / step)
    return both, tuple(int(e) for e in edges[:-1])


def split_of(recordings: Sequence[Recording]) -> Split:
    """Hold out the last third of the recordings, at least one."""
    sizes = [r.n for r in recordings]
    held = max(1, len(sizes) // 3)
    edge = sum(sizes[:-held])
    rule = f"the last {held} of {len(sizes)} recordings held out"
    return Split(slice(0, edge), slice(edge, sum(sizes)), rule)
