"""The waveform of a take, from what the user types."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput, real_number
from hardware.envelope import Envelope
from identification.experiments.design import demagnetise
from identification.experiments.design.take import session_signal

RATE = 10e3
"""Of a signal that has none of its own (Hz)."""

KINDS = "session, sine:HZ, sine:HZ:LOW:HIGH, demagnetise:VOLTS, or a file with one channel in V"


def waveform(
    text: str, rate: float | None, samples: int, envelope: Envelope, seed: int
) -> tuple[NDArray[np.float64], float]:
    """Return the voltages (V, (N,)) of a signal, and their rate (Hz).

    Parameters
    ----------
    text : str
        See `KINDS`.
    rate : float, optional
        Hz; by default that of a file with a time of its own, else `RATE`.
    samples : int
        Length; a file and a demagnetisation have their own.
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
    if kind == "session" and not rest:
        return session_signal(hz, samples, limits, seed=seed).values, hz
    if kind == "sine":
        return _sine(text, rest, hz, samples, limits), hz
    if kind == "demagnetise":
        bias = 0.5 * (envelope.v_min + envelope.v_max)
        bias = real_number("--signal demagnetise", rest) if rest else bias
        return _decay(f"--signal demagnetise:{bias:g}", bias, hz, envelope), hz
    if Path(text).exists() or Path(text).suffix:
        return _from_file(Path(text), rate)
    raise UnusableInput(f"--signal {text}: is no signal; give {KINDS}")


def erasure(volts: float, rate: float, envelope: Envelope) -> NDArray[np.float64]:
    """Return the decay around `volts` that goes before a take (V, (N,)), at `rate` (Hz).

    Raises
    ------
    UnusableInput
        There is no room for it in the envelope.
    """
    return _decay(f"--erase {volts:g}", volts, rate, envelope)


def _sine(
    text: str, rest: str, rate: float, samples: int, limits: DriveLimits
) -> NDArray[np.float64]:
    parts = rest.split(":")
    if len(parts) not in (1, 3) or not parts[0]:
        raise UnusableInput(f"--signal {text}: write sine:HZ or sine:HZ:LOW:HIGH")
    frequency, *ends = (real_number(f"--signal {text}", p) for p in parts)
    low, high = ends or (limits.low, limits.high)
    if not 0.0 < frequency < 0.5 * rate:
        raise UnusableInput(
            f"--signal {text}: {frequency:g} Hz does not fit a rate of {rate:g} Hz; stay below half"
        )
    t = np.arange(samples) / rate
    # it starts and ends at the lowest voltage, where an actuator rests
    return np.asarray(low + 0.5 * (high - low) * (1.0 - np.cos(2.0 * np.pi * frequency * t)))


def _decay(asked: str, bias: float, rate: float, envelope: Envelope) -> NDArray[np.float64]:
    low, high = envelope.v_min, envelope.v_max
    room = min(bias - low, high - bias)
    if not room > 0.0:
        raise UnusableInput(
            f"{asked}: is outside of {low:g} .. {high:g} V; give a voltage between them"
        )
    thresholds = [share * room for share in (0.1, 0.2, 0.4, 0.8)]
    return demagnetise(thresholds, bias, rate, envelope=envelope.limits, start=envelope.safe).values


def _from_file(file: Path, rate: float | None) -> tuple[NDArray[np.float64], float]:
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
    volts = [n for n in recording.channels if recording.units[n] == "V"]
    if len(volts) != 1:
        raise UnusableInput(
            f"{file.name}: has {len(volts)} channels in V ({', '.join(volts)}); leave one"
        )
    return np.asarray(recording[volts[0]]), recording.fs
