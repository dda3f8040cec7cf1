"""Miscounts: jumps by whole half wavelengths that the motion around them does not explain.

Detection only marks; `repaired` takes the jumps out and says what it did.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.optics.step_filter import (
    HALF,
    motion_leak,
    robust_spread,
    step_estimates,
    step_filter,
    step_spreads,
)

_SIGMAS: Final = 5.0
_NEAR: Final = 0.15
_FAR: Final = 0.25
_MOST: Final = 1000


@dataclass(frozen=True, slots=True)
class Jump:
    """One jump.

    Parameters
    ----------
    sample : int
        First sample after it.
    size : float
        Estimated size (m).
    fringes : int
        Nearest whole number of fringes.
    whole : bool
        Whether the size is a whole number within the noise; if not, it is a true motion faster
        than the sampling, or several faults at once.
    """

    sample: int
    size: float
    fringes: int
    whole: bool


@dataclass(frozen=True, slots=True, eq=False)
class Miscounts:
    """What was found.

    Parameters
    ----------
    jumps : tuple of Jump
        In order of time.
    flags : ndarray
        ``(n,)``, uint16: `Flag.MISCOUNT` while the record is off by a whole number of fringes.
    noise : float
        Robust standard deviation of the step estimate (m): noise and leaked motion together.
    able : bool
        Whether a jump of one fringe would have been seen. If not, the motion is too fast or the
        noise too great, and the absence of jumps says nothing.
    """

    jumps: tuple[Jump, ...]
    flags: NDArray[np.uint16]
    noise: float
    able: bool


@dataclass(frozen=True, slots=True, eq=False)
class Repair:
    """A record without its whole jumps.

    Parameters
    ----------
    position : ndarray
        ``(n,)``, m.
    removed : tuple of Jump
        What was taken out.
    left : tuple of Jump
        What was not, because it is no whole number of fringes.
    report : str
        One line for the provenance.
    """

    position: Array
    removed: tuple[Jump, ...]
    left: tuple[Jump, ...]
    report: str


def find_miscounts(
    position: ArrayLike, fringe: float, commanded: NDArray[np.bool_] | None = None
) -> Miscounts:
    """Find jumps of whole fringes in an evenly sampled record.

    The step in front of every sample is estimated together with a cubic motion through six samples
    on either side; the greatest is taken out of a copy, and so on, until none exceeds half a fringe
    and five robust deviations of all estimates. So noise and fast motion raise the threshold
    instead of giving false alarms; `largest_amplitude` gives the limit for a sine. A motion that
    is not smooth at the rate of the samples (a step of voltage, the corner of a fast triangle)
    gives jumps too, not `whole` unless by chance (a lone one three times in ten): mark such
    samples in `commanded`. Within six samples of an end the size of a jump in fast motion can be
    too uncertain to be called whole.

    Parameters
    ----------
    position : array_like
        ``(n,)``, m, n at least 12.
    fringe : float
        Displacement of one fringe (m); see `displacement_per_fringe`.
    commanded : ndarray of bool, optional
        ``(n,)``, where the command itself jumps; no jump is looked for there.

    Returns
    -------
    Miscounts

    Raises
    ------
    UnusableInput
        Too short or non-finite a record, or more than 1000 jumps: then it is no displacement.
    """
    x = np.array(position, dtype=np.float64)
    if x.ndim != 1 or x.size < 2 * HALF or not np.isfinite(x).all():
        raise UnusableInput(
            f"miscounts: {x.shape} positions; give a finite (n,) of at least {2 * HALF} samples"
        )
    if not fringe > 0.0:
        raise UnusableInput(f"miscounts: a fringe of {fringe!r} m; give a positive length")
    allowed = np.ones(x.size, np.bool_) if commanded is None else ~commanded
    J = step_estimates(x)
    noise = robust_spread(J)
    limits = np.maximum(0.5 * fringe, _SIGMAS * step_spreads(x))
    near = max(_NEAR * fringe, min(_SIGMAS * noise, _FAR * fringe))
    found: dict[int, float] = {}
    J[~allowed] = 0.0
    while True:
        k = int(np.argmax(np.abs(J) / limits))
        if abs(J[k]) <= limits[k]:
            break
        if len(found) >= _MOST:
            raise UnusableInput(
                f"miscounts: more than {_MOST} jumps in {x.size} samples; this record is no "
                "displacement of a smooth motion; check the beam and the rate"
            )
        size = _cleared(float(J[k]), fringe, near)
        found[k] = found.get(k, 0.0) + size
        _remove(x, J, k, size)
        J[~allowed] = 0.0
        if abs(found[k]) < 0.5 * fringe:
            del found[k]
    jumps = _judged(found, fringe, near)
    return Miscounts(jumps, _flags(x.size, jumps), noise, _SIGMAS * noise < (1.0 - _FAR) * fringe)


def largest_amplitude(frequency: float, rate: float, fringe: float) -> float:
    """Largest amplitude (m) of a sine at which a single miscount is still found.

    Parameters
    ----------
    frequency, rate : float
        Of the motion and of the samples (Hz).
    fringe : float
        Displacement of one fringe (m).

    Returns
    -------
    float
        Infinity for motion that leaves no trace.

    Examples
    --------
    >>> round(largest_amplitude(100.0, 3125.0, 316.4e-9) * 1e6)  # um
    21
    """
    leak = motion_leak(frequency, rate)
    # the median of |sine| is 0.707 of its amplitude; the threshold must stay below one fringe
    worst = _SIGMAS * 1.4826 * 0.7071 * leak
    return float("inf") if worst == 0.0 else (1.0 - _FAR) * fringe / worst


def repaired(position: ArrayLike, found: Miscounts, fringe: float) -> Repair:
    """Take whole jumps out of a record; the flags of the record should stay.

    Parameters
    ----------
    position : array_like
        ``(n,)``, m.
    found : Miscounts
        Of the same record.
    fringe : float
        Displacement of one fringe (m).

    Returns
    -------
    Repair
    """
    x = np.array(position, dtype=np.float64)
    whole = tuple(j for j in found.jumps if j.whole)
    left = tuple(j for j in found.jumps if not j.whole)
    steps = np.zeros(x.size)
    for jump in whole:
        steps[jump.sample] += jump.fringes * fringe
    named = ", ".join(f"{j.fringes:+d} at sample {j.sample}" for j in whole) or "none"
    report = f"fringes removed (of {fringe * 1e9:.3f} nm each): {named}"
    if left:
        report += "; left, no whole number: " + ", ".join(
            f"{j.size * 1e9:+.0f} nm at sample {j.sample}" for j in left
        )
    return Repair(x - np.cumsum(steps), whole, left, report)


def _cleared(size: float, fringe: float, near: float) -> float:
    """Size to be taken out: the whole number if it is near one."""
    whole = fringe * round(size / fringe)
    return whole if whole and abs(size - whole) <= near else size


def _judged(found: dict[int, float], fringe: float, near: float) -> tuple[Jump, ...]:
    """Jumps in order; one so near to a broken one that both share samples is not trusted either."""

    def rest(size: float) -> float:
        return abs(size - fringe * round(size / fringe))

    broken = np.array([k for k, size in found.items() if rest(size) > near], dtype=np.int64)
    return tuple(
        Jump(
            k,
            size,
            round(size / fringe),
            round(size / fringe) != 0 and not bool(np.any(np.abs(broken - k) < HALF)),
        )
        for k, size in sorted(found.items())
    )


def _remove(x: Array, J: Array, k: int, size: float) -> None:
    """Take a step out of the record and renew the estimates that saw it."""
    x[k:] -= size
    n = x.size
    for j in range(max(1, k - HALF + 1), min(n, k + HALF)):
        left, right = min(j, HALF), min(n - j, HALF)
        J[j] = step_filter(left, right) @ x[j - left : j + right]


def _flags(n: int, jumps: tuple[Jump, ...]) -> NDArray[np.uint16]:
    steps = np.zeros(n, np.int64)
    for jump in jumps:
        if jump.whole:
            steps[jump.sample] += jump.fringes
    return np.where(np.cumsum(steps) != 0, int(Flag.MISCOUNT), 0).astype(np.uint16)
