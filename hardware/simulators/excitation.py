"""The designed experiment: slow large swings plus a multisine in three levels.

The first two thirds are meant for training, the last third is held out and has other phases,
frequencies and levels.  No component is periodic in the record.
"""

from __future__ import annotations

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.plant import BIAS

SAMPLE_RATE = 40_000.0
"""Sampling rate of all channels (Hz)."""

N_SAMPLES = 8192
"""Samples of a full recording (0.2048 s)."""

_LEVELS = (8.0, 5.5, 6.8)
_LINES = 150
_SWING = 35.0
_REACH = 49.0


def training_samples(n_samples: int) -> int:
    """Count the samples before the held-out part."""
    return 2 * n_samples // 3


def voltage(seed: int, n_samples: int = N_SAMPLES) -> Array:
    """Command of the amplifier (V) at the samples, within 0..100 V and at the bias at first.

    Parameters
    ----------
    seed
        Seed of frequencies and phases.
    n_samples
        Length; shorter records squeeze the slow swings so that they still close loops.
    """
    rng = np.random.default_rng([seed, 0xE8C])
    t = np.arange(n_samples) / SAMPLE_RATE
    stretch = N_SAMPLES / n_samples
    edges = [n_samples // 3, training_samples(n_samples)]
    slow = _blend([_slow(rng, t * stretch) for _ in range(2)], edges[1:], max(n_samples // 20, 1))
    fast = _blend([level * _multisine(rng, t) for level in _LEVELS], edges, max(n_samples // 80, 1))
    ramp = _smooth_step(np.arange(n_samples) / max(n_samples // 40, 1))
    fast *= ramp
    slow *= _SWING * ramp
    return BIAS + fast + _largest_fit(slow, fast) * slow


def _slow(rng: np.random.Generator, t: Array) -> Array:
    """Three amplitude-modulated sines of 10..60 Hz with peak 1: major and minor loops."""
    frequencies = [rng.uniform(10.0, 16.0), rng.uniform(22.0, 34.0), rng.uniform(42.0, 60.0)]
    total = np.zeros_like(t)
    for f, weight in zip(frequencies, (0.65, 0.3, 0.2), strict=True):
        phase, beat, turn = rng.uniform(0, 2 * np.pi), rng.uniform(3.0, 9.0), rng.uniform(0, 6.3)
        envelope = 1.0 + 0.45 * np.sin(2 * np.pi * beat * t + turn)
        total += weight * envelope * np.sin(2 * np.pi * f * t + phase)
    return total / float(np.max(np.abs(total)))


def _multisine(rng: np.random.Generator, t: Array) -> Array:
    """Random-phase lines between 100 Hz and 6 kHz with rms 1, off any common grid."""
    grid = np.linspace(100.0, 6000.0, _LINES)
    f = np.clip(grid + rng.uniform(-15.0, 15.0, _LINES), 100.0, 6000.0)
    amplitude = (1.0 + (f / 1500.0) ** 2) ** -0.25
    phases = rng.uniform(0.0, 2 * np.pi, (6, _LINES))
    angle = 2 * np.pi * np.outer(f, t)
    # all phases from one sine and cosine of each line
    by_sine, by_cosine = amplitude * np.cos(phases), amplitude * np.sin(phases)
    candidates = by_sine @ np.sin(angle) + by_cosine @ np.cos(angle)
    crests = np.max(np.abs(candidates), axis=1) / np.std(candidates, axis=1)
    best = candidates[int(np.argmin(crests))]
    return np.asarray(best / np.std(best))


def _blend(parts: list[Array], edges: list[int], width: int) -> Array:
    """Join the parts at the edges with smooth cross-fades of ``width`` samples."""
    n = np.arange(parts[0].size)
    joined = parts[0]
    for part, edge in zip(parts[1:], edges, strict=True):
        w = _smooth_step((n - edge + width / 2) / width)
        joined = (1.0 - w) * joined + w * part
    return joined


def _smooth_step(s: Array) -> Array:
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s * s * (3.0 - 2.0 * s))


def _largest_fit(slow: Array, fast: Array) -> float:
    """Largest factor <= 1 on the swings that keeps the sum within 0..100 V."""
    room = _REACH - np.sign(slow) * fast
    active = np.abs(slow) > 1e-9
    return float(min(1.0, np.min(room[active] / np.abs(slow[active]))))
