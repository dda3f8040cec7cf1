"""Samples of one stream as they were stored, and what is missing among them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class StreamGap:
    """Missing samples.

    Parameters
    ----------
    first, last : int
        Numbers of the first and the last that are missing.
    """

    first: int
    last: int

    @property
    def n(self) -> int:
        """How many."""
        return self.last - self.first + 1


@dataclass(frozen=True, slots=True)
class StreamLayout:
    """What a stream is.

    Parameters
    ----------
    name : str
        Its name.
    units : mapping of str to str
        Unit of every channel.
    named : bool
        False if its record is lost, and these are stand-ins.
    """

    name: str
    units: Mapping[str, str]
    named: bool = True

    def __post_init__(self) -> None:
        """Freeze."""
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))


@dataclass(frozen=True, slots=True, eq=False)
class StreamData:
    """All whole chunks of a stream; gaps are never closed.

    Parameters
    ----------
    layout : StreamLayout
        Name and units.
    numbers : ndarray
        (n,), int64, increasing: number of every sample since the start of its stream.
    channels : mapping of str to ndarray
        (n,) each, in the units of the layout.
    flags : ndarray
        (n,), uint16.
    repeated : int
        Samples that came again under a number already stored, and were left out.
    """

    layout: StreamLayout
    numbers: NDArray[np.int64]
    channels: Mapping[str, NDArray[np.float64]]
    flags: NDArray[np.uint16]
    repeated: int = 0

    def __post_init__(self) -> None:
        """Freeze."""
        self.numbers.setflags(write=False)
        self.flags.setflags(write=False)
        for values in self.channels.values():
            values.setflags(write=False)
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.numbers.size)

    @property
    def gaps(self) -> tuple[StreamGap, ...]:
        """Samples missing before the last stored one, those before the first included."""
        before = np.concatenate(([-1], self.numbers))
        at = np.flatnonzero(np.diff(before) > 1)
        return tuple(
            StreamGap(int(a) + 1, int(b) - 1)
            for a, b in zip(before[at], before[at + 1], strict=True)
        )

    @property
    def lost(self) -> int:
        """Number of samples missing before the last stored one."""
        return int(self.numbers[-1]) + 1 - self.n if self.n else 0
