"""Steps: pseudo-random binary sequences and staircases, with a least dwell and a finite rise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from identification.experiments.design.signal import Signal


def prbs(
    rate: float,
    dwell: float,
    *,
    order: int = 7,
    low: float = -1.0,
    high: float = 1.0,
    rise: float = 0.0,
    periods: int = 1,
    name: str = "u",
    unit: str = "V",
) -> Signal:
    """Return a binary sequence of maximum length: ``2^order - 1`` dwells a period.

    Its power is even up to about ``0.44 / dwell``.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    dwell : float
        Shortest time at a level, s; rounded up to whole samples.
    order : int
        2 .. 20.
    rise : float
        Duration of each step, s, less than the dwell; 0 for held samples that jump.

    Raises
    ------
    UnusableInput
        If the numbers leave no sequence.
    """
    from scipy.signal import max_len_seq

    if not 2 <= order <= 20:
        raise UnusableInput(f"prbs: order {order} must lie within 2 .. 20")
    if not low < high or periods < 1:
        raise UnusableInput("prbs: low must be below high, and there must be a period")
    bits, _ = max_len_seq(order)
    levels = np.where(bits > 0, high, low)
    # the sequence repeats, so its first step comes from its last level
    return _dwelling(
        np.tile(levels, periods), float(levels[-1]), rate, dwell, rise, name, unit,
        f"prbs of order {order}", levels.size,
    )  # fmt: skip


def staircase(
    rate: float,
    dwell: float,
    levels: Sequence[float],
    *,
    start: float | None = None,
    rise: float = 0.0,
    name: str = "u",
    unit: str = "V",
) -> Signal:
    """Return one level after the other, for `dwell` seconds each.

    Parameters
    ----------
    levels : sequence of float
    start : float, optional
        Level before; the first of the levels if not given.
    rate, dwell, rise
        As in `prbs`.
    """
    given = np.asarray(levels, float)
    if given.ndim != 1 or given.size == 0 or not np.isfinite(given).all():
        raise UnusableInput("staircase: levels must be a list of finite numbers")
    before = float(given[0]) if start is None else float(start)
    return _dwelling(given, before, rate, dwell, rise, name, unit, "staircase", 0)


def _dwelling(
    levels: FloatArray, before: float, rate: float, dwell: float, rise: float,
    name: str, unit: str, kind: str, period: int,
) -> Signal:  # fmt: skip
    held = int(np.ceil(dwell * rate * (1 - 1e-12)))
    ramp = int(np.ceil(rise * rate * (1 - 1e-12)))
    if not rate > 0.0 or held < 1 or not 0 <= ramp < max(held, 1) or rise < 0.0:
        raise UnusableInput(
            f"{kind}: {dwell:g} s at {rate:g} Hz must hold at least one sample and more than the "
            f"rise of {rise:g} s; lengthen the dwell"
        )
    last = np.concatenate(([before], levels[:-1]))
    part = np.minimum(np.arange(held) / ramp, 1.0) if ramp else np.ones(held)
    values = (last[:, None] + (levels - last)[:, None] * part).ravel()
    steps = np.flatnonzero(levels != last) * held
    return Signal(
        name, np.arange(values.size) / rate, values, unit, kind, "linear" if ramp else "hold",
        period * held, marks=tuple(map(int, steps)),
        notes=(f"dwell {held / rate:g} s, rise {ramp / rate:g} s",),
    )  # fmt: skip
