"""The state of a running acquisition, gathered from what arrives."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import INSTANT, Chunk, Clock, Flag
from hardware.live.state import RECENT, ChannelState, LiveState, StreamState


@final
class Gathering:
    """Gathers the state; costs some microseconds a chunk and a fixed amount of memory.

    Parameters
    ----------
    name : str
        Name of the recording.
    clock : Clock
        The program's time.
    totals : mapping of str to int
        Samples asked for, by stream, in the order to show them.
    duration : float, optional
        s the acquisition takes; without it the time left comes from the totals.
    window : float
        s of signal that are kept for drawing, where the rate is known.
    rates : mapping of str to float, optional
        Nominal rates (Hz).
    """

    def __init__(
        self,
        name: str,
        clock: Clock,
        totals: Mapping[str, int],
        *,
        duration: float | None = None,
        rates: Mapping[str, float] | None = None,
        window: float = 2.0,
    ) -> None:
        if not 0.0 < window < float("inf"):
            raise UnusableInput(f"live view: a window of {window!r} s; give a positive time")
        self._name, self._clock, self._start = name, clock, clock.now()
        self._duration, self._window = duration, window
        self._rates = dict(rates or {})
        self._totals = dict(totals)
        self._streams: dict[str, _Stream] = {s: _Stream() for s in totals}
        self._warnings: dict[str, None] = {}
        self.phase = ""
        self.urgent = False
        """Whether a warning came since the last state."""
        self.output = ""
        """Shown as it is, see `LiveState`."""
        self._ended = False

    def take(self, chunk: Chunk) -> None:
        """Count the samples of a chunk."""
        stream = self._streams.setdefault(chunk.stream, _Stream())
        step = max(1, round(self._rates.get(chunk.stream, 1.0) * self._window / RECENT))
        for sentence in stream.take(chunk, step, self._clock.now()):
            self.warn(f"{chunk.stream}: {sentence}")

    def warn(self, sentence: str) -> None:
        """Show a sentence from now on; once, however often it comes."""
        self.urgent |= sentence not in self._warnings
        self._warnings.setdefault(sentence)

    def end(self) -> None:
        """Say that it is over."""
        self._ended = True

    def state(self) -> LiveState:
        """Return what is to be shown now."""
        self.urgent = False
        elapsed = self._clock.now() - self._start
        streams = tuple(s.state(n, self._totals.get(n)) for n, s in self._streams.items())
        return LiveState(
            self._name, elapsed, self._left(elapsed, streams), streams, self.output,
            tuple(self._warnings), self._ended, self.phase,
        )  # fmt: skip

    def _left(self, elapsed: float, streams: tuple[StreamState, ...]) -> float | None:
        if self._ended:
            return 0.0
        if self._duration is not None:
            return max(0.0, self._duration - elapsed)
        times = [
            (s.total - s.samples - s.lost) / (self._rates.get(s.name) or s.rate)
            for s in streams
            if s.total is not None and (self._rates.get(s.name) or s.rate) > 0.0
        ]
        return max([0.0, *times]) if times else None


@final
class _Stream:
    """Sums over one stream."""

    def __init__(self) -> None:
        self.samples = 0
        self.next = 0
        self.lost = 0
        self._flags = np.zeros(16, np.int64)
        self._units: dict[str, str] = {}
        self._ends: dict[str, tuple[float, float, float]] = {}
        self._recent: dict[str, NDArray[np.float64]] = {}
        self._seen: deque[tuple[float, int]] = deque(maxlen=4096)

    def take(self, chunk: Chunk, step: int, now: float) -> list[str]:
        """Count a chunk; return what must be said of it."""
        said = []
        if chunk.first > self.next:
            if not self.lost:
                said.append(f"samples are lost, the first of them {self.next}")
            self.lost += chunk.first - self.next
        self.next = max(self.next, chunk.first + chunk.n)
        self.samples += chunk.n
        if np.any(chunk.flags):
            for bit in range(16):
                on = np.flatnonzero(chunk.flags & np.uint16(1 << bit))
                if on.size and not self._flags[bit]:
                    said.append(f"{_flag(bit)} from sample {chunk.first + int(on[0])} on")
                self._flags[bit] += on.size
        # numbers that a step divides, whatever the chunks: the picture does not flicker
        begin = -chunk.first % step
        for name, values in chunk.channels.items():
            self._units[name] = chunk.units[name]
            self._ends[name] = _ends(values, self._ends.get(name, (np.nan, np.nan, np.nan)))
            fresh = values[begin::step][-RECENT:]
            if fresh.size:
                before = self._recent.get(name, fresh[:0])
                self._recent[name] = np.concatenate((before, fresh))[-RECENT:]
        self._seen.append((now, self.samples))
        # two seconds of the past are enough for a rate
        while len(self._seen) > 2 and self._seen[1][0] < now - 2.0:
            self._seen.popleft()
        return said

    def state(self, name: str, total: int | None) -> StreamState:
        """Return what is known."""
        rate = 0.0
        if len(self._seen) > 1 and self._seen[-1][0] > self._seen[0][0]:
            (t0, n0), (t1, n1) = self._seen[0], self._seen[-1]
            rate = (n1 - n0) / (t1 - t0)
        channels = tuple(
            ChannelState(k, self._units[k], *self._ends[k], self._recent.get(k, np.zeros(0)))
            for k in self._units
            if k != INSTANT
        )
        flags = {_flag(k): int(self._flags[k]) for k in range(16) if self._flags[k]}
        return StreamState(name, self.samples, total, self.lost, rate, channels, flags)


def _ends(
    values: NDArray[np.float64], before: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Last, least and greatest value, not finite ones left out."""
    if not values.size:
        return before
    last, low, high = float(values[-1]), float(values.min()), float(values.max())
    if not np.isfinite(low) or not np.isfinite(high):
        finite = values[np.isfinite(values)]
        if not finite.size:
            return last, before[1], before[2]
        low, high = float(finite.min()), float(finite.max())
    return last, float(np.fmin(low, before[1])), float(np.fmax(high, before[2]))


def _flag(bit: int) -> str:
    return Flag(1 << bit).name or f"bit {bit}"
