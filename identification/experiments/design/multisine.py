"""Multisines: full, odd, random odd with detection lines; orthogonal ones for several inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray, IntArray
from bondgraph.support.errors import UnusableInput, require_known
from identification.experiments.design.crest import course, crest_factor, phases_of
from identification.experiments.design.signal import Signal

KINDS = ("full", "odd", "random_odd")


def multisine(
    rate: float,
    period: int,
    *,
    band: tuple[float, float] | None = None,
    lines: Sequence[int] | None = None,
    kind: str = "full",
    rms: float | None = None,
    peak: float | None = None,
    shape: ArrayLike | None = None,
    phases: str = "random",
    periods: int = 1,
    bias: float = 0.0,
    group: int = 4,
    seed: int = 0,
    name: str = "u",
    unit: str = "V",
) -> Signal:
    """Return a sum of harmonic sines, band-limited between the samples.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    period : int
        Samples of one period; lines are multiples of ``rate / period``.
    band : (low, high), optional
        Hz; all lines in it are candidates (below the Nyquist rate if neither band nor lines).
    lines : sequence of int, optional
        Candidates in place of a band.
    kind : {"full", "odd", "random_odd"}
        Which candidates are excited: all; the odd ones; the odd ones less one of every `group`
        consecutive ones, drawn at random, the detection lines.
    rms, peak : float, optional
        Root mean square, or largest deviation from the bias, between samples too. Not both; an
        rms of 1 if neither.
    shape : array, optional
        Relative amplitudes of the excited lines, in their order; equal if not given.
    phases : {"random", "schroeder", "low_crest"}
        See `identification.experiments.design.crest`; random phases for a best linear
        approximation.
    periods : int
    bias : float
        Mean.
    group : int
        Odd lines of a group, at least 2.
    seed : int
        Of phases and detection lines.

    Raises
    ------
    UnusableInput
        If no line is left, a line lies beyond the Nyquist rate, or numbers contradict each other.

    Examples
    --------
    >>> s = multisine(1000.0, 500, band=(2.0, 80.0), kind="random_odd", peak=5.0)
    >>> s.kind, len(s.lines), len(s.detection), bool(abs(s.values).max() <= 5.0)
    ('random_odd multisine, random phases', 15, 5, True)
    """
    if rms is not None and peak is not None:
        raise UnusableInput("multisine: give rms or peak, not both")
    rng = np.random.default_rng(seed)
    excited, left_out = _lines(rate, period, band, lines, kind, group, rng)
    amplitudes = _amplitudes(shape, excited.size)
    phi = phases_of(phases, excited, amplitudes, rng)
    crest = crest_factor(excited, amplitudes, phi)
    size = (1.0 if rms is None else rms) if peak is None else peak / crest
    if not (np.isfinite(size) and size > 0.0) or periods < 1:
        raise UnusableInput("multisine: rms, peak and the number of periods must be positive")
    amplitudes = amplitudes * (size / np.sqrt(0.5 * np.sum(amplitudes**2)))
    one = bias + course(excited, amplitudes, phi, period)
    return _signal(
        np.tile(one, periods), rate, period, excited, left_out, name, unit,
        f"{kind} multisine, {phases.replace('_', ' ')} phases",
        f"crest factor {crest:.3f}, seed {seed}",
    )  # fmt: skip


def orthogonal_multisines(
    rate: float, period: int, inputs: Sequence[str], *, seed: int = 0, **options: Any
) -> tuple[tuple[Signal, ...], ...]:
    """Return as many realisations as inputs, each a signal for every input.

    At each line the inputs of realisation m are a row of the discrete Fourier matrix times one
    random phase an input, so their matrix is unitary up to scale and each response is found with
    the power of all realisations (Dobrowiecki and Schoukens, Automatica 43 (2007) 1488).

    Parameters
    ----------
    rate, period
        As in `multisine`.
    inputs : sequence of str
        Names of the sources.
    seed : int
        Of the phases and detection lines; another seed, another block of realisations.
    **options
        Of `multisine`, without phases, peak and name: the phases are random.
    """
    if {"phases", "name", "peak"} & set(options):
        raise UnusableInput("orthogonal multisines: phases are random; give rms and inputs")
    n = len(inputs)
    if n == 0:
        raise UnusableInput("orthogonal multisines: name at least one input")
    first = multisine(rate, period, seed=seed, **options)
    lines = np.asarray(first.lines)
    spectrum = np.fft.rfft(first.one_period)
    own = np.random.default_rng([seed, n]).uniform(0.0, 2.0 * np.pi, (n, lines.size))
    found = []
    for m in range(n):
        row = []
        for j, name in enumerate(inputs):
            turned = spectrum.copy()
            turned[lines] = np.abs(spectrum[lines]) * np.exp(1j * (own[j] + 2 * np.pi * m * j / n))
            values = np.tile(np.fft.irfft(turned, period), first.periods)
            note = f"realisation {m + 1} of {n}, orthogonal to the others, seed {seed}"
            row.append(replace(first, name=name, values=values, notes=(note,)))
        found.append(tuple(row))
    return tuple(found)


def _lines(
    rate: float,
    period: int,
    band: tuple[float, float] | None,
    lines: Sequence[int] | None,
    kind: str,
    group: int,
    rng: np.random.Generator,
) -> tuple[IntArray, IntArray]:
    """Excited lines and detection lines."""
    require_known("kind of multisine", "multisine", KINDS, kind)
    if not rate > 0.0 or period < 4:
        raise UnusableInput("multisine: rate must be positive, and a period at least 4 samples")
    if band is not None and lines is not None:
        raise UnusableInput("multisine: give band or lines, not both")
    last = (period - 1) // 2
    if lines is not None:
        at = np.unique(np.asarray(lines, np.intp))
    else:
        low, high = band if band is not None else (0.0, rate)
        k = np.arange(1, last + 1)
        f = k * rate / period
        at = k[(f >= low * (1 - 1e-12)) & (f <= high * (1 + 1e-12))]
    if kind != "full":
        at = at[at % 2 == 1]
    if at.size == 0:
        raise UnusableInput(
            f"multisine: no line of {rate / period:.4g} Hz spacing lies there; widen the band or "
            "lengthen the period"
        )
    if at[0] < 1 or at[-1] > last:
        raise UnusableInput(
            f"multisine: lines {at[0]} .. {at[-1]} must lie within 1 .. {last}, below the "
            "Nyquist rate"
        )
    if kind != "random_odd":
        return at, np.zeros(0, np.intp)
    if group < 2:
        raise UnusableInput("multisine: a group needs at least 2 odd lines")
    places = np.arange(0, at.size - at.size % group, group)
    places = places + rng.integers(0, group, places.size)
    held = np.zeros(at.size, bool)
    held[places] = True
    return at[~held], at[held]


def _amplitudes(shape: ArrayLike | None, count: int) -> FloatArray:
    if shape is None:
        return np.ones(count)
    found = np.asarray(shape, float)
    if found.shape != (count,) or not (np.isfinite(found).all() and (found > 0).all()):
        raise UnusableInput(f"multisine: shape must be {count} positive numbers, one a line")
    return found


def _signal(
    values: FloatArray, rate: float, period: int, lines: IntArray, held: IntArray,
    name: str, unit: str, kind: str, note: str,
) -> Signal:  # fmt: skip
    return Signal(
        name, np.arange(values.size) / rate, values, unit, kind, "band-limited", period,
        tuple(map(int, lines)), tuple(map(int, held)), notes=(note,),
    )  # fmt: skip
