"""Profile likelihood of one number: how the misfit rises when it is held and the rest refitted.

The profile needs nothing but an objective ``(value, start) -> (sum of squares, start)``: the sum of
squares of weighted residuals, refitted over everything else from a warm start. Steps adapt so that
each raises the sum by about a fifth of the threshold (Raue et al., Bioinformatics 25 (2009) 1923).
The threshold is the 95 % quantile of chi-square with one degree of freedom; with an estimated noise
level it is that of F(1, n) times the mean square, and a coloured residual widens it by the ratio of
the sandwich to the plain variance (Chandler and Bate, Biometrika 94 (2007) 167).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bondgraph.support.arrays import FloatArray
from identification.uncertainty.profile_shape import SHAPES as SHAPES
from identification.uncertainty.profile_shape import Side, read_shape

Refit = Callable[[float, Any], tuple[float, Any]]
"""``(held coordinate, warm start) -> (sum of squares, next warm start)``; infinite if it failed."""

TARGET = 0.2
"""Share of the threshold that a step should add."""

HILL = 0.02
"""Share of the threshold by which a point above the next one out is tried again from there."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A profile and what it says.

    Attributes
    ----------
    name, unit : str
    log : bool
        Whether the coordinate is the logarithm of the value.
    value : float
        Estimate, SI (or its own unit, for a combination).
    grid, cost : ndarray, shape (n,)
        Held values, increasing, and the sum of squares above the estimate's.
    threshold : float
        Rise at the ends of the 95 % interval.
    interval : tuple of float
        95 % interval; infinite (0 for a logarithmic one) where it is open, a bound where stopped.
    shape : str
        One of `SHAPES`.
    better : float or None
        Held value of a fit that is clearly better than the estimate, if one was met.
    drop : float
        By how much that fit lowers the sum of squares.
    status : str
        ``complete``, or why it ended early.

    Examples
    --------
    >>> from bondsight import profiles
    >>> (profile,) = profiles(fit, ["d"])
    >>> low, high = profile.interval
    >>> low < 5.1 < high
    True
    """

    name: str
    unit: str
    log: bool
    value: float
    grid: FloatArray
    cost: FloatArray
    threshold: float
    interval: tuple[float, float]
    shape: str
    better: float | None = None
    drop: float = 0.0
    status: str = "complete"

    def __str__(self) -> str:
        """One sentence."""
        low, high = self.interval
        u = f" {self.unit}" if self.unit else ""
        text = f"{self.name} = {self.value:.4g}{u}, "
        text += {
            "two-sided": f"95 % from {low:.4g} to {high:.4g}",
            "open below": f"at most {high:.4g} (95 %); {self._open('below', self.grid[0])}",
            "open above": f"at least {low:.4g} (95 %); {self._open('above', self.grid[-1])}",
            "flat": "not determined: the misfit stays the same wherever it is held",
            "multimodal": f"more than one minimum {self._within()}",
            "at a bound": f"95 % from {low:.4g} to {high:.4g}, stopped by a bound",
        }[self.shape]
        if self.better is not None:
            text += (
                f"; a better fit was found at {self.better:.4g} (sum of squares lower by "
                f"{self.drop:.3g}): start again from there"
            )
        return text if self.status == "complete" else f"{text} ({self.status})"

    def _open(self, side: str, last: float) -> str:
        if self.status == "complete":
            return f"nothing keeps it from {side}"
        return f"not followed {side} {last:.4g}"

    def _within(self) -> str:
        low, high = self.interval
        opened = (low <= 0.0 if self.log else np.isinf(low), np.isinf(high))
        if any(opened) and self.status != "complete":
            return f"between {self.grid[0]:.4g} and {self.grid[-1]:.4g}, as far as it was followed"
        return {
            (False, False): f"within {low:.4g} to {high:.4g}",
            (True, False): f"up to {high:.4g}; nothing keeps it from below",
            (False, True): f"from {low:.4g} on; nothing keeps it from above",
            (True, True): "and no end on either side",
        }[bool(opened[0]), bool(opened[1])]


def threshold_of(
    mean_square: float = 1.0, freedom: float = np.inf, inflation: float = 1.0, level: float = 0.95
) -> float:
    """Return the rise of the sum of squares at the ends of the interval.

    Parameters
    ----------
    mean_square : float
        1 if the noise level is known, else that of the weighted residuals.
    freedom : float
        Residuals less parameters; infinite if the noise level is known.
    inflation : float
        Sandwich over plain variance, at least 1.

    Examples
    --------
    >>> round(threshold_of(), 3)
    3.841
    """
    from scipy.stats import chi2, f

    quantile = chi2.ppf(level, 1) if np.isinf(freedom) else f.ppf(level, 1, freedom)
    return float(quantile * mean_square * max(inflation, 1.0))


def profile(
    refit: Refit,
    name: str,
    value: float,
    cost: float,
    start: Any,
    *,
    width: float,
    threshold: float,
    log: bool = True,
    scale: float = 1.0,
    unit: str = "",
    bounds: tuple[float, float] = (-np.inf, np.inf),
    reach: float | None = None,
    most: int = 30,
    beyond: int = 0,
) -> Profile:
    """Walk both ways from an estimate until the threshold, a bound or the reach.

    A KeyboardInterrupt keeps what is done.

    Parameters
    ----------
    refit : callable
        Takes the held coordinate: ``ln value`` if `log`, else ``value / scale``.
    value, cost : float
        Estimate (SI) and its sum of squares.
    start : object
        Warm start at the estimate, handed to `refit`.
    width : float
        Standard error in the coordinate, for the first step; any positive guess does.
    bounds : tuple of float
        SI.
    reach : float, optional
        Largest distance in the coordinate: ln 1000 if `log`, else 1000 scales.
    most : int
        Steps a side; those that lie above the next one out are refitted once more.
    beyond : int
        Further held values on each closed side, each twice as far out as the last: another valley
        behind the hill shows as ``multimodal``.
    """
    at = float(np.log(value)) if log else value / scale
    ends = [(np.log(b) if b > 0 else -np.inf) if log else b / scale for b in bounds]
    far = reach if reach is not None else (float(np.log(1000.0)) if log else 1000.0)
    points = [(at, 0.0)]
    sides: list[Side] = []
    status = "complete"
    for sign in (-1.0, 1.0):
        limit = ends[0] if sign < 0 else ends[1]
        walk = _Walk(refit, at, cost, start, sign, float(limit), far, threshold)
        found, side = walk.there_and_back(min(max(width, 1e-9), far / 2), most)
        if side.end == "closed" and beyond:
            found += walk.probe(found[-1][0], beyond)
        points += found
        sides.append(side)
        if side.end == "cancelled":
            status = "cancelled: what was done is kept"
            sides += [Side("cancelled", at)] * (2 - len(sides))
            break
        if side.end == "steps":
            status = "ended at the largest number of refits"
    points.sort()
    x = np.array([p[0] for p in points])
    rise = np.array([p[1] for p in points])
    back: Callable[[float], float] = (lambda c: float(np.exp(c))) if log else (lambda c: c * scale)
    interval, shape = read_shape(x, rise, threshold, sides)
    best = int(np.argmin(rise))
    better = float(rise[best]) < -max(0.05 * threshold, 1e-6 * abs(cost))
    ends_si = (
        interval[0] if np.isinf(interval[0]) else back(interval[0]),
        interval[1] if np.isinf(interval[1]) else back(interval[1]),
    )
    if log and np.isinf(interval[0]):
        ends_si = (0.0, ends_si[1])
    grid = np.exp(x) if log else x * scale
    return Profile(
        name, unit, log, value, grid, rise, threshold, ends_si, shape,
        back(float(x[best])) if better else None, -float(rise[best]) if better else 0.0, status,
    )  # fmt: skip


@dataclass(frozen=True)
class _Walk:
    refit: Refit
    at: float
    cost: float
    start: Any
    sign: float
    limit: float
    far: float
    threshold: float

    def there_and_back(self, step: float, most: int) -> tuple[list[tuple[float, float]], Side]:
        """Return points and how the side ended.

        Going out, a refit can stay behind in a valley of the others; where the next point out lies
        lower, it is tried again from there, so that a hill is one of the profile.
        """
        steps, side = self._out(step, most)
        way_back = range(len(steps) - 1) if side.end != "cancelled" else range(0)
        try:
            for i in reversed(way_back):
                (x, rise, _), (_, outer, warm) = steps[i], steps[i + 1]
                if rise - outer <= HILL * self.threshold:
                    continue
                total, again = self.refit(x, warm)
                if total - self.cost < rise:
                    steps[i] = (x, total - self.cost, again)
        except KeyboardInterrupt:
            side = Side("cancelled", side.reached)
        return [(x, rise) for x, rise, _ in steps], side

    def _out(self, step: float, most: int) -> tuple[list[tuple[float, float, Any]], Side]:
        """Return points with the warm start that each leaves, and how the side ended."""
        points: list[tuple[float, float, Any]] = []
        x, rise, warm = self.at, 0.0, self.start
        step *= 0.5
        try:
            for _ in range(most):
                trial, edge = self._next(x, step)
                if trial == x:
                    return points, Side("bound", x)
                total, next_warm = self.refit(trial, warm)
                new = total - self.cost
                if not np.isfinite(new) or new - rise > 1.5 * self.threshold:
                    if abs(trial - x) > 1e-8 * (1 + abs(x)) and step > 1e-9:
                        step *= 0.3
                        continue
                    return points, Side("steps", x)
                added = new - rise
                points.append((trial, new, next_warm))
                x, rise, warm = trial, new, next_warm
                if rise > self.threshold:
                    return points, Side("closed", x)
                if edge:
                    return points, Side(edge, x)
                wanted = TARGET * self.threshold
                step *= float(np.clip(np.sqrt(wanted / max(abs(added), 1e-3 * wanted)), 0.4, 3.0))
        except KeyboardInterrupt:
            return points, Side("cancelled", x)
        return points, Side("steps", x)

    def probe(self, x: float, count: int) -> list[tuple[float, float]]:
        """Return points beyond the closing one, from the estimate's warm start."""
        found = []
        for k in range(1, count + 1):
            trial = self.at + 2.0**k * (x - self.at)
            if (trial - self.limit) * self.sign >= 0 or abs(trial - self.at) > self.far:
                break
            total, _ = self.refit(trial, self.start)
            if np.isfinite(total):
                found.append((trial, total - self.cost))
        return found

    def _next(self, x: float, step: float) -> tuple[float, str]:
        trial = x + self.sign * step
        end = self.at + self.sign * self.far
        last, edge = (end, "open") if (self.limit - end) * self.sign > 0 else (self.limit, "bound")
        return (last, edge) if (trial - last) * self.sign >= 0 else (trial, "")
