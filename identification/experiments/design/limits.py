"""What an amplifier and its load stand, and whether a signal stays within it between samples too.

Between samples the course is the one the signal states. Band-limited: the Fourier series of a
period (a record that does not repeat is mirrored at its ends), evaluated on a grid L > 2 n; a
trigonometric polynomial of degree n exceeds its largest sample there by at most the factor
``1 / cos(pi n / L)`` (Ehlich and Zeller, Math. Z. 86 (1964) 41), which is added, so what is said
to be within the limits is. Linear: corners are samples and chords have the slopes. Hold: any step
is infinitely steep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.errors import UnusableInput, require_known
from identification.experiments.design.signal import Signal

SLACK = 1e-9


@dataclass(frozen=True, slots=True)
class Check:
    """Whether a signal stays within an envelope; true or false as such.

    Parameters
    ----------
    low, high : float
        Bounds of the course, between samples too.
    slew : float
        Bound of its rate of change.
    complaints : tuple of str
        What leaves the envelope; empty if nothing does.
    """

    low: float
    high: float
    slew: float
    complaints: tuple[str, ...]

    def __bool__(self) -> bool:
        """Whether nothing leaves the envelope."""
        return not self.complaints

    def __str__(self) -> str:
        """One line in words."""
        if self:
            return f"within: {self.low:.4g} .. {self.high:.4g}, at most {self.slew:.4g}/s"
        return "; ".join(self.complaints)


@dataclass(frozen=True, slots=True)
class FittedSignal:
    """A signal made to fit, and what it took.

    Parameters
    ----------
    signal : Signal
    amplitude : float
        Factor on the course about its mean; 1 if untouched.
    slower : float
        Factor on the duration; 1 if untouched.
    """

    signal: Signal
    amplitude: float
    slower: float

    def __str__(self) -> str:
        """One line in words."""
        said = []
        if self.amplitude != 1.0:
            said.append(f"amplitude times {self.amplitude:.4g}")
        if self.slower != 1.0:
            said.append(f"{self.slower:.4g} times slower, {self.signal.rate:.6g} Hz")
        return f"{self.signal.name}: {' and '.join(said) or 'nothing had to change'}"


def extremes(signal: Signal) -> tuple[float, float, float]:
    """Return bounds of the course: lowest and highest value, steepest rate of change."""
    if signal.between != "band-limited":
        x = signal.values
        steps = np.abs(np.diff(np.append(x, x[0]) if signal.period else x))
        jump = float(steps.max(initial=0.0))
        steep = jump * signal.rate
        if signal.between == "hold":
            steep = np.inf if jump > 0.0 else 0.0
        return float(x.min()), float(x.max()), steep
    x = signal.one_period
    if signal.period == 0:
        x = np.concatenate([x, x[-2:0:-1]])
    n = x.size
    spectrum = rfft(x)
    if n % 2 == 0:
        spectrum[-1] *= 0.5  # half of it is its own mirror image
    content = np.flatnonzero(np.abs(spectrum[1:]) > 1e-9 * np.abs(spectrum[1:]).max(initial=0.0))
    degree = int(content[-1]) + 1 if content.size else 1
    size = next_fast_len(max(64 * degree if signal.period else 32 * degree, 2 * n), real=True)
    beyond = 1.0 / np.cos(np.pi * degree / size)
    fine = irfft(spectrum, size) * (size / n)
    omega = 2.0 * np.pi * np.arange(spectrum.size) * signal.rate / n
    steep = float(np.abs(irfft(1j * omega * spectrum, size)).max()) * (size / n) * beyond
    centre, half = 0.5 * (fine.max() + fine.min()), 0.5 * (fine.max() - fine.min()) * beyond
    return float(centre - half), float(centre + half), steep


def within(signal: Signal, envelope: DriveLimits) -> Check:
    """Check a signal against an envelope, between samples too."""
    low, high, slew = extremes(signal)
    slack = SLACK * (abs(low) + abs(high))
    said = []
    if low < envelope.low - slack or high > envelope.high + slack:
        said.append(
            f"{signal.name}: {low:.4g} .. {high:.4g} {signal.unit} leaves {envelope.low:g} .. "
            f"{envelope.high:g} {signal.unit}; lower the amplitude or move the bias"
        )
    if slew > envelope.steepest * (1.0 + SLACK):
        said.append(_too_steep(signal, envelope, slew))
    return Check(low, high, slew, tuple(said))


def _too_steep(signal: Signal, envelope: DriveLimits, slew: float) -> str:
    if not np.isfinite(slew):
        return (
            f"{signal.name}: held samples jump, and no finite slew of "
            f"{envelope.steepest:.4g} {signal.unit}/s follows; give the steps a rise"
        )
    asks = f"{slew:.4g} {signal.unit}/s"
    if envelope.capacitance and slew * envelope.capacitance > envelope.current:
        asks += f", {1e3 * slew * envelope.capacitance:.4g} of {1e3 * envelope.current:.4g} mA"
    return (
        f"{signal.name}: {asks}, is {slew / envelope.steepest:.3g} times too steep; lower the "
        "amplitude or the frequencies"
    )


def fitted(
    signal: Signal, envelope: DriveLimits, by: str = "amplitude", *, bias: float | None = None
) -> FittedSignal:
    """Scale or slow a signal until it fits; it is never made larger or faster.

    Parameters
    ----------
    signal : Signal
    envelope : DriveLimits
    by : {"amplitude", "frequency"}
        What yields to the slew limit: the amplitude, or the rate at which the samples are played.
        The range is always kept by the amplitude.
    bias : float, optional
        Mean to take; the signal's own if not given.

    Raises
    ------
    UnusableInput
        If the mean lies outside, or held samples jump while the slew is limited.
    """
    require_known("way to fit", "fitted", ("amplitude", "frequency"), by)
    moved = signal if bias is None else signal.moved(bias)
    low, high, slew = extremes(moved)
    middle = moved.bias
    if not np.isfinite(slew) and np.isfinite(envelope.steepest):
        raise UnusableInput(_too_steep(moved, envelope, slew))
    if not envelope.low < middle < envelope.high:
        raise UnusableInput(
            f"{signal.name}: its mean of {middle:.4g} {signal.unit} leaves no room within "
            f"{envelope.low:g} .. {envelope.high:g} {signal.unit}; give bias="
        )
    up = (envelope.high - middle) / (high - middle) if high > middle else np.inf
    down = (middle - envelope.low) / (middle - low) if low < middle else np.inf
    amplitude = min(1.0, up, down)
    slower = 1.0
    ratio = slew * amplitude / envelope.steepest if slew > 0.0 else 0.0
    if ratio > 1.0:
        if by == "amplitude":
            amplitude /= ratio
        else:
            slower = ratio
    result = moved if amplitude == 1.0 else moved.scaled(amplitude)
    return FittedSignal(result if slower == 1.0 else result.slowed(slower), amplitude, slower)
