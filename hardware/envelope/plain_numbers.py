"""What counts as a voltage: one finite real number, or a row of them; nothing else is sent."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.errors import LimitViolation


def finite_number(value: object, what: str) -> float:
    """Return `value` as a float.

    NumPy's scalars count as numbers; truth values, texts, complex numbers and arrays do not, even
    where Python would convert them.

    Raises
    ------
    LimitViolation
        It is not one finite real number.

    Examples
    --------
    >>> finite_number(np.float32(2.5), "set")
    2.5
    """
    if type(value) is float and math.isfinite(value):
        return value
    if type(value) is not bool and isinstance(value, numbers.Real):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isfinite(number):
            return number
    raise LimitViolation(
        f"{what}: {_shown(value)} is not one finite real number; nothing was sent, give a float"
    )


def finite_wave(volts: Any, what: str) -> NDArray[np.float64]:
    """Return a waveform as a read-only copy of its own, ``(n,)`` float64.

    Raises
    ------
    LimitViolation
        It is empty, not a row, not real, masked in places, or not finite.
    """
    if isinstance(volts, np.ma.MaskedArray) and np.ma.is_masked(volts):
        raise LimitViolation(f"{what}: some samples are masked; fill them first")
    try:
        raw = np.asarray(volts)
    except ValueError as error:
        raise LimitViolation(f"{what}: not a row of numbers ({error})") from error
    if raw.dtype.kind not in "fiu" or raw.ndim != 1 or raw.size == 0:
        raise LimitViolation(
            f"{what}: needs a row (n,) of real numbers with n >= 1, not {raw.dtype} {raw.shape}"
        )
    with np.errstate(over="ignore"):
        wave = np.array(raw, dtype=np.float64)
    good = np.isfinite(wave)
    if not good.all():
        first = int(np.argmin(good))
        raise LimitViolation(
            f"{what}: sample {first} is {wave[first]} and {wave.size - int(good.sum())} of "
            f"{wave.size} are not finite; nothing was sent, look where the waveform was computed"
        )
    wave.setflags(write=False)
    return wave


def _shown(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
