"""From where an output is taken to stand gently to rest, before a guard may drive it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self, final

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Clock
from hardware.envelope.limits import PLAUSIBLE, Envelope
from hardware.envelope.steps import in_steps
from hardware.errors import ProtocolFault

TICK = 0.01
"""Longest time between two steps (s)."""


@final
@dataclass(frozen=True, slots=True)
class WalkToRest:
    """How an output walks to rest at power-up.

    Parameters
    ----------
    rate : float
        V/s, above 0.
    step : float, optional
        Largest change of one write (V); that of a hundredth of a second if not given.
    pause : float
        Shortest time between two writes (s).
    lowest, highest : float
        Nothing outside is written (V).

    Raises
    ------
    UnusableInput
        The rate is none: with it the walk would be a jump, or never end.
    """

    rate: float
    step: float = math.inf
    pause: float = 0.0
    lowest: float = -math.inf
    highest: float = math.inf

    def __post_init__(self) -> None:
        """Check the rate."""
        if not 0.0 < self.rate < math.inf:
            raise UnusableInput(
                f"way to rest: gentle = {self.rate!r} V/s; give a finite rate above 0"
            )

    @classmethod
    def within(cls, envelope: Envelope, rate: float = math.inf) -> Self:
        """Return the way that an envelope allows, no faster than `rate` (V/s)."""
        e = envelope
        step = e.ramp_step(e.v_min, e.v_max)
        return cls(min(rate, e.ramp_rate), step, e.update_period, e.v_min, e.v_max)

    def held(self, volts: float) -> float:
        """Return a voltage (V) cut to the limits."""
        return min(max(volts, self.lowest), self.highest)

    def allows(self, volts: float) -> bool:
        """Whether a voltage (V) may be taken for one within the limits."""
        margin = PLAUSIBLE * (self.highest - self.lowest)
        return self.lowest - margin <= volts <= self.highest + margin

    def require(self, volts: float, what: str) -> None:
        """Refuse to begin at a voltage (V) that cannot be.

        Raises
        ------
        ProtocolFault
            It lies outside the limits by more than a monitor may be off; nothing was written.
        """
        if not self.allows(volts):
            raise ProtocolFault(
                f"{what} {volts:g} V, outside the {self.lowest:g} .. {self.highest:g} V that are "
                "allowed; nothing was written: check the monitor with its scale and wire, or "
                "switch the device off and on",
                volts,
            )


def walk(
    write: Callable[[float], None],
    present: float | None,
    target: float,
    way: WalkToRest,
    clock: Clock,
) -> None:
    """Write voltages from `present` to `target` (V) in small steps.

    Parameters
    ----------
    write : callable
        Sets a voltage (V).
    present : float or None
        Where the output is; where that is not known, only `target` is written.
    target : float
        Where it is to go (V).
    way : WalkToRest
        Limits and pace.
    clock : Clock
        Time of the program.
    """
    if present is None:
        write(way.held(target))
        return
    pause, steps = in_steps(present, target, way.rate, way.step, TICK, way.pause)
    for volts in steps:
        clock.sleep(pause)
        write(way.held(volts))
