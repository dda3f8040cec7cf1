"""The ratio of two clocks from the answer of an actuator whose dynamics nobody knows.

The length on the drive's grid is explained by the drive's recent past (a free finite response), by
plays of it (hysteresis) and by slow memories of it (creep). None of these changes along the record,
so what grows with time, in proportion to the velocity, is a wrong ratio. A constant delay is part
of the response and stays unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.support.arrays import FloatArray as Array
from hardware.synchrony.stream import LENGTH, VOLTAGE, Stream
from hardware.synchrony.time_map import TimeMap

TAPS = 64
"""Past of the drive in the response, samples."""
PLAYS = 12
SLOW = (0.01, 0.1, 1.0)
"""Time constants of the slow memories (s)."""
ECHOES = (0, 2, 5)
"""Delays of the plays, samples."""
BLOCKS = 24
ROUNDS = 4
SURE = 5.0
"""Standard errors at which a drift is taken for one."""
LEAST = 6
"""Samples of the drive for every unknown."""


@dataclass(frozen=True, slots=True)
class Skew:
    """What the answer tells of the clocks.

    Attributes
    ----------
    value, error : float
        Ratio less one at the start, and its standard deviation.
    rms : float
        What the response leaves, in the unit of the length.
    drift, drift_error : float
        Change of the ratio (1/s) and its standard deviation; both 0 unless it shows.
    """

    value: float
    error: float
    rms: float
    drift: float = 0.0
    drift_error: float = 0.0


def skew_by_response(drive: Stream, sensor: Stream, delay: float) -> Skew | None:
    """Estimate the ratio; None if the record is too short for it, or the drive does not move.

    Parameters
    ----------
    drive, sensor : Stream
    delay : float
        Of the sensor's first sample (s), roughly.
    """
    volts = drive.filled(VOLTAGE)
    usable = sensor.usable(LENGTH)
    if volts.size <= TAPS or float(np.ptp(volts)) == 0.0 or int(usable.sum()) < 4 * TAPS:
        return None
    own = CubicSpline(sensor.time[usable], sensor.channel(LENGTH)[usable])
    first, last = (float(sensor.time[usable][k]) for k in (0, -1))
    columns = _memories(volts, 1.0 / drive.rate)
    time = (drive.numbers[0] + np.arange(volts.size)) / drive.rate
    inside = (time > delay + 1.01 * first + 2.0 / sensor.rate) & (
        time < delay + 0.99 * last - 2.0 / sensor.rate
    )
    inside[:TAPS] = False
    if int(inside.sum()) < LEAST * (columns.shape[1] + 2):
        return None
    t, fixed = time[inside] - delay, columns[inside]
    basis, _ = np.linalg.qr(fixed)
    plain = _descend(own, t, basis, drifting=False)
    if t.size < LEAST * (columns.shape[1] + 3):
        return plain
    bent = _descend(own, t, basis, drifting=True)
    return bent if abs(bent.drift) > SURE * bent.drift_error else plain


def _descend(own: CubicSpline, t: Array, basis: Array, *, drifting: bool) -> Skew:
    """Gauss-Newton on skew, and drift if asked for."""
    now = np.zeros(2)
    found = Skew(0.0, np.inf, np.inf)
    for _ in range(ROUNDS):
        s = TimeMap(0.0, float(now[0]), float(now[1])).to_sensor(t)
        found = _step(own(s), np.asarray(own(s, 1)), t, basis, drifting)
        now += (found.value, found.drift)
    return Skew(float(now[0]), found.error, found.rms, float(now[1]), found.drift_error)


def _memories(volts: Array, step: float) -> Array:
    """Return what a dynamic, hysteretic and creeping actuator may answer with, ``(n, k)``."""
    u = (volts - volts.mean()) / np.ptp(volts)
    past = [np.concatenate([np.full(k, u[0]), u[:-k]]) for k in range(1, TAPS + 1)]
    radii = 0.5 * np.arange(1, PLAYS + 1) / (PLAYS + 1)
    late = past[0]
    widths = (0.0, *radii.tolist())
    played = PrandtlIshlinskii(widths, (1.0,) * len(widths)).regressors(late)[:, 1:]
    # hysteresis is followed by the mechanics: it may come later too
    plays = [np.vstack([np.repeat(played[:1], k, axis=0), played[: u.size - k]]) for k in ECHOES]
    slow = []
    for constant in SLOW:
        keep = np.exp(-step / constant)
        start = [keep * late[0]]
        slow.append(lfilter([1.0 - keep], [1.0, -keep], late, zi=start)[0])
    n = np.arange(u.size) / u.size
    return np.column_stack([np.ones(u.size), n, n**2, *past, *plays, *slow])


def _step(x: Array, velocity: Array, t: Array, basis: Array, drifting: bool) -> Skew:
    """One step of Gauss-Newton; blocks of the score give an error that correlation cannot fool."""

    def beside(a: Array) -> Array:
        return np.asarray(a - basis @ (basis.T @ a))

    late = [velocity, velocity * t] + ([0.5 * velocity * t**2] if drifting else [])
    tangents = np.column_stack([beside(a) for a in late])
    # columns of very different size: seconds and their squares
    size = np.linalg.norm(tangents, axis=0)
    tangents = tangents / size
    rest = beside(x)
    normal = tangents.T @ tangents
    change = np.linalg.solve(normal, tangents.T @ rest)
    rest = rest - tangents @ change
    scores = [
        (tangents[b] * rest[b, None]).sum(axis=0) for b in np.array_split(np.arange(t.size), BLOCKS)
    ]
    inverse = np.linalg.inv(normal)
    covariance = inverse @ (np.asarray(scores).T @ np.asarray(scores)) @ inverse
    change, error = change / size, np.sqrt(np.diag(covariance)) / size
    bend = (float(change[2]), float(error[2])) if drifting else (0.0, 0.0)
    return Skew(float(change[1]), float(error[1]), float(rest.std()), *bend)
