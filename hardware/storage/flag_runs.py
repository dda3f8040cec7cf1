"""Flags of a record as runs: which flag, of which stream, from which sample to which."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag


@dataclass(frozen=True, slots=True, order=True)
class FlagRun:
    """A flag on consecutive samples.

    Parameters
    ----------
    stream : str
        Whose samples they were.
    flag : str
        Name of the `Flag`.
    first, last : int
        Sample numbers of the recording, both included.
    """

    stream: str
    flag: str
    first: int
    last: int


def flag_runs(flags: Mapping[str, NDArray[np.uint16]]) -> tuple[FlagRun, ...]:
    """Return the runs of every flag in flag words.

    Parameters
    ----------
    flags : mapping of str to ndarray
        (N,) uint16 for every stream.

    Examples
    --------
    >>> flag_runs({"a": np.array([0, 4, 4, 5], np.uint16)})
    (FlagRun(stream='a', flag='BEAM_LOST', first=3, last=3), \
FlagRun(stream='a', flag='LEVEL_LOW', first=1, last=3))
    """
    runs: list[FlagRun] = []
    for stream, words in flags.items():
        known = int(np.bitwise_or.reduce(words, initial=0))
        for flag in Flag:
            if not flag & known:
                continue
            known &= ~int(flag)
            on = np.concatenate(([0], (words & np.uint16(flag)).astype(bool).astype(np.int8), [0]))
            edges = np.flatnonzero(np.diff(on))
            runs += [
                FlagRun(stream, str(flag.name), int(a), int(b) - 1)
                for a, b in zip(edges[::2], edges[1::2], strict=True)
            ]
        if known:
            raise UnusableInput(f"flags of {stream}: {known:#06x} is no known flag")
    return tuple(runs)


def expanded(runs: Iterable[FlagRun], n: int) -> NDArray[np.uint16]:
    """Return flag words, (n,) uint16, with the runs of all streams in them.

    Raises
    ------
    UnusableInput
        A run lies outside, or names a flag this version does not know.

    Examples
    --------
    >>> expanded([FlagRun("a", "LEVEL_LOW", 1, 2)], 4)
    array([0, 4, 4, 0], dtype=uint16)
    """
    words = np.zeros(n, np.uint16)
    for run in runs:
        if run.flag not in Flag.__members__:
            raise UnusableInput(f"flag {run.flag!r} is not known; update Bondsight")
        if not 0 <= run.first <= run.last < n:
            raise UnusableInput(
                f"flag {run.flag} on samples {run.first} to {run.last} of a record of {n}"
            )
        words[run.first : run.last + 1] |= np.uint16(Flag[run.flag])
    return words
