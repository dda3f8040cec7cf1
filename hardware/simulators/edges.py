"""A voltage as a list of edges, and plants that take it so: exact inside their steps."""

from __future__ import annotations

from typing import Any, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.plant_contract import EdgeDriven, Moved, Plant


def averages(count: int, at: Array, volts: Array) -> Array:
    """Return the mean voltage of each step, ``(count,)``.

    Parameters
    ----------
    count : int
        Steps.
    at : (m,) array
        Where the voltage changes, in steps, rising, in [0, count).
    volts : (m + 1,) array
        Voltage before the first change, and after each.
    """
    if not at.size:
        return np.full(count, volts[0])
    knots = np.empty(at.size + 2)
    knots[0], knots[1:-1], knots[-1] = 0.0, at, count
    area = np.zeros(knots.size)
    np.cumsum(volts * np.diff(knots), out=area[1:])
    return np.diff(np.interp(np.arange(count + 1.0), knots, area))


def as_edges(volts: Array) -> tuple[Array, Array]:
    """Return ``(at, volts)`` of voltages that are constant in each step."""
    if not volts.size:
        return np.zeros(0), np.zeros(1)
    changes = np.flatnonzero(np.diff(volts)) + 1
    return changes.astype(np.float64), np.concatenate([volts[:1], volts[changes]])


def push(plant: Plant, count: int, at: Array, volts: Array) -> Moved:
    """Let a plant go on: with the edges themselves if it can, else with the means of the steps."""
    if isinstance(plant, EdgeDriven):
        return plant.advance_edges(count, at, volts)
    return plant.advance(averages(count, at, volts))


@final
class EdgeDelay:
    """A dead time of a voltage, exact.

    Parameters
    ----------
    steps : float
        Delay (steps), 0 or more.
    rest : float
        Voltage before the first edge.
    """

    def __init__(self, steps: float, rest: float) -> None:
        self._steps = steps
        self._in = self._out = rest
        self._at = np.zeros(0)
        self._volts = np.zeros(0)

    def pass_on(self, count: int, at: Array, volts: Array) -> tuple[Array, Array]:
        """Take edges of `count` steps in and give the late ones out."""
        if not self._steps:
            return at, volts
        fresh = np.concatenate([np.zeros(int(volts[0] != self._in)), at]) + self._steps
        levels = volts if volts[0] != self._in else volts[1:]
        self._in = float(volts[-1])
        waiting = np.concatenate([self._at, fresh])
        behind = np.concatenate([self._volts, levels])
        due = int(np.searchsorted(waiting, count, side="left"))
        out = waiting[:due], np.concatenate([[self._out], behind[:due]])
        self._out = float(out[1][-1])
        self._at, self._volts = waiting[due:] - count, behind[due:]
        return out

    def snapshot(self) -> Any:
        """Return the state."""
        return self._in, self._out, self._at, self._volts

    def restore(self, state: Any) -> None:
        """Put a state back."""
        self._in, self._out, self._at, self._volts = state
