"""How long an output has been beyond the levels of its envelope."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

from hardware.envelope.limits import ROUNDING, Dwell, Envelope

STALL = 0.1
"""Silence of a waveform that is one (s); it reports about every 20 ms."""


@final
class Dwelling:
    """One stopwatch for each dwell.

    Parameters
    ----------
    envelope : Envelope
    """

    __slots__ = ("_envelope", "_since")

    def __init__(self, envelope: Envelope) -> None:
        self._envelope = envelope
        self._since: list[float | None] = [None] * len(envelope.dwell)

    def moved(self, volts: float, now: float) -> None:
        """Note a voltage (V) from `now` (s) on."""
        for k, dwell in enumerate(self._envelope.dwell):
            if not self._envelope.is_beyond(dwell, volts):
                self._since[k] = None
            elif self._since[k] is None:
                self._since[k] = now

    def after_wave(self, trailing: Sequence[float | None], now: float) -> None:
        """Note the end of a waveform at `now` (s).

        Parameters
        ----------
        trailing : sequence of float or None
            For each dwell the time beyond its level at the end (s); None if all of the waveform
            was beyond it, so that the stopwatch of before goes on.
        now : float
        """
        for k, seconds in enumerate(trailing):
            if seconds is None:
                self._since[k] = now if self._since[k] is None else self._since[k]
            else:
                self._since[k] = now - seconds if seconds > 0.0 else None

    def held(self, now: float) -> tuple[float, ...]:
        """Return the times beyond each level (s); 0 where it is not."""
        return tuple(0.0 if s is None else max(now - s, 0.0) for s in self._since)

    def exceeded(self, now: float) -> tuple[Dwell, float] | None:
        """Return the first dwell that has lasted too long, and how long (s)."""
        for dwell, seconds in zip(self._envelope.dwell, self.held(now), strict=True):
            if seconds > dwell.seconds * (1.0 + ROUNDING):
                return dwell, seconds
        return None

    def stalled(self, volts: float, silence: float) -> tuple[Dwell, float] | None:
        """Return the first dwell that a waveform exceeds which stands still, and how long (s).

        Parameters
        ----------
        volts : float
            Its last sample (V).
        silence : float
            Since then (s).
        """
        for dwell in self._envelope.dwell:
            if self._envelope.is_beyond(dwell, volts) and silence > max(dwell.seconds, STALL):
                return dwell, silence
        return None
