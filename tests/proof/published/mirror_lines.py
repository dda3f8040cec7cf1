"""Periodic records of the steering mirror as spectra on their excited lines.

Sizes: K lines, 3 actuators, 3 sensors, N samples of a period.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]

INPUTS = ("u1", "u2", "u3")
OUTPUTS = ("y1", "y2", "y3")
MICRO = 1e6
"""Displacements are fitted in micrometres, so that all parameters are of moderate size."""

FLOOR = 0.01
"""What the model is not asked to reach: 1 % of a channel, spread over the lines."""


@dataclass(frozen=True, slots=True)
class Lines:
    """The excited lines ``first .. last`` of a period.

    Attributes
    ----------
    samples : int
        N, of one period.
    rate : float
        Samples a second.
    first, last : int
        Numbers of the lines, last included.
    oversampling : int
        Samples in time for each recorded one, where laws with memory are run.
    """

    samples: int
    rate: float
    first: int
    last: int
    oversampling: int = 2

    @property
    def count(self) -> int:
        """K."""
        return self.last - self.first + 1

    @property
    def s(self) -> ComplexArray:
        """Laplace variable on the lines, shape (K,), rad/s."""
        k = np.arange(self.first, self.last + 1)
        return 2j * np.pi * k * self.rate / self.samples

    @property
    def instants(self) -> int:
        """Samples in time."""
        return self.samples * self.oversampling

    def in_time(self, spectrum: ComplexArray) -> NDArray[np.floating]:
        """Return one period, shape (..., instants), of a spectrum, shape (..., K)."""
        full = np.zeros((*spectrum.shape[:-1], self.instants // 2 + 1), spectrum.dtype)
        full[..., self.first : self.last + 1] = spectrum
        made: NDArray[np.floating] = fft.irfft(full, self.instants, axis=-1, norm="forward")
        return made

    def on_lines(self, period: NDArray[np.floating]) -> ComplexArray:
        """Return the spectrum on the lines, shape (..., K), of a period, (..., samples)."""
        made: ComplexArray = fft.rfft(period, axis=-1, norm="forward")
        return made[..., self.first : self.last + 1]


@dataclass(frozen=True, slots=True, eq=False)
class Spectra:
    """One realisation, averaged over its periods.

    Attributes
    ----------
    name : str
    level : float
        Root mean square of the commands, V.
    u : ndarray, shape (3, K), V
    y : ndarray, shape (3, K), um
    noise : ndarray, shape (3, K), um^2
        Variance of `y` by what changes from period to period, smoothed over lines.
    weight : ndarray, shape (3, K), 1/um^2
        For least squares: one over `noise` and a floor of 1 % of the channel.
    """

    name: str
    level: float
    u: ComplexArray
    y: ComplexArray
    noise: FloatArray
    weight: FloatArray


def smoothed(values: FloatArray, width: int = 25) -> FloatArray:
    """Return the moving average along the last axis, edges continued."""
    pad = [(0, 0)] * (values.ndim - 1) + [(width // 2, width // 2)]
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, pad, mode="edge"), width, -1)
    made: FloatArray = windows.mean(-1)
    return made


def total_rms(spectrum: ComplexArray) -> FloatArray:
    """Root mean square in time of a one-sided spectrum, over the last axis."""
    made: FloatArray = np.sqrt(2.0 * (np.abs(spectrum) ** 2).sum(-1))
    return made


def spectra(recording: Recording, lines: Lines) -> Spectra:
    """Return the lines of a settled record of whole periods.

    Raises
    ------
    UnusableInput
        If the record does not hold two or more whole periods: without them nothing tells noise
        from what repeats.
    """
    periods = recording.n // lines.samples
    if periods < 2 or periods * lines.samples != recording.n:
        raise UnusableInput(
            f"{recording.name}: {recording.n} samples are not two or more periods of "
            f"{lines.samples}; give whole settled periods"
        )

    def split(names: Sequence[str], scale: float) -> ComplexArray:
        rows = np.stack([recording.channels[n].reshape(periods, -1) for n in names])
        made: ComplexArray = lines.on_lines(scale * rows).astype(complex)
        return made

    u, y = split(INPUTS, 1.0).mean(1), split(OUTPUTS, MICRO)
    mean = y.mean(1)
    spread = (np.abs(y - mean[:, None]) ** 2).sum(1) / (periods - 1) / periods
    noise = smoothed(spread)
    floor = (FLOOR * total_rms(mean)) ** 2 / (2 * lines.count)
    level = float(np.sqrt((total_rms(u) ** 2).mean()))
    return Spectra(recording.name, level, u, mean, noise, 1.0 / (noise + floor[:, None]))
