"""Commands: multisines at two levels, steps, sweeps, noise, and the reference of a loop."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

AMPLITUDE: Mapping[str, float] = {
    "chain": 40.0,
    "stack": 40.0,
    "motor": 5.0,
    "corner": 0.12,
    "tanks": 1.5e-4,
    "probe": 3.0,
    "cylinder": 2.0e-4,
    "servo": 0.3,
    "oven": 50.0,
    "frame": 30.0,
    "press": 200.0,
    "table": 4.0,
    "speaker": 5.0,
}
"""Usual rms of the command of each plant, in its unit."""

BAND: Mapping[str, tuple[float, float]] = {
    "chain": (0.004, 0.38),
    "stack": (0.002, 0.40),
    "motor": (0.002, 0.30),
    "corner": (0.004, 0.40),
    "tanks": (0.002, 0.20),
    "probe": (0.004, 0.40),
    "cylinder": (0.004, 0.40),
    "servo": (0.004, 0.40),
    "oven": (0.002, 0.20),
    "frame": (0.004, 0.40),
    "press": (0.004, 0.40),
    "table": (0.002, 0.30),
    "speaker": (0.004, 0.25),
}
"""Band of the excitation, in parts of the Nyquist frequency."""

LOOPS: Mapping[str, tuple[float, float, float, float]] = {
    # number of the sensor; gains of proportion, integral and difference
    "chain": (0.0, 1500.0, 0.0, 6.0),
    "stack": (1.0, 1.0e5, 2.0e7, 0.0),
    "motor": (1.0, 0.03, 0.3, 0.0),
    "corner": (1.0, 0.15, 0.0, 0.0),
    "tanks": (0.0, 5.0e-8, 1.0e-10, 0.0),
    "probe": (0.0, 1200.0, 0.0, 3.0),
}

KINDS = ("multisine", "steps", "sweep", "noise", "closed_loop")


def multisine(n: int, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return two levels one after the other, several periods each, of random phases."""
    half = n // 2
    periods = int(rng.integers(2, 5))
    period = max(half // periods, 64)
    low, high = band[0] / 2, band[1] / 2
    first = max(1, int(np.ceil(low * period)))
    lines = np.arange(first, max(first + 8, int(high * period)))
    if rng.random() < 0.5:
        lines = lines[rng.random(len(lines)) < 0.7]
    spectrum = np.zeros(period // 2 + 1, complex)
    lines = lines[lines < len(spectrum)]
    tilt = (1 + lines / lines.mean()) ** -rng.uniform(0, 1.5)
    spectrum[lines] = tilt * np.exp(2j * np.pi * rng.random(len(lines)))
    wave = np.fft.irfft(spectrum, period)
    wave /= np.sqrt(np.mean(wave**2))
    levels = np.where(np.arange(n) < half, rng.uniform(0.3, 0.5), 1.3)
    return np.asarray(levels * np.resize(wave, n))


def steps(n: int, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return holds of random length and height."""
    shortest = max(4, int(0.5 / band[1]))
    longest = max(2 * shortest, min(n // 12, int(1.5 / band[0])))
    out = np.empty(n)
    k = 0
    while k < n:
        length = int(np.exp(rng.uniform(np.log(shortest), np.log(longest))))
        out[k : k + length] = rng.uniform(-1.7, 1.7)
        k += length
    return out


def sweep(n: int, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return a sine whose frequency rises, then falls, geometrically, with a swelling level."""
    up = np.linspace(0, 1, n // 2)
    there = np.concatenate([up, up[::-1], np.zeros(n - 2 * len(up))])
    frequency = band[0] / 2 * (band[1] / band[0]) ** there
    swell = 0.6 + 0.5 * np.sin(np.linspace(0, rng.uniform(3, 9), n))
    return np.asarray(1.4 * swell * np.sin(2 * np.pi * np.cumsum(frequency)))


def noise(n: int, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return Gaussian noise in the band, with quiet and loud parts."""
    spectrum = np.fft.rfft(rng.normal(size=n))
    f = np.fft.rfftfreq(n, 0.5)
    spectrum[(f < band[0]) | (f > band[1])] = 0
    wave = np.fft.irfft(spectrum, n)
    wave /= np.sqrt(np.mean(wave**2))
    loud = np.interp(np.arange(n), np.linspace(0, n, 9), rng.uniform(0.4, 1.5, 9))
    return np.asarray(wave * loud)


def rare(n: int, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return quiet noise in the band that is loud in two of forty equal stretches."""
    wave = noise(n, band, rng)
    length = n // 40
    loud = np.full(n, 0.25)
    for k in rng.choice(np.arange(2, 39), 2, replace=False):
        loud[k * length : (k + 1) * length] = 1.7
    # the loudness of `noise` itself wanders; here only the two stretches stand out
    level = np.sqrt(np.convolve(wave**2, np.full(length, 1 / length), "same")) + 0.1
    return np.asarray(wave / level * loud)


def slow(n: int, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return a few long steps with a weak multisine on them."""
    out = np.empty(n)
    k = 0
    while k < n:
        length = int(n * rng.uniform(0.06, 0.25))
        out[k : k + length] = rng.uniform(-1.5, 1.5)
        k += length
    wave = multisine(n, band, rng)
    return np.asarray(out + rng.uniform(0.04, 0.12) * wave)


def broadband(n: int, band: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return Gaussian noise of even loudness up to twice the band: no repeat and no rest."""
    spectrum = np.fft.rfft(rng.normal(size=n))
    f = np.fft.rfftfreq(n, 0.5)
    spectrum[(f < band[0]) | (f > min(2 * band[1], 0.9))] = 0
    wave = np.fft.irfft(spectrum, n)
    return np.asarray(wave / np.sqrt(np.mean(wave**2)))


def tone(plant: str, n: int, level: float, rng: np.random.Generator) -> Array:
    """Return one sine of constant level well inside the band: little to learn from."""
    low, high = BAND[plant]
    f = low * (high / low) ** rng.uniform(0.35, 0.6) / 2
    rise = np.minimum(1, np.arange(n) / (0.1 * n))
    return np.asarray(AMPLITUDE[plant] * level * rise * np.sin(2 * np.pi * f * np.arange(n)))


def swings(plant: str, n: int, level: float, rng: np.random.Generator) -> Array:
    """Return three slow beating sines with noise of the band on them, from rest on.

    What a bench does about its working point: the largest is 1.225 times the usual rms at level 1.
    """
    t = np.linspace(0, 1, n)
    slow = np.zeros(n)
    for low, high, weight in ((3.0, 5.0, 0.65), (7.0, 11.0, 0.3), (14.0, 20.0, 0.2)):
        beat = 1 + 0.4 * np.sin(2 * np.pi * rng.uniform(1, 3) * t + rng.uniform(0, 6))
        turn = rng.uniform(0, 2 * np.pi)
        slow += weight * beat * np.sin(2 * np.pi * rng.uniform(low, high) * t + turn)
    wave = slow / np.max(np.abs(slow)) + 0.2 * noise(n, BAND[plant], rng)
    wave *= np.minimum(1, 40 * t)
    return np.asarray(1.225 * AMPLITUDE[plant] * level * wave / np.max(np.abs(wave)))


def command(plant: str, kind: str, n: int, level: float, rng: np.random.Generator) -> Array:
    """Return the command, or in closed loop what is added to the controller's part, in its unit."""
    if kind == "tone":
        return tone(plant, n, level, rng)
    if kind == "swings":
        return swings(plant, n, level, rng)
    shape = {
        "multisine": multisine, "steps": steps, "sweep": sweep, "noise": noise,
        "rare": rare, "slow": slow, "broadband": broadband,
    }  # fmt: skip
    make = shape.get(kind, multisine if rng.random() < 0.5 else noise)
    return AMPLITUDE[plant] * level * make(n, BAND[plant], rng)
