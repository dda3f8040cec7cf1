"""Memory of the mirror's actuators: plays and powers of the voltage and of the displacement.

Every term is centred: what it does at a typical amplitude on average is taken off, so that its
weight changes the linear part of the model little. Sizes: K lines, N samples of a period.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.hysteresis.plays.play import play_record
from tests.proof.published.mirror_lines import ComplexArray, FloatArray, Lines

RATE = 6e3
"""Unit of the rate of the voltage: rad/s times V."""

SWIFTNESS = 1.7
"""Typical rate over typical voltage, in `RATE`: a flat spectrum to 3 kHz."""

GAUSSIAN = 20_000
"""Samples of the noise that centres the terms."""


class Touched(NamedTuple):
    """What a small change of the displacement does to the terms, exactly, over one period.

    Attributes
    ----------
    last : ndarray of int, shape (3, plays, N)
        For each play the sample at which it last moved: the change of its output is the change of
        the input then.
    slopes : ndarray, shape (3, powers, N)
    """

    last: NDArray[np.intp]
    slopes: FloatArray


@dataclass(frozen=True)
class Terms:
    """Terms of one actuator's two laws; the same for all three, each with weights of its own.

    Parameters
    ----------
    of_voltage, of_rate, of_motion : tuple of float
        Thresholds of the plays: V, V times `RATE`, units of the displacement.
    voltage, motion : float
        Typical root mean square of the arguments, which centres the terms.
    """

    of_voltage: tuple[float, ...] = (0.06, 0.15, 0.3, 0.5, 0.8)
    of_rate: tuple[float, ...] = (0.1, 0.5)
    of_motion: tuple[float, ...] = (0.3, 0.8, 1.6)
    voltage: float = 0.22
    motion: float = 0.8

    @property
    def voltage_count(self) -> int:
        """Plays and square of the voltage, plays and signed square of its rate."""
        return len(self.of_voltage) + len(self.of_rate) + 2

    @property
    def count(self) -> int:
        """All terms of an actuator: of the voltage, then of the displacement."""
        return self.voltage_count + len(self.of_motion) + 2

    @cached_property
    def voltage_gains(self) -> FloatArray:
        """Mean gain of each play of the voltage."""
        return _mean_gains(self.of_voltage, self.voltage)

    @cached_property
    def rate_gains(self) -> FloatArray:
        """Mean gain of each play of the rate, and of its signed square."""
        size = SWIFTNESS * self.voltage
        return np.append(_mean_gains(self.of_rate, size), size * np.sqrt(8.0 / np.pi))

    @cached_property
    def motion_gains(self) -> FloatArray:
        """Mean gain of each play of the displacement, and of its cube."""
        return np.append(_mean_gains(self.of_motion, self.motion), 3.0 * self.motion**2)

    def voltage_terms(self, lines: Lines, u: ComplexArray) -> ComplexArray:
        """Return the spectra of the terms of the voltage, shape (3, terms, K)."""
        rows = []
        rates = np.asarray(lines.in_time(u * lines.s / RATE), float)
        for x, rate in zip(np.asarray(lines.in_time(u), float), rates, strict=True):
            plays = _settled(x, self.of_voltage) - self.voltage_gains[:, None] * x
            gains = self.rate_gains
            swift = _settled(rate, self.of_rate) - gains[:-1, None] * rate
            square = (np.abs(rate) - gains[-1]) * rate
            rows.append(lines.on_lines(np.vstack((plays, x**2, swift, square))))
        return np.asarray(np.stack(rows), complex)

    def motion_terms(self, lines: Lines, x: ComplexArray) -> ComplexArray:
        """Return the spectra of the terms of the displacement, shape (3, terms, K)."""
        rows = []
        for z in np.asarray(lines.in_time(x), float):
            gains = self.motion_gains
            plays = _settled(z, self.of_motion) - gains[:-1, None] * z
            rows.append(lines.on_lines(np.vstack((plays, z**2, z**3 - gains[-1] * z))))
        return np.asarray(np.stack(rows), complex)

    def touched(self, lines: Lines, x: ComplexArray) -> Touched:
        """Return how the terms of the displacement follow a small change of it."""
        last, slopes = [], []
        for z in np.asarray(lines.in_time(x), float):
            twice = np.concatenate((z, z))
            thresholds = np.asarray(self.of_motion)
            states = play_record(twice, thresholds, np.zeros(thresholds.size))
            moved = np.zeros(states.shape, bool)
            moved[1:] = states[1:] != states[:-1]
            at = np.where(moved, np.arange(twice.size)[:, None], 0)
            last.append(np.maximum.accumulate(at, axis=0)[z.size :].T % z.size)
            slopes.append(np.vstack((2.0 * z, 3.0 * z**2)))
        return Touched(np.stack(last), np.stack(slopes))

    def followed(
        self, lines: Lines, change: ComplexArray, touched: Touched, weights: FloatArray
    ) -> ComplexArray:
        """Return what changes of the displacements do to the sum of the terms.

        Parameters
        ----------
        change : ndarray, shape (D, 3, K)
        weights : ndarray, shape (3, count)

        Returns
        -------
        ndarray, shape (D, 3, K)
        """
        made, plays = np.empty_like(change), len(self.of_motion)
        for i, w in enumerate(weights[:, self.voltage_count :].astype(np.float32)):
            linear = w[plays:] @ touched.slopes[i].astype(np.float32)
            gains = self.motion_gains.astype(np.float32)
            linear -= w[:plays] @ gains[:-1] + w[-1] * gains[-1]
            for start in range(0, len(change), 32):
                part = slice(start, start + 32)
                x = lines.in_time(change[part, i].astype(np.complex64))
                total = linear * x
                for weight, at in zip(w, touched.last[i], strict=False):
                    total += weight * np.take(x, at, axis=1)
                made[part, i] = lines.on_lines(total)
        return made


def _settled(x: FloatArray, thresholds: tuple[float, ...]) -> FloatArray:
    """Plays over the second of two equal periods, shape (plays, N)."""
    r = np.asarray(thresholds)
    return play_record(np.concatenate((x, x)), r, np.zeros(r.size))[x.size :].T


def _mean_gains(thresholds: tuple[float, ...], size: float) -> FloatArray:
    """Gain of each play for noise of this root mean square, by least squares."""
    rng = np.random.default_rng(0)
    x = size * np.convolve(rng.standard_normal(GAUSSIAN), np.full(5, 5**-0.5), "same")
    made: FloatArray = _settled(x, thresholds) @ x / (x @ x)
    return made
