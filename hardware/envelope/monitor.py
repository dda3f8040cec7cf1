"""Whether the voltage that a device tells is the one that was commanded."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hardware.envelope.limits import PLAUSIBLE, Envelope
from hardware.envelope.runs import lead, longest, trail
from hardware.errors import LimitViolation

SAMPLES = 8
"""So many readings in a row may miss more than that."""
LOWEST, HIGHEST = 0.8, 1.25
"""Read-back over command of a small step."""


def check_monitor(
    envelope: Envelope,
    commanded: ArrayLike,
    read: ArrayLike,
    before: int = 0,
    *,
    lag: int = 1,
) -> int:
    """Refuse readings that do not follow their commands.

    A reading deviates if it misses all commands of its sample and of the `lag` samples before by
    more than 5 % of the range. Up to 8 deviating samples in a row pass. What is NaN on either
    side does not count.

    Parameters
    ----------
    envelope : Envelope
    commanded, read : array_like
        (n,), V at the actuator. Give the command that held when the sample was read.
    before : int
        What the call for the chunk before has returned.
    lag : int
        Delay of amplifier and monitor in samples.

    Returns
    -------
    int
        Deviating samples at the end, for the next chunk.

    Raises
    ------
    LimitViolation
        What was commanded, what was read, and the likely cause.

    Examples
    --------
    >>> check_monitor(Envelope(0.0, 100.0, 1e5), [10.0, 20.0, 30.0], [10.1, 19.9, 60.0])
    1
    """
    wanted, told = np.array(commanded, dtype=np.float64), np.array(read, dtype=np.float64)
    if wanted.ndim != 1 or wanted.shape != told.shape:
        raise LimitViolation(
            f"monitor: {wanted.shape} commands and {told.shape} readings; give one row of each"
        )
    if wanted.size == 0:
        return before
    low, high = _reach(wanted, lag)
    allowed = PLAUSIBLE * (envelope.v_max - envelope.v_min) + envelope.slack
    wrong: NDArray[np.bool_] = (told > high + allowed) | (told < low - allowed)
    first, count = longest(wrong)
    carried = before + lead(wrong)
    if carried >= count:
        first, count = 0, carried
    if count > SAMPLES:
        shown = wrong.copy()
        shown[:first] = False
        k = int(np.argmax(shown))
        raise LimitViolation(
            f"monitor: {told[k]:g} V are read where {wanted[k]:g} V are commanded, {count} samples "
            f"in a row beyond {allowed:.3g} V; check gain and sign of the amplifier, the scale of "
            "the monitor and its wire"
        )
    return before + wrong.size if wrong.all() else trail(wrong)


def doubt_of_step(step: float, change: float, noise: float) -> str:
    """Return why a read-back cannot be believed that changed so (V) on a step (V); else ``""``.

    Parameters
    ----------
    step, change : float
        Of the command and of the read-back (V).
    noise : float
        By which the change may be off (V).

    Examples
    --------
    >>> doubt_of_step(2.0, 2.1, 0.01)
    ''
    """
    seen = change if step > 0.0 else -change
    size = abs(step)
    if LOWEST * size - noise <= seen <= HIGHEST * size + noise:
        return ""
    if abs(seen) <= 0.05 * size + noise:
        return "the monitor is not wired, or nothing comes out"
    if seen < 0.0:
        return "the sign of the gain or of the monitor is wrong"
    return "the gain or the scale of the monitor is wrong"


def _reach(
    wanted: NDArray[np.float64], lag: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return lowest and highest command of every sample and those shortly before it."""
    if lag <= 0:
        return wanted, wanted
    padded = np.concatenate([np.full(lag, wanted[0]), wanted])
    windows = np.lib.stride_tricks.sliding_window_view(padded, lag + 1)
    return windows.min(axis=1), windows.max(axis=1)
