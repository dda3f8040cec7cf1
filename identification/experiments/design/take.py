"""The default waveform of a recording session: rest, slow swings with minor loops, a multisine."""

from __future__ import annotations

import numpy as np

from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from identification.experiments.design.multisine import multisine
from identification.experiments.design.signal import Signal

REST = 0.03
"""Share of the record before anything moves; the noise is read there."""
RISE = 0.02
FAST = 0.12
"""Peak of the multisine over half of the range."""
LEVELS = (1.0, 0.65, 0.85)
BAND = (0.02, 0.75)
"""Of the multisine, over half of the rate."""


def session_signal(
    rate: float,
    count: int,
    envelope: DriveLimits,
    *,
    bias: float | None = None,
    seed: int = 0,
    name: str = "V",
    unit: str = "V",
) -> Signal:
    """Return a waveform from which most effects can be told apart.

    It starts and ends at the bias. Slow swings of three modulated tones cover most of the range
    with major and minor loops at changing levels; a random-phase multisine with three levels rides
    on them and shows the dynamics.

    Parameters
    ----------
    rate : float
        Samples per second, Hz; each value is held until the next one.
    count : int
        Samples.
    envelope : DriveLimits
        Limits; both bounds must be finite. The multisine becomes smaller until the steps between
        samples keep nine tenths of the slew and current limits.
    bias : float, optional
        Middle; of the bounds if not given.
    seed : int
        Of frequencies and phases.

    Raises
    ------
    UnusableInput
        If there are fewer than 256 samples, the bounds are not finite or the bias is outside.
    """
    if count < 256:
        raise UnusableInput(f"{name}: {count} samples are too few for swings; give at least 256")
    if not (np.isfinite(envelope.low) and np.isfinite(envelope.high)):
        raise UnusableInput(f"{name}: give a lowest and a highest value to swing between")
    middle = 0.5 * (envelope.low + envelope.high) if bias is None else bias
    room = min(envelope.high - middle, middle - envelope.low)
    if not room > 0.0:
        raise UnusableInput(f"{name}: the bias {middle:g} {unit} is outside the limits")
    rng = np.random.default_rng([seed, 0x7A])
    s = np.arange(count) / count
    window = _window(s)
    nyquist = 0.5 * rate
    fast = (
        multisine(
            rate, count, band=(BAND[0] * nyquist, BAND[1] * nyquist), peak=FAST * room, seed=seed
        ).values
        * _levels(s)
        * window
    )
    slow = (1.0 - FAST) * room * _tones(s, rng) * window
    steepest = 0.9 * envelope.steepest / rate
    values = middle + slow + _share(slow, fast, steepest) * fast
    return Signal(
        name, np.arange(count) / rate, values, unit, "slow swings and multisine", "hold",
        notes=(f"rest of {REST:.0%}, swings between {values.min():.4g} and {values.max():.4g} "
               f"{unit}, seed {seed}",),
    )  # fmt: skip


def _window(s: FloatArray) -> FloatArray:
    """Rest, smooth rise, smooth fall to the bias at the end."""
    return np.asarray(_smooth((s - REST) / RISE) * _smooth((1.0 - s) / RISE))


def _smooth(s: FloatArray) -> FloatArray:
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s * s * (3.0 - 2.0 * s))


def _levels(s: FloatArray) -> FloatArray:
    """Three levels with smooth changes between them, met twice."""
    part = (2.0 * s) % 1.0
    a, b, c = LEVELS
    rise, fall = _smooth((part - 0.32) / 0.03), _smooth((part - 0.65) / 0.03)
    return np.asarray(a + (b - a) * rise + (c - b) * fall)


def _tones(s: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Three modulated tones, peak 1."""
    total = np.zeros_like(s)
    bands = ((2.0, 3.2), (4.5, 7.0), (8.5, 12.5))
    for (low, high), weight in zip(bands, (0.65, 0.3, 0.2), strict=True):
        cycles, beat = rng.uniform(low, high), rng.uniform(0.6, 1.9)
        phase, turn = rng.uniform(0.0, 2.0 * np.pi, 2)
        envelope = 1.0 + 0.45 * np.sin(2.0 * np.pi * beat * s + turn)
        total += weight * envelope * np.sin(2.0 * np.pi * cycles * s + phase)
    return np.asarray(total / np.max(np.abs(total)))


def _share(slow: FloatArray, fast: FloatArray, steepest: float) -> float:
    """Largest share <= 1 of the multisine with which every step keeps the limit."""
    if not np.isfinite(steepest):
        return 1.0
    across, beside = np.abs(np.diff(fast)), np.abs(np.diff(slow))
    moving = across > 0.0
    room = (steepest - beside[moving]) / across[moving]
    if room.size and room.min() <= 0.0:
        raise UnusableInput(
            "the slow swings alone are too fast for the limits; give more samples or a lower rate"
        )
    return float(min(1.0, room.min())) if room.size else 1.0
