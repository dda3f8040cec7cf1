"""What plays waveforms without protection."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol, runtime_checkable

from bondgraph.support.arrays import FloatArray as Array
from hardware.contracts import WaveProgress


@runtime_checkable
class RawWave(Protocol):
    """A player of waveforms without protection, on the same device as a raw output.

    Give it an attribute ``position``, how many samples were really put out, valid after `abort`.
    Without it a waveform that is broken off leaves the output unknown: it is looked for by its
    read-back or, if the device has none, powered up anew. One that goes on while nobody iterates
    tells it at any time, or None if it cannot: a waveform that stands still beyond the level of a
    dwell is ended. One that may run faster than asked to catch up after a stall says how much in
    an attribute ``haste`` (1.1: a tenth).
    """

    def load(self, volts: Array, rate: float) -> None:
        """Transfer a waveform (V at the actuator, (n,)) and its rate (Hz); nothing moves."""
        ...

    def play(self) -> Iterator[WaveProgress]:
        """Play what was loaded; yields about every 20 ms, and at the end."""
        ...

    def abort(self) -> None:
        """End playing at once: no further sample is put out. Never raises."""
        ...
