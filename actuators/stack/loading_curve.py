"""Mechanical identification of a stack: the slopes of its loading curve and what follows from them.

The slope of displacement over voltage is in m/V. The electromechanical constant is
``T = k dx/dV``, N/V (section 6.2 of the stack actuator thesis equates the two): with
k = 65 N/um a slope of 54.15 nm/V is T = 3.52 N/V.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from bondgraph.hysteresis import play_record, turning_points
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput

SEGMENTS = 50
REVERSAL = (1e-4, 1e-2)
"""Reversals of less than 8 standard deviations of noise do not count; at least and at most this
share of the voltage span."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadingCurve:
    """Displacement over slowly rising voltage.

    Attributes
    ----------
    volt : ndarray, shape (N,), V
    displacement : ndarray, shape (N,), m
    """

    volt: FloatArray
    displacement: FloatArray


@dataclass(frozen=True, slots=True)
class Slope:
    """A slope over a range of voltage, with its 95 % interval.

    Attributes
    ----------
    value, standard_error : float
        m/V.
    ci95 : tuple of float
        m/V.
    window : tuple of float
        V.
    samples : int
    """

    value: float
    standard_error: float
    ci95: tuple[float, float]
    window: tuple[float, float]
    samples: int


@dataclass(frozen=True, slots=True)
class LoadingSlopes:
    """Slopes of a loading curve.

    Attributes
    ----------
    first, last : Slope
        Least squares over all samples of the first and of the last segment.
    chord : Slope
        Line through the end points of the last segment, as the stack actuator thesis draws it.
    noise : float
        Standard deviation of the displacement about the line in the last segment, m.
    """

    first: Slope
    last: Slope
    chord: Slope
    noise: float


@dataclass(frozen=True, slots=True)
class Interval:
    """A measured number with its 95 % interval, SI."""

    value: float
    ci95: tuple[float, float]

    @classmethod
    def of(cls, value: float, error: float) -> Interval:
        """Return it from a standard error."""
        return cls(float(value), (float(value - 1.96 * error), float(value + 1.96 * error)))

    @property
    def error(self) -> float:
        """Standard error."""
        return (self.ci95[1] - self.ci95[0]) / (2.0 * 1.96)

    def widened(self, down: float, up: float = 0.0) -> Interval:
        """Return it with an interval that goes further down and up, by shares of the value."""
        low, high = self.ci95
        return Interval(self.value, (low - down * self.value, high + up * self.value))


def loading_curve(
    recording: Recording, volt: str = "V_in", displacement: str = "x"
) -> LoadingCurve:
    """Return the largest rise of the voltage in a recording, the last one of equals.

    Parameters
    ----------
    recording : Recording
        May begin with a demagnetisation.
    volt, displacement : str
        Channel names.

    Raises
    ------
    UnusableInput
        If the voltage never rises.
    """
    u = np.asarray(recording[volt])
    span = float(np.ptp(u))
    if span == 0.0:
        raise UnusableInput(
            f"{recording.name}: {volt} is constant; a loading curve needs a slow rise"
        )
    noise = (
        float(np.median(np.abs(np.diff(u, 2)))) / (0.6745 * math.sqrt(6.0)) if u.size > 2 else 0.0
    )
    reversal = min(max(8 * noise, REVERSAL[0] * span), REVERSAL[1] * span)
    rises = largest_rises(u, reversal)
    if not rises:
        raise UnusableInput(f"{recording.name}: {volt} never rises; record the loading upwards")
    return LoadingCurve(u[rises[-1]], np.asarray(recording[displacement])[rises[-1]])


def largest_rises(u: FloatArray, reversal: float) -> list[slice]:
    """Return the samples of the largest rises of a voltage, nearly equal ones in their order.

    Parameters
    ----------
    u : ndarray, shape (N,), V
    reversal : float
        Half of what turns back without being a turning point, V.

    Examples
    --------
    >>> largest_rises(np.array([0.0, 2.0, 1.0, 1.5, 0.0, 2.0]), 0.1)
    [slice(0, 2, None), slice(4, 6, None)]
    """
    turns = turning_points(play_record(u, np.array([reversal]), u[:1])[:, 0])
    rises = np.diff(u[turns])
    if rises.max(initial=0.0) <= 0.0:
        return []
    largest = np.flatnonzero(rises >= (1 - 2 * REVERSAL[1]) * rises.max())
    return [slice(int(turns[k]), int(turns[k + 1]) + 1) for k in largest]


def loading_slopes(
    volt: ArrayLike | LoadingCurve, displacement: ArrayLike | None = None, segments: int = SEGMENTS
) -> LoadingSlopes:
    """Return the slopes at both ends of a loading curve.

    The voltage axis is cut into equal segments. Over the n samples of a segment of width U, least
    squares has the standard error ``s sqrt(12 / n) / U`` with noise s, the line through two points
    ``s sqrt(2) / U``. The noise is estimated from the residuals; its correlation from sample to
    sample widens the interval by ``(1 + rho) / (1 - rho)`` in the variance.

    Parameters
    ----------
    volt : array, shape (N,), V, or LoadingCurve
        Rising.
    displacement : array, shape (N,), m
    segments : int
        At least 2.

    Raises
    ------
    UnusableInput
        If a segment holds fewer than 5 samples, or one value of the voltage.
    """
    if not isinstance(volt, LoadingCurve):
        if displacement is None:
            raise UnusableInput("loading slopes: give the displacement beside the voltage")
        volt = LoadingCurve(np.asarray(volt, float), np.asarray(displacement, float))
    u, x = volt.volt, volt.displacement
    if u.ndim != 1 or u.shape != x.shape or not (np.isfinite(u).all() and np.isfinite(x).all()):
        raise UnusableInput(
            f"loading slopes: voltage {u.shape} and displacement {x.shape} must be finite and of "
            "one length"
        )
    if segments < 2 or u.size < 2 or not u.max() > u.min():
        raise UnusableInput("loading slopes: the voltage must rise and be cut into 2 or more parts")
    edges = np.linspace(float(u.min()), float(u.max()), segments + 1)
    first, _, _ = _least_squares(u, x, edges[0], edges[1], segments)
    last, noise, at = _least_squares(u, x, edges[-2], edges[-1], segments)
    error = math.sqrt(2.0) * noise / (edges[-1] - edges[-2])
    rise = np.interp(edges[-2:], u[_sorted(u)], x[_sorted(u)])
    value = float((rise[1] - rise[0]) / (edges[-1] - edges[-2]))
    reach = float(stats.t.ppf(0.975, at - 2)) * error
    chord = Slope(value, error, (value - reach, value + reach), last.window, 2)
    return LoadingSlopes(first, last, chord, noise)


def whole_slope(curve: LoadingCurve) -> Slope:
    """Return the slope of the line through a whole loading curve, m/V.

    Examples
    --------
    >>> u = np.linspace(0.0, 100.0, 500)
    >>> round(1e9 * whole_slope(LoadingCurve(u, 54e-9 * u)).value, 6)
    54.0
    """
    u = curve.volt
    return _least_squares(u, curve.displacement, float(u.min()), float(u.max()), 1)[0]


def _sorted(u: FloatArray) -> NDArray[np.intp]:
    return np.asarray(np.argsort(u, kind="stable"))


def _least_squares(
    u: FloatArray, x: FloatArray, low: float, high: float, segments: int
) -> tuple[Slope, float, int]:
    """Slope, noise and number of samples within a window of the voltage."""
    inside = np.flatnonzero((u >= low) & (u <= high))
    n = inside.size
    if n < 5:
        raise UnusableInput(
            f"loading slopes: {n} samples between {low:.4g} and {high:.4g} V, at least 5 are "
            f"needed; take fewer than {segments} segments or sample faster"
        )
    v, y = u[inside] - u[inside].mean(), x[inside] - x[inside].mean()
    squares = float(v @ v)
    if not np.ptp(u[inside]) > 0.0:
        raise UnusableInput(
            f"loading slopes: the voltage has one value, {u[inside][0]:.4g} V, over {n} samples "
            f"between {low:.4g} and {high:.4g} V, so there is no slope; record the whole rise"
        )
    value = float(v @ y) / squares
    rest = y - value * v
    noise = math.sqrt(float(rest @ rest) / (n - 2))
    power = float(rest @ rest)
    rho = float(rest[1:] @ rest[:-1]) / power if power > 0.0 else 0.0
    rho = min(max(rho, 0.0), 0.99)
    error = noise / math.sqrt(squares) * math.sqrt((1 + rho) / (1 - rho))
    reach = float(stats.t.ppf(0.975, max(n * (1 - rho) / (1 + rho) - 2, 1.0))) * error
    return Slope(value, error, (value - reach, value + reach), (low, high), n), noise, n


def transducer_constant(slope: Slope, stiffness: float, stiffness_error: float = 0.0) -> Interval:
    """Return ``T = k dx/dV``, N/V.

    It takes the whole voltage to act on the transducer; where a hysteretic store still takes the
    share ``dV_h/dV`` at the end of the curve, T comes out too small by that share.

    Parameters
    ----------
    slope : Slope
        Of the loading curve, m/V.
    stiffness : float
        Short-circuit stiffness k, N/m.
    stiffness_error : float
        Its standard error, N/m.

    Raises
    ------
    UnusableInput
        If the stiffness is not positive.

    Examples
    --------
    >>> slope = Slope(54.15e-9, 0.0, (54.15e-9, 54.15e-9), (98.0, 100.0), 625)
    >>> round(transducer_constant(slope, 65e6).value, 2)
    3.52
    """
    if not stiffness > 0.0:
        raise UnusableInput(f"transducer constant: stiffness = {stiffness} N/m must be positive")
    value = stiffness * slope.value
    half = 0.5 * stiffness * (slope.ci95[1] - slope.ci95[0])
    reach = math.hypot(half, 1.96 * stiffness_error * slope.value)
    return Interval(value, (value - reach, value + reach))
