"""What decides a voltage from a reading, once a tick."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


@runtime_checkable
class Controller(Protocol):
    """A sampled controller; it knows no limits, the guard does.

    The order is ``begin`` once, then ``decide`` and ``applied`` at every tick. What it decides may
    be any finite number: the guard goes there as far as one update allows and ``applied`` tells
    how far, so that an integral is not wound up and the memory of an inverse follows the voltage
    that the actuator really had.
    """

    def begin(self, reading: float, volts: float) -> None:
        """Start at rest: first reading, and the voltage that stands at the actuator (V)."""
        ...

    def decide(self, reading: float, reference: float) -> float:
        """Return the wanted voltage (V) at a reading and a reference, both in one unit."""
        ...

    def applied(self, volts: float) -> None:
        """Learn the voltage that holds from this tick on (V)."""
        ...
