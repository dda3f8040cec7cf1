"""Samples as they arrive: some channels of one stream, with a flag word per sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntFlag
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput

INSTANT = "instant"
"""Channel that holds the time of every sample by the clock of the program (s)."""


class Flag(IntFlag):
    """What is known against a sample; zero is good. The numbers are stored: never reuse one."""

    GOOD = 0
    BEAM_LOST = 1
    """The counter may have lost fringes here or before: relative to later zeros only."""
    MISCOUNT = 2
    """Quadrant jump: the sample is off by a whole number of half wavelengths."""
    LEVEL_LOW = 4
    """Too little light; the warning before the beam is lost."""
    LASER_UNSTABLE = 8
    LOST_BEFORE = 16
    """Samples are missing between the one before and this one."""
    LATE = 32
    """Written or read later than planned."""
    CLAMPED = 64
    """The command was cut to its limits (only where the user opted in)."""
    SATURATED = 128
    """The converter was at its end."""
    AIR_STALE = 256
    """The correction for air rests on old or missing sensors."""
    UNSYNCHRONISED = 512
    """The instant of the trigger is not known to one sample."""


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """Consecutive samples of one stream.

    Parameters
    ----------
    stream : str
        Name of the stream, such as ``"interferometer"`` or ``"output"``; one stream has one clock.
    first : int
        Number of the first sample since the start of the stream; a gap to the chunk before means
        lost samples.
    channels : mapping of str to ndarray
        (n,) each, float64, in the units below. A channel ``"instant"`` (s), where there is one,
        holds the program's time of every sample.
    units : mapping of str to str
        Unit of every channel.
    flags : ndarray
        (n,), uint16, sums of `Flag`.
    """

    stream: str
    first: int
    channels: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str]
    flags: NDArray[np.uint16] = field(default_factory=lambda: np.zeros(0, np.uint16))

    def __post_init__(self) -> None:
        """Check shapes and freeze."""
        columns = {k: _column(v) for k, v in self.channels.items()}
        sizes = {v.size for v in columns.values()}
        if len(sizes) != 1 or any(v.ndim != 1 for v in columns.values()):
            raise UnusableInput(
                f"chunk of {self.stream}: every channel needs the same (n,), not "
                f"{[v.shape for v in columns.values()]}"
            )
        if set(columns) != set(self.units):
            raise UnusableInput(f"chunk of {self.stream}: give one unit for every channel")
        n = sizes.pop()
        flags = np.zeros(n, np.uint16) if self.flags.size == 0 else self.flags.astype(np.uint16)
        if flags.shape != (n,):
            raise UnusableInput(f"chunk of {self.stream}: {flags.shape} flags for {n} samples")
        flags.setflags(write=False)
        object.__setattr__(self, "channels", MappingProxyType(columns))
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))
        object.__setattr__(self, "flags", flags)

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.flags.size)


def _column(values: NDArray[np.float64]) -> NDArray[np.float64]:
    column = np.array(values, dtype=np.float64)
    column.setflags(write=False)
    return column
