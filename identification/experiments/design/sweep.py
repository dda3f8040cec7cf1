"""Sweeps whose phase is exact: the instantaneous frequency is its derivative, nothing is summed."""

from __future__ import annotations

import numpy as np

from bondgraph.support.errors import UnusableInput, require_known
from identification.experiments.design.signal import Signal


def sweep(
    rate: float,
    low: float,
    high: float,
    duration: float,
    *,
    kind: str = "linear",
    amplitude: float = 1.0,
    bias: float = 0.0,
    fade: float = 0.05,
    name: str = "u",
    unit: str = "V",
) -> Signal:
    """Return a sine whose frequency runs from `low` to `high`.

    With ``s = t / T`` the phase is ``2 pi T (f0 s + (f1 - f0) s^2 / 2)`` for a linear sweep and
    ``2 pi T f0 (r^s - 1) / ln r``, ``r = f1 / f0``, for a logarithmic one.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    low, high : float
        First and last frequency, Hz; the first may be the larger.
    duration : float
        T, s.
    kind : {"linear", "log"}
    amplitude : float
        Peak.
    fade : float
        Part of the duration over which the amplitude rises at the start and falls at the end, as
        half a cosine, 0 .. 0.5; without it the spectrum ripples and the ends jump in slope.

    Raises
    ------
    UnusableInput
        If a frequency is not below the Nyquist rate, or another number cannot be used.

    Examples
    --------
    >>> chirp = sweep(200.0, 1.0, 30.0, 4.0, amplitude=8.0, name="F", unit="N")
    >>> chirp.values.size, chirp.unit
    (801, 'N')
    """
    require_known("kind of sweep", "sweep", ("linear", "log"), kind)
    if not (0.0 < low < 0.5 * rate and 0.0 < high < 0.5 * rate):
        raise UnusableInput(
            f"sweep: {low:g} .. {high:g} Hz must lie above 0 and below {0.5 * rate:g} Hz; raise "
            "the rate"
        )
    n = round(duration * rate)
    if n < 8 or not amplitude > 0.0 or not 0.0 <= fade <= 0.5:
        raise UnusableInput(
            "sweep: needs 8 samples, a positive amplitude and a fade between 0 and 0.5"
        )
    time = np.arange(n + 1) / rate
    whole = n / rate
    s = time / whole
    ratio = np.log(high / low)
    if kind == "linear" or abs(ratio) < 1e-9:
        cycles = whole * (low * s + 0.5 * (high - low) * s**2)
    else:
        cycles = whole * low * np.expm1(ratio * s) / ratio
    near = np.minimum(s, 1.0 - s)
    window = np.ones(n + 1)
    if fade > 0.0:
        window = 0.5 - 0.5 * np.cos(np.pi * np.clip(near / fade, 0.0, 1.0))
    values = bias + amplitude * window * np.sin(2.0 * np.pi * cycles)
    return Signal(
        name, time, values, unit, f"{kind} sweep", "band-limited",
        notes=(f"{low:g} .. {high:g} Hz in {whole:g} s, faded over {fade:g} of it",),
    )  # fmt: skip
