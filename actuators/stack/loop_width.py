"""Thickness of a hysteresis loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True, slots=True)
class HysteresisLoop:
    """Size of one closed loop of an output over an input.

    Attributes
    ----------
    thickness : float
        Largest distance between the branches at one input, in units of the output; positive if
        the falling branch lies above (the output lags).
    stroke : float
        Peak to peak of the output.
    """

    thickness: float
    stroke: float

    @property
    def percent(self) -> float:
        """Thickness in per cent of the stroke."""
        return 100.0 * self.thickness / self.stroke


def loop_of(u: ArrayLike, y: ArrayLike) -> HysteresisLoop:
    """Measure one period with one rise and one fall of the input.

    Parameters
    ----------
    u, y : array, shape (N,)
        Input and output over one period, from any sample of it on.

    Returns
    -------
    HysteresisLoop

    Raises
    ------
    UnusableInput
        If the input does not move.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.linspace(0.0, 2 * np.pi, 2001)
    >>> round(loop_of(-np.cos(t), -np.cos(t - 0.1)).thickness, 4)  # 2 sin 0.1
    0.1997
    """
    u, y = np.asarray(u, float), np.asarray(y, float)
    if u.ndim != 1 or u.shape != y.shape or u.size < 8:
        raise UnusableInput(f"loop: input {u.shape} and output {y.shape} must be one period each")
    low, high = int(np.argmin(u)), int(np.argmax(u))
    if not u[high] > u[low]:
        raise UnusableInput("loop: the input does not move; drive it up and down once")
    # the record closes on itself: go round from the lowest to the highest input and on
    round_trip = np.concatenate((np.arange(low, u.size), np.arange(low + 1)))
    top = (high - low) % u.size
    up, down = round_trip[: top + 1], round_trip[top:][::-1]
    span = u[high] - u[low]
    # at its ends an interpolated branch is no longer defined
    grid = u[low] + span * np.linspace(0.01, 0.99, 2001)
    gap = branch_at(grid, u[down], y[down]) - branch_at(grid, u[up], y[up])
    return HysteresisLoop(float(gap[np.argmax(np.abs(gap))]), float(np.ptp(y)))


def branch_at(inputs: np.ndarray, u: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the output of a branch ``y(u)`` at some inputs; noise of `u` is sorted away."""
    order = np.argsort(u, kind="stable")
    return np.asarray(np.interp(inputs, u[order], y[order]))
