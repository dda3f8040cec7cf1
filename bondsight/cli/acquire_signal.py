"""The waveform of a take, from what the user types."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuators.stack.excitation import loading_ramp
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, real_number
from bondsight.cli.target import only_channel
from hardware.envelope import Envelope, allowed_share
from identification.experiments.design import (
    demagnetise,
    multisine,
    reversal_curves,
    staircase,
    through,
)
from identification.experiments.design.take import session_signal

RATE = 10e3
"""Of a signal that has none of its own (Hz)."""

MOST = 2e7
"""Samples of a signal; ten times what a patient person records."""

COUNTED = ("session", "sine", "triangle", "multisine")
"""Signals whose length is the number of samples that is asked for."""

HASTE = 1.1
"""How much faster than asked for a player of a card may run to catch up."""


def waveform(
    text: str, rate: float | None, samples: int, envelope: Envelope, seed: int
) -> tuple[FloatArray, float]:
    """Return the voltages (V, (N,)) of a signal, and their rate (Hz).

    Parameters
    ----------
    text : str
        ``KIND:NUMBERS``, see `SHAPES`; or a file.
    rate : float, optional
        Hz; by default that of a file with a time of its own, else `RATE`.
    samples : int
        Length; files, demagnetisations, ramps, staircases and reversals have their own. Without
        LOW:HIGH the others become as small as the steps between samples have to be.
    envelope : Envelope
        Limits.
    seed : int
        Of a drawn signal.

    Raises
    ------
    UnusableInput
        The text is no signal.
    """
    kind, _, rest = text.partition(":")
    limits = envelope.limits
    if rate is not None and not (math.isfinite(rate) and rate > 0.0):
        raise UnusableInput(f"--rate {rate:g}: give a positive number of samples a second")
    hz = RATE if rate is None else rate
    if kind in COUNTED and samples > MOST:
        raise UnusableInput(f"--samples {samples}: give at most {MOST:g} of --signal {kind}")
    if kind == "session" and not rest:
        return session_signal(hz, samples, limits, seed=seed).values, hz
    if kind in SHAPES:
        wanted, made = SHAPES[kind]
        numbers, low, high = _numbers(text, rest, wanted, limits)
        asked = _Asked(text, hz, samples, low, high, limits, seed)
        volts = made(asked, *numbers)
        if kind in COUNTED and len(rest.split(":")) == len(wanted):
            volts = _fitted(asked, volts, envelope, 0.5 if kind == "multisine" else 0.0)
        return volts, hz
    if kind == "demagnetise":
        bias = 0.5 * (envelope.v_min + envelope.v_max)
        bias = real_number("--signal demagnetise", rest) if rest else bias
        return _decay(f"--signal demagnetise:{bias:g}", bias, hz, envelope), hz
    if Path(text).exists() or Path(text).suffix:
        return _from_file(Path(text), rate)
    known = ", ".join(":".join((k, *names)) for k, (names, _) in SHAPES.items())
    raise UnusableInput(
        f"--signal {text}: is no signal; give session, {known} (each may end with :LOW:HIGH), "
        "demagnetise:VOLTS, or a file with one channel in V"
    )


def _fitted(a: _Asked, volts: FloatArray, envelope: Envelope, place: float) -> FloatArray:
    """Make a signal of no size of its own so small that its steps are allowed.

    What stays is the voltage at this share of the range: the middle, or the lowest.
    """
    share = allowed_share(envelope, volts, a.rate, HASTE)
    kept = a.low + place * a.span
    return volts if share == 1.0 else kept + share * (1.0 - 1e-9) * (volts - kept)


def erasure(volts: float, rate: float, envelope: Envelope) -> FloatArray:
    """Return the decay around `volts` that goes before a take (V, (N,)), at `rate` (Hz).

    Raises
    ------
    UnusableInput
        There is no room for it in the envelope.
    """
    return _decay(f"--erase {volts:g}", volts, rate, envelope)


@dataclass(frozen=True, slots=True)
class _Asked:
    """What every shape is drawn from: the user's text, Hz, samples, V."""

    text: str
    rate: float
    samples: int
    low: float
    high: float
    limits: DriveLimits
    seed: int

    @property
    def span(self) -> float:
        return self.high - self.low

    def refuse(self, why: str) -> UnusableInput:
        return UnusableInput(f"--signal {self.text}: {why}")

    def count(self, value: float, what: str) -> int:
        if not (value >= 1.0 and value == round(value)):
            raise self.refuse(f"{value:g} is no number of {what}; give a whole number from 1 on")
        return int(value)

    def below_half(self, frequency: float) -> float:
        if not 0.0 < frequency < 0.5 * self.rate:
            raise self.refuse(
                f"{frequency:g} Hz does not fit a rate of {self.rate:g} Hz; stay below half"
            )
        return frequency

    def within(self, seconds: float) -> float:
        if not 0.0 < seconds * self.rate <= MOST:
            raise self.refuse(
                f"{seconds:.4g} s are {seconds * self.rate:.4g} samples; give 1 to {MOST:g}"
            )
        return seconds


def _numbers(
    text: str, rest: str, wanted: tuple[str, ...], limits: DriveLimits
) -> tuple[list[float], float, float]:
    """Return what a shape asks for, and the voltages between which it goes."""
    parts = rest.split(":")
    n = len(wanted)
    if len(parts) not in (n, n + 2) or not all(parts):
        form = ":".join((text.partition(":")[0], *wanted))
        raise UnusableInput(f"--signal {text}: write {form} or {form}:LOW:HIGH")
    values = [real_number(f"--signal {text}", p) for p in parts]
    low, high = values[n:] or (limits.low, limits.high)
    if not high > low:
        raise UnusableInput(f"--signal {text}: {high:g} V is not above {low:g} V")
    return values[:n], low, high


def _sine(a: _Asked, frequency: float) -> FloatArray:
    """From the lowest voltage, where an actuator rests."""
    t = np.arange(a.samples) / a.rate
    swing = 1.0 - np.cos(2.0 * np.pi * a.below_half(frequency) * t)
    return np.asarray(a.low + 0.5 * a.span * swing)


def _hold(a: _Asked, seconds: float, volts: float) -> FloatArray:
    """Stay at one voltage, while somebody loads the actuator."""
    return np.full(max(2, round(a.within(seconds) * a.rate)), volts)


def _ramp(a: _Asked, seconds: float) -> FloatArray:
    """Go up once: the loading curve of the thesis (section 6.2)."""
    return loading_ramp(a.low, a.high, a.within(seconds), a.rate).volt


def _triangle(a: _Asked, frequency: float) -> FloatArray:
    slew = 2.0 * a.span * a.below_half(frequency)
    points = [a.low, *(a.high, a.low) * math.ceil(a.samples * frequency / a.rate)]
    return through(points, a.rate, slew=slew).values[: a.samples]


def _staircase(a: _Asked, steps: float, dwell: float) -> FloatArray:
    """Go up and down again, each step at half of what the limits allow."""
    n = a.count(steps, "steps")
    a.within((2 * n + 1) * dwell)
    up = np.linspace(a.low, a.high, n + 1)
    rise = 2.0 * a.span / n / a.limits.steepest
    return staircase(a.rate, dwell, [*up, *up[-2::-1]], rise=rise).values


def _multisine(a: _Asked, lowest: float, highest: float) -> FloatArray:
    """Lines of one record, random phases, around the middle."""
    return multisine(
        a.rate, a.samples, band=(lowest, highest), peak=0.5 * a.span, bias=a.low + 0.5 * a.span,
        seed=a.seed,
    ).values  # fmt: skip


def _reversals(a: _Asked, curves: float, slew: float) -> FloatArray:
    """First-order reversal curves from the highest voltage."""
    n = a.count(curves, "curves")
    if not slew > 0.0:
        raise a.refuse(f"{slew:g} V/s goes nowhere; give more than 0")
    a.within((2 * n + 1) * a.span / slew)
    return reversal_curves(a.high, n, a.rate, slew=slew, lowest=a.low, start=a.low).values


SHAPES: Mapping[str, tuple[tuple[str, ...], Callable[..., FloatArray]]] = {
    "hold": (("SECONDS", "VOLTS"), _hold),
    "sine": (("HZ",), _sine),
    "ramp": (("SECONDS",), _ramp),
    "triangle": (("HZ",), _triangle),
    "staircase": (("STEPS", "SECONDS"), _staircase),
    "multisine": (("LOWEST_HZ", "HIGHEST_HZ"), _multisine),
    "reversals": (("CURVES", "VOLTS_A_SECOND"), _reversals),
}
"""Signals by name: the numbers they take, behind which ``LOW:HIGH`` (V) may follow."""


def _decay(asked: str, bias: float, rate: float, envelope: Envelope) -> FloatArray:
    low, high = envelope.v_min, envelope.v_max
    room = min(bias - low, high - bias)
    if not room > 0.0:
        raise UnusableInput(
            f"{asked}: is outside of {low:g} .. {high:g} V; give a voltage between them"
        )
    thresholds = [share * room for share in (0.1, 0.2, 0.4, 0.8)]
    return demagnetise(thresholds, bias, rate, envelope=envelope.limits, start=envelope.safe).values


def _from_file(file: Path, rate: float | None) -> tuple[FloatArray, float]:
    """Return the one voltage of a file; its own time decides the rate where it has one."""
    try:
        recording = Recording.read(file)
    except UnusableInput:
        if rate is None:
            raise
        # no time in it: the user's rate makes one
        recording = Recording.read(file, fs=rate)
    if rate is not None and abs(recording.fs / rate - 1.0) > 1e-6:
        raise UnusableInput(
            f"{file.name}: was sampled at {recording.fs:.6g} Hz, not {rate:g}; leave --rate "
            "out to play it as it is"
        )
    return only_channel(recording, "V", file.name), recording.fs
