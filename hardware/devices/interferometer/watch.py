"""From values of the library to chunks: units, flags, gaps of the sample counter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Chunk, Flag
from hardware.devices.interferometer.constants import Aux, ValueStatus
from hardware.devices.interferometer.pump import Drained

WARNING_LEVEL: Final = 0.5
"""Share of the amplitude at the zero below which samples are flagged as dim."""

_WIDTHS = (16, 24, 32)
_UNITS = {"x": "m", "sin": "count", "cos": "count", "sample": "1", "clock": "s"}
_CLOCK = 50e6


@dataclass(frozen=True, slots=True)
class LostSamples:
    """Lost samples: number of the first one, and how many."""

    first: int
    count: int


@final
class MeasurementWatch:
    """Follows one measurement from its first value on.

    Parameters
    ----------
    stream : str
        Name of the stream.
    extras : sequence of str
        Channels beside ``x`` and ``sample``: ``"sin"``, ``"cos"``, ``"clock"``.
    amplitude : float
        Amplitude of the signals at the zero (counts); 0 if it is not known.
    stabilised : bool
        Whether the laser said to be stable at the zero.
    """

    def __init__(
        self,
        stream: str,
        extras: Sequence[str] = (),
        amplitude: float = 0.0,
        stabilised: bool = True,
    ) -> None:
        self._stream, self._extras = stream, tuple(extras)
        self._amplitude, self._stabilised = amplitude, stabilised
        self._next = 0
        self._last: int | None = None
        self._step: int | None = None
        self._turns = 0
        self._clock_last = 0
        self._latched = Flag.GOOD
        self.received = 0
        self.beam_lost_at: int | None = None
        self.gaps: list[LostSamples] = []

    @property
    def wanted(self) -> tuple[Aux, ...]:
        """What must be drained beside length and status."""
        kinds = {"sin": Aux.SINE, "cos": Aux.COSINE, "clock": Aux.CLOCK}
        return (Aux.NORM, Aux.SAMPLE, *(kinds[k] for k in self._extras))

    def chunks(self, values: Drained, air: Flag = Flag.GOOD) -> list[Chunk]:
        """Return values as chunks, cut where samples are missing; new gaps go to `gaps`."""
        n = values.length.size
        if n == 0:
            return []
        counter = values.aux[Aux.SAMPLE]
        missing = self._missing(counter)
        flags = self._flags(values) | np.uint16(air)
        flags[missing > 0] |= np.uint16(Flag.LOST_BEFORE)
        number = self._next + np.arange(n) + np.cumsum(missing)
        if self.beam_lost_at is None:
            lost = np.flatnonzero(flags & Flag.BEAM_LOST)
            self.beam_lost_at = int(number[lost[0]]) if lost.size else None
        columns = {"x": 1e-9 * values.length, "sample": counter.astype(np.uint32).astype(float)}
        for name in self._extras:
            columns[name] = self._extra(name, values)
        cuts = np.flatnonzero(missing)
        self.gaps += [LostSamples(int(number[k] - missing[k]), int(missing[k])) for k in cuts]
        self._next = int(number[-1]) + 1
        self.received += n
        edges = [0, *(int(k) for k in cuts if k > 0), n]
        units = {name: _UNITS[name] for name in columns}
        return [
            Chunk(
                self._stream,
                int(number[a]),
                {name: column[a:b] for name, column in columns.items()},
                units,
                flags[a:b],
            )
            for a, b in pairwise(edges)
        ]

    def _flags(self, values: Drained) -> NDArray[np.uint16]:
        """Return flags of each sample; those of the beam and the laser hold until the next zero."""
        s = values.status
        flags = np.zeros(s.size, np.uint16)
        rules = (
            (s & ValueStatus.QUADRANT != 0, Flag.MISCOUNT | Flag.BEAM_LOST),
            (s & ValueStatus.LEVEL != 0, Flag.LEVEL_LOW | Flag.BEAM_LOST),
            (s & ValueStatus.BAD_REQUEST != 0, Flag.BEAM_LOST),
            (s & ValueStatus.LASER_WAS_UNSTABLE != 0, Flag.LASER_UNSTABLE),
        )
        for where, flag in rules:
            hits = np.flatnonzero(where)
            if hits.size:
                flags[hits[0] :] |= np.uint16(flag)
        flags |= np.uint16(self._latched)
        self._latched = Flag(int(flags[-1]))
        if self._stabilised:
            flags[s & ValueStatus.LASER_STABLE == 0] |= np.uint16(Flag.LASER_UNSTABLE)
        dim = values.aux[Aux.NORM] < WARNING_LEVEL * self._amplitude
        flags[dim] |= np.uint16(Flag.LEVEL_LOW)
        return flags

    def _missing(self, counter: NDArray[np.int32]) -> NDArray[np.int64]:
        """Return the number of samples lost before each one, by the sample counter.

        The step of the counter is that of most samples, since a device that averages may count
        its primary samples.
        """
        c = counter.astype(np.uint32).astype(np.int64)
        before = c[0] if self._last is None else self._last
        steps = np.diff(c, prepend=before)
        back = steps < 0
        if back.any():
            steps[back] = [_unwrapped(int(d), int(p)) for d, p in self._pairs(c, before, back)]
        inner = steps if self._last is not None else steps[1:]
        self._last = int(c[-1])
        if self._step is None and inner.size:
            self._step = max(int(np.median(inner)), 1)
        missing = np.zeros(c.size, np.int64)
        if self._step is not None:
            missing[c.size - inner.size :] = np.maximum(inner // self._step - 1, 0)
        return missing

    @staticmethod
    def _pairs(
        c: NDArray[np.int64], before: int, back: NDArray[np.bool_]
    ) -> list[tuple[np.int64, np.int64]]:
        previous = np.concatenate([[before], c[:-1]])
        return list(zip((c - previous)[back], previous[back], strict=True))

    def _extra(self, name: str, values: Drained) -> NDArray[np.float64]:
        if name != "clock":
            return values.aux[Aux.SINE if name == "sin" else Aux.COSINE].astype(float)
        c = values.aux[Aux.CLOCK].astype(np.uint32).astype(np.int64)
        turns = self._turns + np.cumsum(np.diff(c, prepend=self._clock_last) < 0)
        self._turns, self._clock_last = int(turns[-1]), int(c[-1])
        return np.asarray((c + (turns << 32)) / _CLOCK)


def _unwrapped(step: int, previous: int) -> int:
    """Return the true step of a counter that has turned over, by the narrowest width that fits."""
    width = next(w for w in _WIDTHS if previous < 1 << w)
    return step % (1 << width)
