"""Sensors and their clock: from what ideal sensors read on a fine grid to the samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.law import between

Array = NDArray[np.float64]

OVER = 8
"""Points of the fine grid between samples, where a law needs them."""


_NUMBERS: Mapping[str, Callable[[float, float, float, Sequence[float]], Mapping[str, float]]] = {
    # strength, largest reading, interval of the samples, draws
    "sensor_first_order": lambda s, a, h, d: {"time": 6 * s * h},
    "sensor_two_lags": lambda s, a, h, d: {"time": 3 * s * h},
    "sensor_dead_time": lambda s, a, h, d: {"time": 5 * s * h},
    "skew": lambda s, a, h, d: {"ratio": (1 if d[0] < 0.5 else -1) * 5e-3 * s},
    "linear_in_time": lambda s, a, h, d: {"rise": (1 if d[0] < 0.5 else -1) * s * a},
    "warming_up": lambda s, a, h, d: {"rise": s * a, "pace": between(0.04, 0.3, d[0])},
    "sensor_polynomial": lambda s, a, h, d: {
        "quadratic": (0.3 * s / a if d[0] < 0.5 else 0.0) * (1 if d[1] < 0.5 else -1),
        "cubic": s / a**2 * (0.5 if d[2] < 0.6 else -0.25),
    },
    "compression": lambda s, a, h, d: {"size": a * 0.5 / s},
    "absolute_value": lambda s, a, h, d: {},
    "weaker_side": lambda s, a, h, d: {"loss": 1.9 * s},
    "sine_error": lambda s, a, h, d: {
        "size": s * a * between(0.08, 0.4, d[0]) / 6.5,
        "pitch": a * between(0.08, 0.4, d[0]),
        "phase": 6 * d[1],
    },
    "two_harmonics": lambda s, a, h, d: {
        "size": s * a * between(0.08, 0.4, d[0]) / 14,
        "pitch": a * between(0.08, 0.4, d[0]),
        "phase": 6 * d[1],
    },
    "rounding": lambda s, a, h, d: {"unit": s * a},
    "wrong_gain": lambda s, a, h, d: {"gain": 1 + (0.4 if d[0] < 0.5 else -0.3) * s},
    "wrong_sign": lambda s, a, h, d: {},
    "swapped": lambda s, a, h, d: {},
    "wrong_unit": lambda s, a, h, d: {
        "factor": (1e3, 1e-3, 9.80665, 180 / np.pi, 100.0)[int(5 * d[0])]
    },
}

SENSOR_LAWS = tuple(_NUMBERS)
"""Laws of sensors and of their clock."""

MISREAD = ("wrong_gain", "wrong_sign", "wrong_unit", "swapped")
"""Laws that change a channel with its noise."""

_FINE = ("sensor_first_order", "sensor_two_lags", "sensor_dead_time", "skew")


def sensor_numbers(
    law: str, s: float, largest: float, step: float, draws: Sequence[float]
) -> Mapping[str, float]:
    """Return the numbers of a law of a sensor for a strength `s` between 0 and 1."""
    return _NUMBERS[law](s, largest, step, draws)


def over_for(laws: Sequence[str]) -> int:
    """Return how fine the grid must be."""
    return OVER if any(law in _FINE for law in laws) else 1


def _lag(y: Array, tau: float, h: float) -> Array:
    """Exact answer of a first-order lag to straight lines between the points."""
    from scipy.signal import lfilter

    a = np.exp(-h / tau)
    g = tau / h * (1 - a)
    out = lfilter([1 - g, g - a], [1, -a], y - y[0])
    return np.asarray(out + y[0])


def _at(y: Array, h: float, times: Array) -> Array:
    """Cubic interpolation on the fine grid; the first and last value beyond its ends."""
    from scipy.interpolate import CubicSpline

    grid = h * np.arange(len(y))
    return np.asarray(CubicSpline(grid, y)(np.clip(times, 0, grid[-1])))


def sense(law: str, p: Mapping[str, float], fine: Array, over: int, step: float) -> Array:
    """Return the samples of one sensor.

    Parameters
    ----------
    law : str
        Law of the sensor; ``""`` for an ideal one.
    p : mapping
        Its numbers.
    fine : (n * over,) array
        Ideal readings on the fine grid.
    """
    h = step / over
    y = fine[::over]
    n = len(y)
    t = np.arange(n) / n
    match law:
        case "sensor_first_order":
            return _lag(fine, p["time"], h)[::over]
        case "sensor_two_lags":
            return _lag(_lag(fine, p["time"], h), p["time"], h)[::over]
        case "sensor_dead_time":
            return _at(fine, h, np.asarray(step * np.arange(n) - p["time"]))
        case "skew":
            return _at(fine, h, np.asarray(step * np.arange(n) * (1 + p["ratio"])))
        case "linear_in_time":
            return np.asarray(y + p["rise"] * t)
        case "warming_up":
            return np.asarray(y + p["rise"] * (1 - np.exp(-t / p["pace"])))
        case "sensor_polynomial":
            return np.asarray(y + p["quadratic"] * y**2 + p["cubic"] * y**3)
        case "compression":
            return np.asarray(p["size"] * np.tanh(y / p["size"]))
        case "absolute_value":
            return np.asarray(np.abs(y))
        case "weaker_side":
            return np.asarray(np.where(y < 0, (1 - p["loss"]) * y, y))
        case "sine_error":
            angle = 2 * np.pi * y / p["pitch"] + p["phase"]
            return np.asarray(y + p["size"] * np.sin(angle))
        case "two_harmonics":
            angle = 2 * np.pi * y / p["pitch"] + p["phase"]
            return np.asarray(y + p["size"] * (np.sin(angle) + 0.7 * np.sin(2 * angle + 1)))
        case "wrong_gain":
            return np.asarray(p["gain"] * y)
        case "wrong_sign":
            return np.asarray(-y)
        case "wrong_unit":
            return np.asarray(p["factor"] * y)
        case "rounding":
            return np.asarray(p["unit"] * np.round(y / p["unit"]))
        case _:
            return np.asarray(y)
