"""Ratio of two clocks from a periodic drive: the phase of the answer must not drift.

A plant that does not change with time answers a periodic drive with a periodic displacement,
hysteresis or not, fast or slow: its phase over the drive is constant. Seen by another clock it
drifts by ``2 pi f d(t)``. (Creep and self-heating change the plant; leave their time out.) One
frequency gives the ratio, not the delay: a delay and the lag of the plant are both a constant
phase.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from bondgraph.support.errors import UnusableInput
from identification.clock import ClockMap, ratio_basis

__all__ = ["PhaseEstimate", "clock_from_phase", "delay_from_lags"]

FloatArray = NDArray[np.float64]
MOST_WINDOWS = 40
MOST_HARMONICS = 7


@dataclass(frozen=True, slots=True, eq=False)
class PhaseEstimate:
    """What a periodic recording says about the clocks.

    Attributes
    ----------
    clock : ClockMap
        With delay 0: the ratio is determined, the delay is not.
    ratio_ci95 : ndarray, shape (K, 2)
        For each ratio of the clock.
    frequency : float
        Of the drive, Hz.
    lag, lag_ci95 : float
        Lag of the displacement's fundamental behind the command at the start, s: lag of the plant
        less the delay of the sensor's start. Only this difference is determined.
    window_time, window_misfit, window_error : ndarray, shape (W,), s
        Middle of each window, ``d(t) - lag`` there and its standard error.
    """

    clock: ClockMap
    ratio_ci95: FloatArray
    frequency: float
    lag: float
    lag_ci95: tuple[float, float]
    window_time: FloatArray
    window_misfit: FloatArray
    window_error: FloatArray

    def __str__(self) -> str:
        """Say what is determined and what is not."""
        ratios = ", ".join(
            f"{1e6 * r:.4g} [{1e6 * a:.4g}, {1e6 * b:.4g}] ppm"
            for r, (a, b) in zip(self.clock.ratio, self.ratio_ci95, strict=True)
        )
        return (
            f"ratio error {ratios}; lag of the plant less delay {1e6 * self.lag:.4g} us: the two "
            "are one phase at one frequency and cannot be told apart here"
        )


def clock_from_phase(
    time: ArrayLike,
    command: ArrayLike,
    x: ArrayLike,
    *,
    frequency: float | None = None,
    knots: tuple[float, ...] = (),
    settle: float = 1.0,
) -> PhaseEstimate:
    """Estimate the clock ratio from the drift of the fundamental's phase.

    In each window of whole periods, least squares fits an offset and up to 7 harmonics; the
    phases, as times, are fitted by the integral of the ratio. The intervals use the scatter of the
    windows or, if larger, the noise within them.

    Parameters
    ----------
    time : array, shape (N,), s
        Nominal, even, the same for drive and sensor.
    command : array, shape (N,)
        Periodic, by the drive's clock.
    x : array, shape (N,)
        By the sensor's clock.
    frequency : float, optional
        Of the command, Hz; found if not given.
    knots : tuple of float
        Instants (s) between which the ratio is linear; none: constant.
    settle : float
        Periods at the start to leave out, where a hysteretic plant is not yet periodic.

    Raises
    ------
    UnusableInput
        If the command is constant, or there are fewer than 2 periods after settling, or too few
        for the knots.
    """
    t, u, y = (np.asarray(a, float) for a in (time, command, x))
    if t.ndim != 1 or t.shape != u.shape or t.shape != y.shape or t.size < 16:
        raise UnusableInput(
            f"clock: time {t.shape}, command {u.shape} and displacement {y.shape} need one length"
        )
    for name, values in (("command", u), ("displacement", y)):
        if not np.isfinite(values).all():
            raise UnusableInput(f"clock: the {name} holds NaN or infinity; clean it first")
        if float(np.ptp(values)) <= 1e-12 * float(np.abs(values).max(initial=0.0)):
            raise UnusableInput(
                f"clock: the {name} is constant, so nothing marks the time; drive the plant"
            )
    f = _frequency(t, u) if frequency is None else float(frequency)
    start = t[0] + settle / f
    periods = (t[-1] - start) * f
    if periods < 2.0 - 1e-6:
        raise UnusableInput(
            f"clock: {max(periods, 0.0):.3g} periods of {f:.4g} Hz after settling do not show a "
            "drift; record at least 2, better 10"
        )
    fitted, spread, at, misfit, error = _fit(t, y, f, start, knots)
    drive, drive_spread, *_ = _fit(t, u, f, start, ())
    if abs(drive[1]) > max(1e-6, 5 * math.sqrt(drive_spread[1, 1])):
        raise UnusableInput(
            f"clock: the command drifts against {f:.6g} Hz by {1e6 * drive[1]:.3g} ppm; it is not "
            "periodic, or the frequency is another; use clock_from_fit for other commands"
        )
    reach = _reach(at.size - fitted.size) * np.sqrt(np.diag(spread))
    lag = float(drive[0] - fitted[0])
    lag -= round(lag * f) / f
    wide = float(math.hypot(reach[0], _reach(at.size - 2) * math.sqrt(drive_spread[0, 0])))
    return PhaseEstimate(
        ClockMap(tuple(fitted[1:].tolist()), knots if len(knots) > 1 else ()),
        np.column_stack((fitted[1:] - reach[1:], fitted[1:] + reach[1:])),
        f, lag, (lag - wide, lag + wide), at, misfit - drive[0], error,
    )  # fmt: skip


def _reach(freedom: int) -> float:
    """Half width of a 95 % interval in standard errors."""
    return float(stats.t.ppf(0.975, freedom)) if freedom >= 1 else 12.7


def _frequency(t: FloatArray, u: FloatArray) -> float:
    """Return the frequency of the strongest line of the command, refined by its phase."""
    step = (t[-1] - t[0]) / (t.size - 1)
    spectrum = np.abs(np.fft.rfft((u - u.mean()) * np.hanning(u.size), 4 * u.size))
    guess = float(np.fft.rfftfreq(4 * u.size, step)[int(np.argmax(spectrum[1:])) + 1])
    if (t[-1] - t[0]) * guess < 2.0:
        raise UnusableInput(
            f"clock: the command holds {(t[-1] - t[0]) * guess:.3g} periods; record at least 2"
        )
    for _ in range(2):
        guess *= 1.0 + float(_fit(t, u, guess, float(t[0]), ())[0][1])
    return guess


def _fit(
    t: FloatArray, y: FloatArray, f: float, start: float, knots: tuple[float, ...]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Fit ``c + integral of eps`` to the windows; parameters, covariance, windows."""
    step = (t[-1] - t[0]) / (t.size - 1)
    first = int(np.ceil((start - t[0]) / step - 1e-9))
    each = max(1, int((t.size - 1 - first) * step * f / MOST_WINDOWS))
    size = round(each / (f * step))
    harmonics = min(MOST_HARMONICS, int(0.5 / (f * step) - 1e-9))
    if harmonics < 1 or size < 2 * harmonics + 3:
        raise UnusableInput(f"clock: {f:.4g} Hz has too few samples a period; sample faster")
    count = (t.size - first) // size
    n_p = 1 + max(1, len(knots))
    if count < n_p:
        raise UnusableInput(
            f"clock: {count} windows do not determine {n_p - 1} ratios; take fewer knots"
        )
    parts = first + np.arange(count)[:, None] * size + np.arange(size)
    middle = t[parts].mean(axis=1)
    # a drift of the sensor, by whole windows: a ramp within one would take part of the sines
    y = y - np.polyval(np.polyfit(middle, y[parts].mean(axis=1), 1), t) if count > 2 else y
    basis = np.column_stack((np.ones(count), ratio_basis(middle, knots)))
    inner = ratio_basis(t[parts], knots)
    found: FloatArray = np.zeros(n_p)
    spread: FloatArray = np.eye(n_p)
    misfit = error = np.zeros(count)
    # the phase drifts a little within a window too: follow the map found so far
    for _ in range(3):
        at = t[parts] + found[0] + inner @ found[1:]
        rest, error = _phases(at, y[parts], f, harmonics)
        misfit = basis @ found + rest
        weight = 1.0 / error
        weighted = basis * weight[:, None]
        found = np.asarray(np.linalg.lstsq(weighted, misfit * weight, rcond=None)[0], float)
        spread = np.asarray(np.linalg.inv(weighted.T @ weighted), float)
        if count > n_p:
            chi2 = float(np.sum(((misfit - basis @ found) * weight) ** 2)) / (count - n_p)
            spread = spread * max(1.0, chi2)
    return found, spread, middle, misfit, error


def _phases(
    at: FloatArray, y: FloatArray, f: float, harmonics: int
) -> tuple[FloatArray, FloatArray]:
    """Return the advance (s) of the fundamental in each window over cos(2 pi f t), and its error.

    Shapes (W, n) in, (W,) out.
    """
    angle = 2 * np.pi * f * at[:, :, None] * np.arange(1, harmonics + 1)
    columns = np.concatenate((np.cos(angle), -np.sin(angle), np.ones((*at.shape, 1))), axis=2)
    turned = columns.transpose(0, 2, 1)
    inverse = np.linalg.solve(turned @ columns, turned)
    coefficients = np.einsum("wpn,wn->wp", inverse, y)
    rest = y - np.einsum("wnp,wp->wn", columns, coefficients)
    freedom = max(at.shape[1] - columns.shape[2], 1)
    noise = np.einsum("wn,wn->w", rest, rest) / freedom
    a, b = coefficients[:, 0], coefficients[:, harmonics]
    size = np.hypot(a, b)
    # a direction along which only the phase changes
    turn = (a[:, None] * inverse[:, harmonics] - b[:, None] * inverse[:, 0]) / size[:, None]
    variance = noise.mean() * np.einsum("wn,wn->w", turn, turn) / size**2
    omega = 2 * np.pi * f
    phase = np.unwrap(np.arctan2(b, a))
    return phase / omega, np.maximum(np.sqrt(variance), 1e-14) / omega


def delay_from_lags(frequencies: ArrayLike, lags: ArrayLike) -> tuple[float, float]:
    """Tell delay and hysteresis apart by several frequencies, if the plant has no rate.

    A rate-independent plant lags by the same *phase* phi at every frequency, a delay of the sensor
    advances by the same *time*: ``lag = phi / (2 pi f) - delay``. Frequencies must share the
    amplitude and the delay (one trigger). Any rate dependence of the plant counts as delay.

    Parameters
    ----------
    frequencies : array, shape (F,), Hz
        At least 2 different ones.
    lags : array, shape (F,), s
        `PhaseEstimate.lag` of each.

    Returns
    -------
    delay : float
        s.
    phase : float
        Of the plant, rad, positive when it lags.
    """
    f, lag = np.asarray(frequencies, float), np.asarray(lags, float)
    if f.size < 2 or np.ptp(f) == 0.0:
        raise UnusableInput("delay: two different frequencies are needed")
    columns = np.column_stack((-np.ones(f.size), 1 / (2 * np.pi * f)))
    (delay, phase), *_ = np.linalg.lstsq(columns, lag, rcond=None)
    return float(delay), float(phase)
