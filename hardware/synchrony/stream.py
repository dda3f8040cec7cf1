"""A whole stream of samples, put together from its chunks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput, require_known
from hardware.contracts import Chunk, Flag

VOLTAGE, LENGTH, COPY = "V", "x", "V_copy"
"""Channels: the drive's command, the sensor's length and its copy of the voltage."""
SPOILT = Flag.BEAM_LOST | Flag.MISCOUNT | Flag.SATURATED
"""Samples that no estimate may use."""


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """Samples by one clock.

    Parameters
    ----------
    rate : float
        Nominal (Hz).
    channels : mapping of str to ndarray
        (n,) each.
    numbers : ndarray, optional
        (n,), number of every sample since the start of the stream, increasing; a step of more than
        one is a known gap. Default: 0, 1, ...
    flags : ndarray, optional
        (n,), sums of `Flag`.
    units : mapping of str to str, optional

    Raises
    ------
    UnusableInput
        If sizes do not fit or the rate is not positive.
    """

    rate: float
    channels: Mapping[str, Array]
    numbers: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    flags: NDArray[np.uint16] = field(default_factory=lambda: np.zeros(0, np.uint16))
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check and freeze."""
        columns = {name: _frozen(np.array(v, np.float64)) for name, v in self.channels.items()}
        shapes = {v.shape for v in columns.values()}
        if len(shapes) != 1 or len(next(iter(shapes))) != 1:
            raise UnusableInput(f"stream: every channel needs the same (n,), not {sorted(shapes)}")
        n = next(iter(shapes))[0]
        if not (np.isfinite(self.rate) and self.rate > 0.0) or n < 2:
            raise UnusableInput(f"stream: {n} samples at {self.rate} Hz; 2 and a positive rate")
        numbers = self.numbers if self.numbers.size else np.arange(n)
        flags = self.flags if self.flags.size else np.zeros(n)
        if numbers.shape != (n,) or flags.shape != (n,) or np.any(np.diff(numbers) < 1):
            raise UnusableInput("stream: numbers must increase, with one number and flag a sample")
        object.__setattr__(self, "channels", MappingProxyType(columns))
        object.__setattr__(self, "numbers", _frozen(numbers.astype(np.int64)))
        object.__setattr__(self, "flags", _frozen(flags.astype(np.uint16)))
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))

    @classmethod
    def of(cls, rate: float, **channels: ArrayLike) -> Self:
        """Return a stream without gaps and flags from arrays by name."""
        return cls(rate, {name: np.asarray(v, float) for name, v in channels.items()})

    @classmethod
    def from_chunks(cls, chunks: Iterable[Chunk], rate: float) -> Self:
        """Put chunks of one stream together; a known gap marks the sample after it.

        Raises
        ------
        UnusableInput
            If there is none, they belong to several streams, or hold different channels.
        """
        pieces = [c for c in chunks if c.n]
        if not pieces or len({c.stream for c in pieces}) != 1:
            raise UnusableInput("stream: give the chunks of one stream, at least one with samples")
        names = set.intersection(*(set(c.channels) for c in pieces))
        if not names:
            raise UnusableInput(f"stream {pieces[0].stream}: its chunks share no channel")
        numbers = np.concatenate([c.first + np.arange(c.n) for c in pieces])
        flags = np.concatenate([c.flags for c in pieces])
        flags[1:][np.diff(numbers) > 1] |= np.uint16(Flag.LOST_BEFORE)
        columns = {k: np.concatenate([c.channels[k] for c in pieces]) for k in sorted(names)}
        return cls(rate, columns, numbers, flags, {k: pieces[0].units[k] for k in sorted(names)})

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.numbers.size)

    @property
    def time(self) -> Array:
        """Nominal instants from sample number 0 (s), ``(n,)``."""
        return np.asarray(self.numbers / self.rate)

    def channel(self, name: str) -> Array:
        """Return a channel; `UnknownName` with the nearest names if there is none."""
        require_known("channel", "the stream", self.channels, name)
        return self.channels[name]

    def filled(self, name: str) -> Array:
        """Return a channel at every number from first to last, straight across gaps, ``(m,)``."""
        every = np.arange(self.numbers[0], self.numbers[-1] + 1)
        return np.interp(every, self.numbers, self.channel(name))

    def usable(self, name: str) -> NDArray[np.bool_]:
        """Return which samples of a channel an estimate may use, ``(n,)``."""
        return np.asarray(np.isfinite(self.channel(name)) & ((self.flags & int(SPOILT)) == 0))


def _frozen(values: NDArray[Any]) -> NDArray[Any]:
    values.setflags(write=False)
    return values
