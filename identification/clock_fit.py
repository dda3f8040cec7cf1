"""Ratio and delay of two clocks from any drive: the time map under which a model fits best.

``x(t) = c + sum_j w_j play_(r_j)[u](t + d(t))`` is fitted to the whole record: the weights are
linear and projected out (Golub and Pereyra 1973, in Kaufman's form), the time map follows by
Gauss-Newton steps from lags found by correlation in windows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.interpolate import make_interp_spline
from scipy.linalg import qr

from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.support.errors import UnusableInput
from identification.clock import ClockMap, ratio_basis

__all__ = ["FitEstimate", "clock_from_fit"]

FloatArray = NDArray[np.float64]
Model = Callable[[FloatArray], FloatArray]

BLOCKS = 32
WINDOWS = 16
FINE_SAMPLES = 300_000
LEAST_GAIN = 1e-9
SEPARABLE = 0.3
"""Least share of a shift in time that the weights must not be able to imitate. A single sine has
0.06 to 0.2, and its fitted delay is then off by more than its interval says."""


@dataclass(frozen=True, slots=True, eq=False)
class FitEstimate:
    """Time map that makes drive and displacement agree.

    Attributes
    ----------
    clock : ClockMap
        Its delay is the fitted one if it is determined, else the fitted one plus an unknown part
        of the hysteresis' lag.
    ratio_ci95 : ndarray, shape (K, 2)
    delay_ci95 : tuple of float
        s; holds for this model of the plant.
    separability : float
        Share of a constant shift in time that the weights of the model cannot imitate, 0 to 1.
    rms : float
        Of what is left, in units of x.
    """

    clock: ClockMap
    ratio_ci95: FloatArray
    delay_ci95: tuple[float, float]
    separability: float
    rms: float

    @property
    def delay_determined(self) -> bool:
        """Whether delay and hysteresis can be told apart in this record."""
        return self.separability >= SEPARABLE

    def __str__(self) -> str:
        """Say what is determined and what is not."""
        ratios = ", ".join(
            f"{1e6 * r:.4g} [{1e6 * a:.4g}, {1e6 * b:.4g}] ppm"
            for r, (a, b) in zip(self.clock.ratio, self.ratio_ci95, strict=True)
        )
        low, high = (1e6 * v for v in self.delay_ci95)
        delay = f"delay {1e6 * self.clock.delay:.4g} [{low:.4g}, {high:.4g}] us"
        if not self.delay_determined:
            delay += " not determined: the hysteresis imitates it in this record"
        return f"ratio error {ratios}; {delay}"


def clock_from_fit(
    time: ArrayLike,
    command: ArrayLike,
    x: ArrayLike,
    *,
    knots: tuple[float, ...] = (),
    plays: int = 24,
    model: Model | None = None,
    most_lag: int = 20,
    settle: float = 0.0,
) -> FitEstimate:
    """Estimate ratio and delay for a command of any shape.

    The plant is taken as rate independent; a lag of its own counts as delay. The command is taken
    as smooth between its samples. The intervals come from the scores summed over 32 blocks, so
    that what the model leaves out, correlated as it is, widens them.

    Parameters
    ----------
    time : array, shape (N,), s
        Nominal, even, the same for drive and sensor.
    command : array, shape (N,)
        By the drive's clock.
    x : array, shape (N,)
        By the sensor's clock.
    knots : tuple of float
        Instants (s) between which the ratio is linear; none: constant.
    plays : int
        Number of plays, thresholds evenly up to half the span of the command; 0: a straight line.
        Few plays are a poor model of a smooth hysteresis and bias the delay, hardly the ratio.
    model : callable, optional
        Displacement (up to offset and gain) from a finely sampled command; in place of the plays.
    most_lag : int
        Largest misfit looked for, samples.
    settle : float
        Time at the start to leave out, s, until the memory of the plant's past is wiped out.

    Raises
    ------
    UnusableInput
        If the command is constant, the record is short, or the displacement does not follow.
    """
    t, u, y = (np.asarray(a, float) for a in (time, command, x))
    _check(t, u, y, most_lag)
    step = float(t[-1] - t[0]) / (t.size - 1)
    grid, fine, plain = _regressors(t, u, plays, model)
    fine = _orthonormal(fine, plain)
    inner = slice(max(most_lag, round(settle / step)) + 1, t.size - most_lag - 1)
    if t[inner].size < BLOCKS * (most_lag + 1):
        raise UnusableInput(f"clock: settling for {settle:g} s leaves too few samples; shorten it")
    s, z = t[inner], y[inner]
    columns = np.column_stack((np.ones(s.size), ratio_basis(s, knots)))
    found = _start(t, plain, y, most_lag, knots)
    reach = (most_lag + 0.5) * step
    best = _projected(grid, fine, s, z, columns, found)
    for _ in range(30):
        move, *_ = np.linalg.lstsq(best.jacobian, best.rest, rcond=1e-12)
        size = 1.0
        while size > 1e-3:
            trial = found + size * move
            if float(np.abs(columns @ trial).max()) < reach:
                new = _projected(grid, fine, s, z, columns, trial)
                if new.power < best.power:
                    break
            size *= 0.5
        else:
            break
        gain = 1.0 - new.power / best.power
        found, best = trial, new
        if gain < LEAST_GAIN:
            break
    spread = _spread(best.jacobian, best.rest)
    width = float(stats.t.ppf(0.975, BLOCKS - found.size)) * np.sqrt(np.diag(spread))
    return FitEstimate(
        ClockMap(tuple(found[1:].tolist()), knots if len(knots) > 1 else (), float(found[0])),
        np.column_stack((found[1:] - width[1:], found[1:] + width[1:])),
        (float(found[0] - width[0]), float(found[0] + width[0])),
        best.separability, float(np.sqrt(best.power / s.size)),
    )  # fmt: skip


def _check(t: FloatArray, u: FloatArray, y: FloatArray, most_lag: int) -> None:
    if t.ndim != 1 or t.shape != u.shape or t.shape != y.shape:
        raise UnusableInput(
            f"clock: time {t.shape}, command {u.shape} and displacement {y.shape} need one length"
        )
    if t.size < 32 * (most_lag + 1):
        raise UnusableInput(
            f"clock: {t.size} samples are too few for misfits of {most_lag} samples; record "
            f"{32 * (most_lag + 1)} or lower most_lag"
        )
    for name, values in (("command", u), ("displacement", y)):
        if not np.isfinite(values).all():
            raise UnusableInput(f"clock: the {name} holds NaN or infinity; clean it first")
        if float(np.ptp(values)) <= 1e-12 * float(np.abs(values).max(initial=0.0)):
            raise UnusableInput(
                f"clock: the {name} is constant, so nothing marks the time; drive the plant"
            )


def _regressors(
    t: FloatArray, u: FloatArray, plays: int, model: Model | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a fine grid, the columns of the model on it and those at the samples."""
    factor = max(1, min(8, FINE_SAMPLES // t.size))
    grid = np.linspace(t[0], t[-1], (t.size - 1) * factor + 1)
    smooth = np.asarray(make_interp_spline(t, u, k=3)(grid))
    if model is not None:
        fine = np.asarray(model(smooth), float).reshape(grid.size, -1)
    elif plays > 0:
        r = 0.5 * float(np.ptp(u)) * np.arange(plays + 1) / (plays + 1)
        fine = PrandtlIshlinskii(tuple(r.tolist()), (1.0,) * r.size).regressors(smooth)
    else:
        fine = smooth[:, None]
    fine = np.column_stack((np.ones(grid.size), fine))
    return grid, fine, fine[::factor]


@dataclass(frozen=True, slots=True, eq=False)
class _Projected:
    rest: FloatArray
    jacobian: FloatArray
    power: float
    separability: float


def _projected(
    grid: FloatArray,
    fine: FloatArray,
    s: FloatArray,
    z: FloatArray,
    columns: FloatArray,
    found: FloatArray,
) -> _Projected:
    """Residual and its derivative by the time map, with the weights projected out."""
    position = (s + columns @ found - grid[0]) / (grid[1] - grid[0])
    k = np.clip(np.floor(position).astype(int), 0, grid.size - 2)
    part = (position - k)[:, None]
    phi = fine[k] * (1 - part) + fine[k + 1] * part
    # the columns are orthonormal but for the small shift in time: their Gram matrix is safe
    weights = np.linalg.solve(phi.T @ phi, phi.T @ z)
    rest = z - phi @ weights
    # central differences: the slope of a broken line jumps, that of its mean does not
    after, before = np.minimum(k + 2, grid.size - 1), np.maximum(k - 1, 0)
    model = fine @ weights
    slope = (model[after] - model[before]) / (grid[after] - grid[before])
    moved = slope[:, None] * columns
    jacobian = moved - phi @ np.linalg.solve(phi.T @ phi, phi.T @ moved)
    shift = float(np.linalg.norm(moved[:, 0]))
    share = float(np.linalg.norm(jacobian[:, 0])) / shift if shift > 0 else 0.0
    return _Projected(rest, jacobian, float(rest @ rest), share)


def _orthonormal(fine: FloatArray, plain: FloatArray) -> FloatArray:
    """Mix the columns so that they are orthonormal at the samples; plays that stay are dropped."""
    scale = np.linalg.norm(plain, axis=0)
    scaled = plain / np.where(scale > 0, scale, 1.0)
    _, triangle, order = qr(scaled, mode="economic", pivoting=True)
    size = np.abs(np.diag(triangle))
    keep = int(np.count_nonzero(size > 1e-7 * size[0]))
    chosen = order[:keep]
    mix = np.linalg.inv(triangle[:keep, :keep]) / scale[chosen][:, None]
    return np.asarray(fine[:, chosen] @ mix)


def _spread(jacobian: FloatArray, rest: FloatArray) -> FloatArray:
    """Covariance of the map from the scores of blocks (residuals may be correlated)."""
    inverse = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    edges = np.linspace(0, rest.size, BLOCKS + 1).astype(int)[:-1]
    scores = np.add.reduceat(jacobian * rest[:, None], edges, axis=0)
    factor = BLOCKS / (BLOCKS - jacobian.shape[1])
    robust = inverse @ (scores.T @ scores) @ inverse * factor
    plain = inverse * float(rest @ rest) / rest.size
    larger = np.maximum(np.diag(robust), np.diag(plain)) / np.diag(robust).clip(1e-300)
    return np.asarray(robust * np.sqrt(np.outer(larger, larger)))


def _start(
    t: FloatArray,
    plain: FloatArray,
    y: FloatArray,
    most_lag: int,
    knots: tuple[float, ...],
) -> FloatArray:
    """Lags by correlation in windows, and the time map through them."""
    weights, *_ = np.linalg.lstsq(plain, y, rcond=1e-8)
    guess = plain @ weights
    if not float(np.corrcoef(guess, y)[0, 1]) >= 0.5:
        raise UnusableInput(
            "clock: the displacement does not follow the command (correlation below 0.5); check "
            "the channels, or raise most_lag"
        )
    step = (t[-1] - t[0]) / (t.size - 1)
    size = (t.size - 2 * most_lag) // WINDOWS
    first = most_lag + np.arange(WINDOWS)[:, None] * size + np.arange(size)
    lags = np.arange(-most_lag, most_lag + 1)
    wanted = y[first] - y[first].mean(axis=1, keepdims=True)
    error = np.stack([_mismatch(wanted, guess[first + lag]) for lag in lags], axis=1)
    at = np.clip(error.argmin(axis=1), 1, lags.size - 2)
    row = np.arange(WINDOWS)
    a, b, c = (error[row, at + j] for j in (-1, 0, 1))
    bend = np.where(a - 2 * b + c > 0, a - 2 * b + c, np.inf)
    shift = (lags[at] + np.clip(0.5 * (a - c) / bend, -1, 1)) * step
    middle = t[first].mean(axis=1)
    columns = np.column_stack((np.ones(WINDOWS), ratio_basis(middle, knots)))
    moving = np.sqrt(np.sum(wanted**2, axis=1))
    found, *_ = np.linalg.lstsq(columns * moving[:, None], shift * moving, rcond=None)
    return np.asarray(found)


def _mismatch(wanted: FloatArray, guess: FloatArray) -> FloatArray:
    """Sum of squares in each window, each with an offset of its own."""
    return np.asarray(np.sum((wanted - guess + guess.mean(axis=1, keepdims=True)) ** 2, axis=1))
