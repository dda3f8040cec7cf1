"""The unknowns of Kuhnen's joint fit: slopes of the plays and of the inverse dead zones.

With ``p = PI[x]`` and the inverse S' of the output stage, ``e = PI[x] - S'[y]`` is linear in the
slopes of both. All slopes have lower bounds. Scaling every slope by one factor changes e by it and
nothing else, so one normalisation is needed: the mean slope of S' over the range of y is 1. Then
p has the unit of y.

Sizes: N samples, n slopes of plays, m slopes of inverse dead zones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self, final

import numpy as np

from bondgraph.hysteresis.fitting.bounded import bounded_least_squares
from bondgraph.hysteresis.plays.dead_zone import DeadZones, dead_zone
from bondgraph.support.ops import NUMPY, FloatArray


def dead_zone_columns(stage: DeadZones, y: FloatArray) -> FloatArray:
    """Return the outputs of the single dead zones.

    Parameters
    ----------
    stage : DeadZones
        Its weights are not used.
    y : array
        Input, shape (N,).

    Returns
    -------
    array
        Shape (N, m), unit of ``y``.

    Examples
    --------
    >>> dead_zone_columns(DeadZones((-1, 0, 2), (1, 1, 1)), np.array([-3.0, 3.0])).tolist()
    [[-2.0, -3.0, 0.0], [0.0, 3.0, 1.0]]
    """
    zero = stage.zero_index
    columns = [dead_zone(NUMPY, y, d, j - zero) for j, d in enumerate(stage.thresholds)]
    return np.column_stack(columns)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Stages:
    """Which slopes are unknown, their bounds and their normalisation.

    Attributes
    ----------
    plays : array of int
        Fitted operators of the play stage, ascending, 0 first, shape (n,).
    zones : array of int
        Fitted dead zones, ascending, shape (m,).
    zone_stage : DeadZones
        All inverse dead zones; the weights are not used.
    back : array
        From slopes to weights, shape (n + m, n + m); the last m rows with the sign of e.
    lower : array
        Smallest slopes, shape (n + m,).
    mean : array
        ``mean @ slopes`` is the mean slope of S', shape (n + m,).
    """

    plays: np.ndarray
    zones: np.ndarray
    zone_stage: DeadZones
    back: FloatArray
    lower: FloatArray
    mean: FloatArray

    @classmethod
    def build(
        cls,
        plays: np.ndarray,
        zones: np.ndarray,
        zone_stage: DeadZones,
        play_bounds: FloatArray,
        zone_bound: float,
        y_range: tuple[float, float],
        *,
        prefix_sums: bool,
    ) -> Self:
        """Set up the unknowns.

        Parameters
        ----------
        plays, zones : array of int
            As the attributes.
        zone_stage : DeadZones
            All inverse dead zones.
        play_bounds : array
            Smallest slopes (or weights) of the fitted plays, shape (n,).
        zone_bound : float
            Smallest slope of S', below 1.
        y_range : tuple of float
            Smallest and largest output, 0 included.
        prefix_sums : bool
            Whether the plays are bounded in their slopes; in their weights otherwise.
        """
        n, m = plays.size, zones.size
        zero = int(np.flatnonzero(zones == zone_stage.zero_index)[0])
        outward: FloatArray = np.eye(m)
        for j in range(m):
            if j != zero:
                outward[j, j - int(np.sign(j - zero))] = -1.0
        back = np.zeros((n + m, n + m))
        back[:n, :n] = np.eye(n) - (np.eye(n, k=-1) if prefix_sums else 0.0)
        back[n:, n:] = -outward
        ends = dead_zone_columns(zone_stage, np.array(y_range))[:, zones] @ outward
        mean = np.concatenate((np.zeros(n), (ends[1] - ends[0]) / (y_range[1] - y_range[0])))
        lower = np.concatenate((play_bounds, np.full(m, zone_bound)))
        return cls(plays, zones, zone_stage, back, lower, mean)

    def weights(self, slopes: FloatArray, n_plays: int) -> tuple[FloatArray, FloatArray]:
        """Return the weights of all plays, shape (n_plays,), and of all inverse dead zones."""
        n = self.plays.size
        found = self.back @ slopes
        play_weights = np.zeros(n_plays)
        zone_weights = np.zeros(len(self.zone_stage.thresholds))
        play_weights[self.plays], zone_weights[self.zones] = found[:n], -found[n:]
        return play_weights, zone_weights

    def zone_slope(self, slopes: FloatArray, y: FloatArray) -> FloatArray:
        """Return the slope of S' at every ``y``, shape (N,)."""
        bends = [self.zone_stage.thresholds[j] for j in self.zones]
        bends.remove(0.0)
        own: FloatArray = slopes[self.plays.size :][np.searchsorted(bends, y, side="right")]
        return own

    def solve(
        self, matrix: FloatArray, target: FloatArray, weight: float
    ) -> tuple[FloatArray, np.ndarray]:
        """Return normalised slopes that minimise ``|matrix @ back @ slopes - target|^2``.

        Relative to the mean slope of S' the bounds form a cone: ``slopes = lower * mean slope +
        u`` with u >= 0. On a cone and with target 0, asking for the mean slope 1 by one more row
        and scaling the answer gives the exact constrained minimum whatever the row's weight:
        along a ray ``t^2 |A s|^2 + (t - 1)^2`` prefers the ray of least ``|A s|``.

        Parameters
        ----------
        matrix : array
            Reduced columns of the fitted plays and dead zones, shape (rows, n + m).
        target : array
            Shape (rows,).
        weight : float
            Of the normalising row, of the size of a column.

        Returns
        -------
        array
            Slopes, shape (n + m,), mean slope of S' equal to 1.
        array of bool
            Which lie on their bound, shape (n + m,).
        """
        cone = np.eye(self.lower.size) + np.outer(self.lower, self.mean) / (
            1.0 - self.mean @ self.lower
        )
        rows = np.vstack((matrix @ self.back, weight * self.mean)) @ cone
        wanted = np.append(target, weight)
        excess, on_bound = bounded_least_squares(rows, wanted, np.zeros(self.lower.size))
        slopes = cone @ excess
        return slopes / (self.mean @ slopes), on_bound
