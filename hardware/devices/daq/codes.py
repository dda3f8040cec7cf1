"""Volts and converter codes of 14 bit cards with +-10 V."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["HIGHEST", "LOWEST", "STEP", "ZERO", "dac_codes", "dac_volts", "input_volts"]

LOWEST, HIGHEST = -10.0, 10.0
"""Ends of the range (V)."""
STEP = 20.0 / 16384.0
"""One code (V)."""
ZERO = 0x2000
"""Code of 0 V at an output (offset binary)."""
_TOP = 0x3FFF


def dac_codes(volts: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Return output codes of voltages (V) within the range; +10 V is one step below itself.

    Examples
    --------
    >>> [hex(c) for c in dac_codes(np.array([-10.0, 0.0, 10.0]))]
    ['0x0', '0x2000', '0x3fff']
    """
    codes = np.rint(np.asarray(volts) / STEP).astype(np.int64) + ZERO
    return np.clip(codes, 0, _TOP).astype(np.uint16)


def dac_volts(codes: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return voltages (V) of output codes."""
    return np.asarray((np.asarray(codes, np.int64) - ZERO) * STEP)


def input_volts(words: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return voltages (V) of input words (two's complement in the low 14 bits).

    Examples
    --------
    >>> input_volts(np.array([0x0000, 0x1FFF, 0x2000, 0x3FFF])).tolist()
    [0.0, 9.998779296875, -10.0, -0.001220703125]
    """
    low = np.asarray(words, np.int64) & _TOP
    return np.asarray((low - ((low & ZERO) << 1)) * STEP)
