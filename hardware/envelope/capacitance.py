"""Capacitance of the actuator over its voltage, for the current that a step needs."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.quantity import engineering
from bondgraph.support.errors import UnusableInput


@final
@dataclass(frozen=True, slots=True)
class Capacitance:
    """Capacitance over voltage, linear between points and constant beyond them.

    Parameters
    ----------
    volts : tuple of float
        Rising voltages (V), one or more.
    farads : tuple of float
        Capacitance there (F), positive. Take the large-signal value: it exceeds the small-signal
        one of a data sheet, and the current follows it.

    Raises
    ------
    UnusableInput
        If the points are not finite, not rising or not positive.

    Examples
    --------
    >>> Capacitance((0.0, 100.0), (1.5e-6, 2.0e-6)).worst(20.0, 60.0)
    1.8e-06
    """

    volts: tuple[float, ...]
    farads: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the points."""
        volts, farads = tuple(map(float, self.volts)), tuple(map(float, self.farads))
        if not volts or len(volts) != len(farads):
            raise UnusableInput(
                f"capacitance: {len(volts)} voltages and {len(farads)} values; give as many, "
                "at least one"
            )
        if not all(map(math.isfinite, volts)) or any(b <= a for a, b in pairwise(volts)):
            raise UnusableInput("capacitance: the voltages must be finite and rise; sort them")
        if not all(math.isfinite(c) and c > 0.0 for c in farads):
            raise UnusableInput("capacitance: every value must be finite and positive (F)")
        object.__setattr__(self, "volts", volts)
        object.__setattr__(self, "farads", farads)

    @classmethod
    def constant(cls, farads: float) -> Self:
        """Return a capacitance that does not depend on the voltage (F)."""
        return cls((0.0,), (farads,))

    @classmethod
    def of(
        cls, function: Callable[[float], float], v_min: float, v_max: float, points: int = 257
    ) -> Self:
        """Tabulate a function of the voltage (V to F) between two voltages.

        Between the points it is linear, so a function with a sharp peak needs enough of them.
        """
        grid = np.linspace(v_min, v_max, points)
        return cls(tuple(map(float, grid)), tuple(float(function(float(v))) for v in grid))

    @property
    def largest(self) -> float:
        """Largest value (F)."""
        return max(self.farads)

    def at(self, volts: float) -> float:
        """Return the capacitance (F) at a voltage (V)."""
        v, c = self.volts, self.farads
        k = bisect_right(v, volts)
        if k == 0 or k == len(v):
            return c[0] if k == 0 else c[-1]
        share = (volts - v[k - 1]) / (v[k] - v[k - 1])
        return c[k - 1] + share * (c[k] - c[k - 1])

    def worst(self, before: float, after: float) -> float:
        """Return the largest capacitance (F) on the way from one voltage (V) to another."""
        if len(self.farads) == 1:
            return self.farads[0]
        low, high = (before, after) if before <= after else (after, before)
        inside = self.farads[bisect_right(self.volts, low) : bisect_left(self.volts, high)]
        return max(self.at(low), self.at(high), *inside)

    def worst_of_each(
        self, before: NDArray[np.float64], after: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return `worst` of many steps, ``(n,)`` V to ``(n,)`` F."""
        v, c = np.array(self.volts), np.array(self.farads)
        low, high = np.minimum(before, after), np.maximum(before, after)
        ends = np.maximum(np.interp(low, v, c), np.interp(high, v, c))
        first, last = np.searchsorted(v, low, "right"), np.searchsorted(v, high, "left")
        crossing = last > first
        if crossing.any():
            ends[crossing] = np.maximum(
                ends[crossing], _largest_between(c, first[crossing], last[crossing])
            )
        return np.asarray(ends)

    def describe(self) -> str:
        """Return it in words."""
        low, high = min(self.farads), self.largest
        if low == high:
            return engineering(high, "F")
        return f"{engineering(low, 'F')} .. {engineering(high, 'F')} over the voltage"


def _largest_between(
    values: NDArray[np.float64], first: NDArray[np.intp], last: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return ``max(values[first:last])`` of each pair: two overlapping windows of a power of 2."""
    levels: list[Sequence[float] | NDArray[np.float64]] = [values]
    width = 1
    while 2 * width <= values.size:
        below = np.asarray(levels[-1])
        levels.append(np.maximum(below[:-width], below[width:]))
        width *= 2
    level = np.floor(np.log2(last - first)).astype(np.intp)
    result = np.empty(first.size)
    for k, largest in enumerate(levels):
        here = level == k
        window = np.asarray(largest)
        result[here] = np.maximum(window[first[here]], window[last[here] - (1 << k)])
    return result
