"""How much false loop width a misfit of clocks makes, and how much is allowed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from bondgraph.support.errors import UnusableInput
from hardware.errors import ClockSkewError
from hardware.synchrony.alignment import Alignment


def false_width(stroke: float, frequency: float, misfit: float) -> float:
    """Return the width that a misfit of time alone gives to the loop of a sine (unit of stroke).

    ``x = (X/2) sin w(t + d)`` over ``sin wt`` crosses the middle of the input at
    ``+- (X/2) sin(w d)``.

    Parameters
    ----------
    stroke : float
        X, peak to peak.
    frequency : float
        Hz.
    misfit : float
        d (s): delay, or skew times the time since the start.

    Examples
    --------
    One sample of 320 us at 2 Hz on 4.4 um, in nm:

    >>> round(1e9 * false_width(4.4e-6, 2.0, 320e-6), 1)
    17.7
    """
    return stroke * abs(math.sin(2.0 * math.pi * frequency * misfit))


@dataclass(frozen=True, slots=True)
class Budget:
    """What is allowed to remain after alignment, at 95 %.

    Parameters
    ----------
    seconds : float, optional
        Misfit of time anywhere in the record (s).
    width : float, optional
        False loop width (m); needs `stroke` and `frequency`.
    stroke : float
        Peak to peak (m).
    frequency : float
        Highest that matters (Hz).
    excess : {"raise", "mark"}
        Raise `ClockSkewError`, or only note it in the alignment (its samples are flagged).

    Raises
    ------
    UnusableInput
        If nothing is allowed for, or stroke and frequency are missing.
    """

    seconds: float | None = None
    width: float | None = None
    stroke: float = 0.0
    frequency: float = 0.0
    excess: Literal["raise", "mark"] = "raise"

    def __post_init__(self) -> None:
        """Check the numbers."""
        if self.seconds is None and self.width is None:
            raise UnusableInput("budget: give seconds or width")
        if self.width is not None and not (self.stroke > 0.0 and self.frequency > 0.0):
            raise UnusableInput("budget: a width needs the stroke (m) and the frequency (Hz)")
        if any(v is not None and not v > 0.0 for v in (self.seconds, self.width)):
            raise UnusableInput("budget: seconds and width must be positive")

    @property
    def allowed(self) -> float:
        """Largest misfit of time (s) that keeps all of it."""
        limits = [] if self.seconds is None else [self.seconds]
        if self.width is not None:
            sine = min(self.width / self.stroke, 1.0)
            limits.append(math.asin(sine) / (2.0 * math.pi * self.frequency))
        return min(limits)


def checked(alignment: Alignment, budget: Budget) -> Alignment:
    """Return the alignment if it keeps the budget, else raise, or mark it.

    An unknown delay is no skew: its samples are flagged anyway, and only what the clocks run apart
    within the record is held against the budget.

    Raises
    ------
    ClockSkewError
        With the alignment as `partial`.
    """
    worst = alignment.worst if alignment.delay_known else alignment.skew_over_record
    if worst <= budget.allowed:
        return alignment
    what = f"clocks are known to {1e6 * worst:.3g} us only, {1e6 * budget.allowed:.3g} us allowed"
    if budget.width is not None:
        made = false_width(budget.stroke, budget.frequency, min(worst, 0.25 / budget.frequency))
        what += f"; that makes {1e9 * made:.3g} nm of loop width at {budget.frequency:g} Hz"
    if budget.excess == "raise":
        raise ClockSkewError(
            f"{what}; share the sample clock, record a copy of the voltage, or record longer",
            alignment,
        )
    return replace(alignment, over_budget=True, notes=(*alignment.notes, what))
