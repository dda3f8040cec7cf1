"""Gain and offset of an amplifier from measured pairs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.errors import UnusableInput
from hardware.devices.amplifier.data import Amplifier, Monitors


@dataclass(frozen=True, slots=True)
class CalibrationLine:
    """A straight line through measured pairs, ``y = slope x + intercept``.

    Parameters
    ----------
    slope, intercept : float
        Least squares.
    u_slope, u_intercept : float
        Standard uncertainties, from the scatter about the line.
    covariance : float
        Of the two.
    scatter : float
        Standard deviation about the line, in units of y.
    n : int
        Number of pairs.
    """

    slope: float
    intercept: float
    u_slope: float
    u_intercept: float
    covariance: float
    scatter: float
    n: int


def fit_line(x: ArrayLike, y: ArrayLike) -> CalibrationLine:
    """Fit a line to at least three pairs.

    Parameters
    ----------
    x, y : (n,) array_like
        What was set or taken as exact, and what was measured.

    Raises
    ------
    UnusableInput
        Too few pairs, no spread, or numbers that are none.
    """
    u, v = np.asarray(x, float), np.asarray(y, float)
    if u.ndim != 1 or u.shape != v.shape or u.size < 3:
        raise UnusableInput(
            f"calibration: {u.shape} and {v.shape} are not at least three pairs; measure more"
        )
    if not (np.isfinite(u).all() and np.isfinite(v).all()):
        raise UnusableInput("calibration: a pair holds NaN or inf; leave it out")
    centre = float(u.mean())
    spread = float(((u - centre) ** 2).sum())
    if spread <= 1e-24 * max(float((u * u).sum()), 1e-300):
        raise UnusableInput("calibration: all pairs have one and the same x; spread them")
    slope = float(((u - centre) * v).sum() / spread)
    level = float(v.mean())
    residual = v - level - slope * (u - centre)
    variance = float((residual**2).sum()) / (u.size - 2)
    return CalibrationLine(
        slope=slope,
        intercept=level - slope * centre,
        u_slope=math.sqrt(variance / spread),
        u_intercept=math.sqrt(variance * (1.0 / u.size + centre**2 / spread)),
        covariance=-centre * variance / spread,
        scatter=math.sqrt(variance),
        n=u.size,
    )


def calibrated(amplifier: Amplifier, converter: ArrayLike, actuator: ArrayLike) -> Amplifier:
    """Return the amplifier with gain and offset from measured pairs.

    Parameters
    ----------
    converter : (n,) array_like
        Voltages set at the converter (V).
    actuator : (n,) array_like
        Voltages measured at the actuator (V), by an instrument that is better than the monitor.
    """
    line = fit_line(converter, actuator)
    return replace(
        amplifier,
        gain=line.slope,
        offset=line.intercept,
        u_gain=line.u_slope,
        u_offset=line.u_intercept,
        source=f"{line.n} measured pairs, {line.scatter:.2g} V about the line",
    )


def monitor_calibrated(monitors: Monitors, actuator: ArrayLike, monitor: ArrayLike) -> Monitors:
    """Return the monitors with the scale of the voltage from measured pairs.

    Parameters
    ----------
    actuator : (n,) array_like
        Voltages measured at the actuator (V).
    monitor : (n,) array_like
        Voltages read at the monitor input (V).
    """
    line = fit_line(actuator, monitor)
    return replace(monitors, voltage=line.slope, voltage_offset=line.intercept)
