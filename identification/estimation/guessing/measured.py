"""Frequency response of a record without a model, at few well-spread lines, with its errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.signals.split import whole
from bondgraph.support.arrays import ComplexArray, IntArray
from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from identification.experiments.frequency.bla import response_of_periods
from identification.experiments.frequency.local import local_fit
from identification.experiments.frequency.periods import cut
from identification.study.problem import Problem

Found: TypeAlias = tuple[Array, ComplexArray, Array]
EXCITED = 1e-3
LEAST = 3
EXCITED_STEP = 0.1
LEAKAGE = 0.2
"""Relative error of a ratio of spectra without a correction for what the record begins with."""
AWAY = 0.5
"""Part of its range by which a reading ends away from where it began, if it runs away."""
TOP = 0.8
"""Lines up to this share of the Nyquist rate: beyond, the samples tell little of the commands."""
WORST = 0.7
"""Entries with a larger relative standard deviation say nothing."""
MODEL_ERROR = 0.05
"""Relative error granted to every entry: the response need not be met better than that."""


@dataclass(frozen=True, eq=False)
class Measured:
    """Response at F lines.

    Attributes
    ----------
    omega : ndarray, shape (F,), rad/s
    inputs : ndarray of int, shape (n_m,)
        Columns of the model's inputs that move.
    logarithm : ndarray, shape (F, n_y, n_m), complex
        Of the response.
    weight : ndarray, shape (F, n_y, n_m)
        One over the standard deviation of the logarithm; zero where it says nothing.
    """

    omega: Array
    inputs: IntArray
    logarithm: ComplexArray
    weight: Array

    @property
    def count(self) -> int:
        """Number of entries that say something."""
        return int(np.sum(self.weight > 0.0))


def measured_response(problem: Problem, points: int = 60) -> Measured | None:
    """Measure the response in the training samples; None where they do not tell it.

    Periodic records by whole periods, others by local polynomials with transients, so that
    neither leakage nor an integrating plant that drifts away does harm.
    """
    data = problem.data
    train = whole(data.split.train)
    stop = train.stop or data.n
    # what comes before training is not scored, but a step there is what the readings answer to
    held = data.mask("test")
    train = slice((train.start or 0) if held[:stop].any() else 0, stop)
    moving = [n for n, v in data.commands.items() if np.ptp(v[train]) > 0.0]
    if not moving or train.stop - train.start < 64:
        return None
    columns = problem.dynamics.inputs(
        {n: np.full(2, float(i + 1)) for i, n in enumerate(data.commands)}, np.arange(2.0)
    )[0]
    order = list(data.commands)
    at = np.array([int(np.flatnonzero(columns == order.index(n) + 1)[0]) for n in moving])
    u = np.stack([data.commands[n][train] for n in moving], axis=1)
    y = data.readings[train]
    found = _periodic(u, y, data.dt, data.names, points)
    if found is not None and (made := _judged(found, data.dt, at)).count >= LEAST:
        return made
    # what runs away (an angle that turns on) leaks into every line; its differences do not
    gone = np.abs(y[-1] - y[0]) > AWAY * np.ptp(y, axis=0)
    steps = int(gone.any())
    smooth = _arbitrary(np.diff(u, steps, axis=0), np.diff(y, steps, axis=0), points)
    others = (smooth, _differenced(u, y, data.floor, points))
    judged = [_judged(f, data.dt, at) for f in others if f is not None]
    # a step looks like a transient, so that a local polynomial cannot tell them apart
    judged = [m for m in judged if m.count >= LEAST]
    return max(judged, key=lambda m: float(np.sum(m.weight**2)), default=None)


def _judged(found: Found, dt: float, at: IntArray) -> Measured:
    """Weigh the entries by their errors."""
    angle, response, deviation = found
    size = np.abs(response)
    relative = deviation / np.maximum(size, 1e-300)
    good = np.isfinite(relative) & (relative < WORST) & (size > 0.0)
    # a command that is straight between samples is weaker by sinc^2, which small motions leave out
    granted = np.hypot(MODEL_ERROR, angle**2 / 12.0)[:, None, None]
    weight = np.where(good, 1.0 / np.hypot(relative, granted), 0.0)
    logarithm = np.log(np.where(good, response, 1.0).astype(complex))
    return Measured(angle / dt, at, logarithm, weight)


def _periodic(u: Array, y: Array, dt: float, names: tuple[str, ...], points: int) -> Found | None:
    inputs = [f"u{j}" for j in range(u.shape[1])]
    outputs = [f"y{j}" for j in range(len(names))]
    channels = dict(zip((*inputs, *outputs), (*u.T, *y.T), strict=True))
    time = np.asarray(np.arange(u.shape[0]) * dt, np.float64)
    record = Recording("record", time, channels, dict.fromkeys(channels, "1"))
    try:
        response = response_of_periods([cut(record, inputs[0], outputs)], inputs, outputs)
    except UnusableInput:
        return None
    if response.frequency.size < 3:
        return None
    variance = np.fmax(response.noise_variance, 0.0)
    if np.isnan(variance).all():
        variance = response.total_variance
    if np.isnan(variance).all():
        variance = np.zeros_like(variance)
    angle = 2.0 * np.pi * response.frequency * dt
    kept = _spread(angle, points)
    return angle[kept], response.response[kept], np.sqrt(np.nan_to_num(variance[kept], nan=np.inf))


def _arbitrary(u: Array, y: Array, points: int) -> Found | None:
    n = u.shape[0]
    spectrum_u, spectrum_y = np.fft.rfft(u, axis=0), np.fft.rfft(y, axis=0)
    size = np.abs(spectrum_u[1:])
    excited = (size > EXCITED * size.max(axis=0)).all(axis=1)
    lines = np.flatnonzero(np.concatenate([[False], excited]))
    lines = lines[lines < TOP * n / 2]
    if lines.size < 8:
        return None
    dense = np.arange(lines[0], lines[-1] + 1)
    within = lines if lines.size < 0.5 * dense.size else dense
    for order in (2, 1):
        for used in (within,) if within is lines else (dense, lines):
            angle = 2.0 * np.pi * used / n
            kept = _spread(angle, points)
            try:
                fit = local_fit(
                    spectrum_u[None, used], spectrum_y[None, used], used, kept, order=order
                )
            except UnusableInput:
                continue
            variance = fit.variance[:, :, None] * fit.factor[:, None, :]
            return angle[kept], fit.response, np.sqrt(variance)
    return None


def _differenced(u: Array, y: Array, floor: Array, points: int) -> Found | None:
    """Ratio of the spectra of the differences: for a step or a pulse that dies away."""
    n = u.shape[0] - 1
    if u.shape[1] > 1:
        return None
    spectrum_u = np.fft.rfft(np.diff(u[:, 0]))
    spectrum_y = np.fft.rfft(np.diff(y, axis=0), axis=0)
    size = np.abs(spectrum_u)
    # the mean of a difference is where it ended; below the first lines leakage hides
    lines = np.flatnonzero(size > EXCITED_STEP * size.max())
    lines = lines[(lines > 0) & (lines < TOP * n / 2)]
    if lines.size < 3:
        return None
    angle = 2.0 * np.pi * lines / n
    kept = _spread(angle, points)
    noise = np.sqrt(n) * floor * np.abs(1.0 - np.exp(-1j * angle[kept]))[:, None]
    drive = spectrum_u[lines[kept], None]
    response = spectrum_y[lines[kept]] / drive
    deviation = np.hypot(noise / np.abs(drive), LEAKAGE * np.abs(response))
    return angle[kept], response[:, :, None], deviation[:, :, None]


def _spread(angle: Array, points: int) -> IntArray:
    """Pick lines: half of them evenly, half of them evenly in the logarithm."""
    kept = np.flatnonzero((angle > 0.0) & (angle < TOP * np.pi))
    kept = kept if kept.size else np.arange(angle.size)
    even = np.linspace(angle[kept[0]], angle[kept[-1]], points // 2)
    logs = np.geomspace(max(angle[kept[0]], 1e-12), angle[kept[-1]], points - points // 2)
    wanted = np.concatenate([even, logs])
    return np.unique(kept[np.abs(angle[kept][None, :] - wanted[:, None]).argmin(axis=1)])
