"""The spectral lines of a periodic record as a fit wants them: spectra, noise, run-in."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.recording import Recording
from bondgraph.signals.split import whole
from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from identification.experiments.frequency.periods import Periods, cut, run_in
from identification.study.free_parameters import refuse_clocks
from identification.study.problem import Problem

EXCITED = 1e-3
"""Lines count from this share of the largest amplitude of a command on."""
FREEDOM = 30
"""Neighbouring lines share a variance until it has so many degrees of freedom."""
REPEATS = 3e-2
"""Largest change of a command from period to period, in its spreads."""
HARMONICS = 3
"""Where lines mix all of them count, up to so many times the highest excited one."""
OTHER = "use method='single_shooting'"


@dataclass(frozen=True, eq=False)
class Lines:
    """Spectra of whole periods, as `numpy.fft.rfft` gives them.

    Attributes
    ----------
    omega : ndarray, shape (F,)
        Angle a sample, rad; 0 only if the mean is fitted.
    drive : ndarray, shape (N, n_u)
        Mean period of the inputs.
    u : ndarray, shape (F, n_u), complex
        Its spectrum.
    y : ndarray, shape (Q, F, n_y), complex
        The mean period (Q = 1), or all periods if a transient is fitted.
    variance : ndarray, shape (F, n_y)
        ``E |noise|^2`` of one line of one of the Q periods.
    period : int
        Samples of a period.
    transient : bool
    words : str
    """

    omega: Array
    drive: Array
    u: NDArray[np.complex128]
    y: NDArray[np.complex128]
    variance: Array
    period: int
    transient: bool
    words: str


def require_lines(problem: Problem) -> None:
    """Refuse models and studies that have no lines of their own.

    Raises
    ------
    UnusableInput
        One line that names another method.
    """
    if problem.window is not None:
        raise UnusableInput("frequency_domain: windows break the periods; leave window= out")
    refuse_clocks(problem.graph, "frequency_domain")
    if problem.clock:
        raise UnusableInput(
            "frequency_domain: a clock that runs away smears the lines; use "
            "method='single_shooting', or leave clock= out"
        )
    for source in problem.dynamics.input_names:
        if re.fullmatch(r"ramp\d*", source):
            raise UnusableInput(
                f"frequency_domain: {problem.graph.name} drifts ({source}), which never repeats; "
                f"{OTHER}"
            )


def mixes(problem: Problem) -> bool:
    """Whether something that is not linear mixes the lines."""
    return not problem.dynamics.exact_step


def lines_of(problem: Problem) -> Lines:
    """Cut the training samples of a record into periods and return their lines.

    Three or more periods: those that still decay are left out, the others averaged, and the noise
    is what changes between them, shared by neighbouring lines. Otherwise all periods count, each
    with the transient of one common initial state, and the noise is that of `Problem.data`.

    Raises
    ------
    UnusableInput
        If the commands do not repeat, or nothing moves.
    """
    data = problem.data
    scored = whole(data.split.train)
    train = slice(scored.start or 0, scored.stop or data.n)
    moving = [n for n, v in data.commands.items() if np.ptp(v[train]) > 0.0]
    if not moving:
        raise UnusableInput(f"frequency_domain: no command of {data.name} moves; {OTHER}")
    names = {**data.commands, **dict(zip(data.names, data.readings.T, strict=True))}
    channels = {n: np.asarray(v[train], float) for n, v in names.items()}
    units = dict.fromkeys(channels, "1")
    part = Recording(data.name, np.arange(train.stop - train.start) * data.dt, channels, units)
    try:
        every = cut(part, moving[0], data.names, discard=0)
    except UnusableInput as error:
        raise UnusableInput(f"frequency_domain: {error}; or {OTHER}") from None
    settled, transient, words = _settled(every, data.names, mixes(problem))
    _require_repeating(every, moving, data.name)
    n = every.period
    start = train.stop - settled.count * n
    drive = problem.inputs[start : train.stop].reshape(settled.count, n, -1).mean(axis=0)
    u = np.fft.rfft(drive, axis=0)
    y = np.stack([np.fft.rfft(settled.channels[c], axis=1) for c in data.names], axis=2)
    if mixes(problem):
        if transient:
            decay = ", of which even the last two still decay" if every.count > 2 else ""
            raise UnusableInput(
                f"frequency_domain: {every.count} periods train of {data.name}{decay}; a model "
                "that is not linear needs two settled ones after its run-in: record more, or "
                f"train on more of them (splits=), or {OTHER}"
            )
        if problem.correction is not None:
            change = problem.correction[start : train.stop].reshape(settled.count, n, -1)
            y = y - np.fft.rfft(change, axis=1)
    at = _chosen(problem, u, n)
    omega = 2.0 * np.pi * at / n
    if transient:
        variance = _declared_noise(problem, omega) * n
    else:
        variance = _noise(y)[at] / settled.count
        y = y.mean(axis=0, keepdims=True)
    # a record without noise still has that of its arithmetic
    least = (1e-9 * np.abs(y).max(axis=(0, 1))) ** 2 + 1e-300
    return Lines(omega, drive, u[at], y[:, at], np.maximum(variance, least), n, transient, words)


def _settled(every: Periods, names: tuple[str, ...], needed: bool) -> tuple[Periods, bool, str]:
    """Return the periods that count, whether a transient is fitted, and words.

    Two that are `needed`, for no transient can be fitted, count if they change by far less than
    those before: what still decays then is little beside what changes.
    """
    values = np.stack([every.channels[c] for c in names], axis=2)
    dropped, _ = run_in(values)
    last = dropped > 0 and dropped == every.count - 2
    if last and needed:
        before, after = np.mean(np.diff(values[-3:], axis=0) ** 2, axis=1)
        last = not (after <= FADED**2 * before).all()
    if every.count < 3 or last:
        return every, True, f"{every.count} periods of {every.period} samples with their transient"
    kept = {c: v[dropped:] for c, v in every.channels.items()}
    found = Periods(every.name, every.rate, kept, every.units, every.discarded, every.words)
    words = f"mean of {found.count} periods of {found.period} samples, {dropped} left out as run-in"
    return found, False, words


FADED = 0.1
"""Change of the last two periods over the one before, at most, where the run-in is over."""


def _require_repeating(every: Periods, moving: list[str], name: str) -> None:
    for c in moving:
        values = every.channels[c]
        apart = np.sqrt(np.mean((values - values.mean(axis=0)) ** 2))
        if apart > REPEATS * values.std():
            raise UnusableInput(
                f"frequency_domain: {c} of {name} does not repeat every {every.period} samples "
                f"({100 * apart / values.std():.2g} % change); {OTHER}"
            )


def _chosen(problem: Problem, u: NDArray[np.complex128], n: int) -> NDArray[np.intp]:
    """Lines that a command excites; the mean only if no offset is free and nothing integrates."""
    size = np.abs(u)
    size[0] = 0.0
    wanted = (size > EXCITED * np.maximum(size.max(axis=0), 1e-300)).any(axis=1)
    wanted[(n + 1) // 2 :] = False  # the Nyquist line has no phase
    at = np.flatnonzero(wanted)
    if mixes(problem):
        at = np.arange(1, min(HARMONICS * int(at[-1]), (n - 1) // 2) + 1)
    if not problem.offsets and not _integrates(problem):
        at = np.concatenate([[0], at])
    return at


def _integrates(problem: Problem) -> bool:
    mean = problem.mean_inputs
    poles = np.abs(problem.dynamics.small_signal(problem.start_vector, mean).eigenvalues())
    return bool(poles.size and poles.min() < 1e-12 * max(float(poles.max()), 1e-300))


def _noise(y: NDArray[np.complex128]) -> Array:
    """Variance of one period from what changes between the periods, shared by neighbours."""
    from scipy.ndimage import uniform_filter1d

    count = y.shape[0]
    apart = np.sum(np.abs(y - y.mean(axis=0)) ** 2, axis=0) / (count - 1)
    apart[0] = apart[1]  # the mean is real
    width = min(max(1, int(np.ceil(FREEDOM / (count - 1)))), apart.shape[0])
    return np.asarray(uniform_filter1d(apart, width, axis=0, mode="nearest"))


def _declared_noise(problem: Problem, omega: Array) -> Array:
    """Power density of the noise of the problem, white or autoregressive, (F, n_y)."""
    density = np.tile(problem.data.floor**2, (omega.size, 1))
    for c, polynomial in enumerate(problem.whitening):
        filtered = np.exp(-1j * np.outer(omega, np.arange(polynomial.size))) @ polynomial
        density[:, c] /= np.abs(filtered) ** 2
    return density
