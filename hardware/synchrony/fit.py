"""Time map and lag under which held columns explain a record best.

``y(t_n) = offsets + sum_j c_j L_lag[hold b_j](s(t_n))``: the coefficients are linear and projected
out (Golub and Pereyra 1973, in Kaufman's form); map and lag follow by damped Gauss-Newton steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.descent import Damping, Trial, descend
from bondgraph.support.errors import UnusableInput
from hardware.synchrony.held import Shape
from hardware.synchrony.time_map import TimeMap

LEAST_GAIN = 1e-8
LEAST_LAG = 1e-3
"""Of a step of the drive: less is no lag."""


@dataclass(frozen=True, slots=True, eq=False)
class AlignmentData:
    """What is fitted.

    Parameters
    ----------
    held : Shape
        Columns over the drive's time; its lag is the start if it is free.
    time : ndarray
        (n,), sensor times (s).
    values : ndarray
        (n,).
    trend : ndarray
        (n, q), columns over the sensor's time that are no drive: at least the offset.
    free : tuple of str
        Which numbers of the map, and ``lag``, are fitted.
    beliefs : tuple of (str, float, float)
        Name, value and standard deviation of what is known beforehand of some of them.
    """

    held: Shape
    time: Array
    values: Array
    trend: Array
    free: tuple[str, ...] = ("delay", "skew")
    beliefs: tuple[tuple[str, float, float], ...] = ()

    def part(self, chosen: slice | NDArray[np.bool_]) -> AlignmentData:
        """Return the same with some of the samples."""
        return replace(
            self, time=self.time[chosen], values=self.values[chosen], trend=self.trend[chosen]
        )


@dataclass(frozen=True, slots=True)
class TimeMapGuess:
    """A time map and a lag (s)."""

    map: TimeMap
    lag: float = 0.0

    def value(self, name: str) -> float:
        """Return the lag, or a number of the map."""
        if name == "lag":
            return self.lag
        return float(self.map.numbers[self.map.names.index(name)])

    def moved(self, free: tuple[str, ...], by: Array, least_lag: float) -> TimeMapGuess:
        """Return the guess after a step; the lag stays positive."""
        steps = {n: float(d) for n, d in zip(free, by, strict=True)}
        lag = max(self.lag + steps.pop("lag", 0.0), least_lag if "lag" in free else 0.0)
        return TimeMapGuess(self.map.moved(steps), lag)


@dataclass(frozen=True, slots=True, eq=False)
class FittedTimeMap:
    """Where the steps ended.

    Attributes
    ----------
    guess : TimeMapGuess
    rest : ndarray
        (n,), what is left.
    jacobian : ndarray
        (n, p), derivative of the model by the free numbers, the coefficients projected out.
    slope : ndarray
        (n,), derivative of the model by the drive's time.
    coefficients : ndarray
        (K + q,), of columns and trend.
    share : float
        Share of a shift in time that the coefficients cannot imitate, 0 to 1.
    power : float
        Sum of squares of the rest and of the disbeliefs.
    """

    guess: TimeMapGuess
    rest: Array
    jacobian: Array
    slope: Array
    coefficients: Array
    share: float
    power: float

    @property
    def cost(self) -> float:
        """What is lowered."""
        return self.power

    @property
    def rms(self) -> float:
        """Of what is left."""
        return float(np.sqrt(np.mean(self.rest**2)))


def fit(
    material: AlignmentData,
    start: TimeMapGuess,
    noise: float | None = None,
    steps: int = 40,
    most: float = 0.5,
) -> FittedTimeMap:
    """Descend from a start that is right to a fraction of what the drive resolves.

    Parameters
    ----------
    material : AlignmentData
    start : TimeMapGuess
    noise : float, optional
        Standard deviation of the values, against which beliefs are weighed; by default what is
        left at each step.
    steps : int
        At most.
    most : float
        Largest move in time of any sample at once, in steps of the drive.

    Raises
    ------
    UnusableInput
        If the values are fewer than the unknowns.
    """
    if material.time.size < 4 * (material.held.count + material.trend.shape[1] + 4):
        raise UnusableInput(
            f"clock: {material.time.size} usable samples are too few; record longer"
        )
    least, longest = LEAST_LAG * material.held.step, most * material.held.step

    def steps_from(at: FittedTimeMap) -> Trial[FittedTimeMap]:
        h, gradient = _normal(material, at, noise)
        scale = np.diag(h)

        def trial(damping: float, number: int) -> FittedTimeMap:
            damped = h + np.diag(damping * scale + 1e-300)
            move = np.asarray(np.linalg.lstsq(damped, gradient, rcond=1e-14)[0], float)
            far = _farthest(material, at.guess.map, move)
            move = move * (longest / far) if far > longest else move
            return _projected(material, at.guess.moved(material.free, move, least), noise)

        return trial

    return descend(
        _projected(material, start, noise), steps_from, DAMPING, steps,
        lambda before, at: not before.power - at.power >= LEAST_GAIN * before.power > 0.0,
    ).at  # fmt: skip


DAMPING = Damping(start=1e-6, less=10.0, more=10.0, tries=12)


def _farthest(material: AlignmentData, now: TimeMap, move: Array) -> float:
    """Return how far a step moves a sample in time at most (s)."""
    t = material.time[[0, material.time.size // 2, -1]]
    steps = dict(zip(material.free, move, strict=True))
    lag = abs(float(steps.pop("lag", 0.0)))
    by = now.columns(t) @ np.array([steps.get(n, 0.0) for n in now.names])
    return lag + float(np.abs(by).max())


def _projected(material: AlignmentData, guess: TimeMapGuess, noise: float | None) -> FittedTimeMap:
    held = material.held.with_lag(guess.lag)
    t, y = material.time, material.values
    at = guess.map.to_drive(t)
    columns, slopes = held.at(at)
    a = np.column_stack([columns, material.trend])
    size = np.sqrt(np.einsum("ij,ij->j", a, a))
    size[size == 0.0] = 1.0
    a = a / size
    gram = np.linalg.pinv(a.T @ a, rcond=1e-12, hermitian=True)
    c = gram @ (a.T @ y)
    rest = y - a @ c
    c += gram @ (a.T @ rest)  # once more: the Gram matrix squares the rounding
    rest = y - a @ c
    weights = (c / size)[: columns.shape[1]]
    slope = slopes @ weights
    by = dict(zip(guess.map.names, slope * guess.map.columns(t).T, strict=True))
    if "lag" in material.free:
        little = max(1e-3 * guess.lag, 1e-5 * held.step)
        more, _ = held.with_lag(guess.lag + little).at(at)
        by["lag"] = (more - columns) @ weights / little
    moved = np.column_stack([by[name] for name in material.free])
    jacobian = moved - a @ (gram @ (a.T @ moved))
    reach = float(np.linalg.norm(moved[:, 0]))
    share = float(np.linalg.norm(jacobian[:, 0])) / reach if reach > 0.0 else 0.0
    power = float(rest @ rest)
    variance = power / rest.size if noise is None else noise**2
    power += variance * sum(
        ((guess.value(n) - value) / sd) ** 2 for n, value, sd in material.beliefs
    )
    return FittedTimeMap(guess, rest, jacobian, slope, c / size, share, power)


def _normal(
    material: AlignmentData, now: FittedTimeMap, noise: float | None
) -> tuple[Array, Array]:
    """Return the matrix and the right side of a step."""
    j = now.jacobian
    variance = float(now.rest @ now.rest) / now.rest.size if noise is None else noise**2
    h, gradient = j.T @ j, j.T @ now.rest
    for name, value, sd in material.beliefs:
        k = material.free.index(name)
        h[k, k] += variance / sd**2
        gradient[k] += variance * (value - now.guess.value(name)) / sd**2
    return h, gradient
