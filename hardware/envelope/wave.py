"""Judgement of whole waveforms, before any of it is sent."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.signals.quantity import engineering
from bondgraph.support.arrays import FloatArray as Array
from hardware.envelope.content import above, dominant
from hardware.envelope.limits import ROUNDING, Converter, Envelope
from hardware.envelope.plain_numbers import finite_number, finite_wave
from hardware.envelope.runs import lead, longest
from hardware.errors import LimitViolation


def check_wave(
    envelope: Envelope,
    volts: ArrayLike,
    rate: float,
    start: float | None = None,
    end: float | None = None,
    *,
    converter: Converter | None = None,
    held: Sequence[float] = (),
    haste: float = 1.0,
) -> None:
    """Refuse a waveform that leaves the envelope anywhere.

    Parameters
    ----------
    envelope : Envelope
    volts : array_like
        (n,), voltages at the actuator (V), each held for ``1 / rate``.
    rate : float
        Hz.
    start, end : float, optional
        Voltage before the first and after the last sample (V): the jumps there count too. For a
        waveform that repeats, `end` is its first sample. None: not judged.
    converter : Converter, optional
        What the device can produce.
    held : sequence of float
        For every dwell of the envelope, how long it has been exceeded before the start (s).
    haste : float
        How much faster the player may run to catch up; only what is advised allows for it.

    Raises
    ------
    LimitViolation
        Which limit, at which sample and time, by how much, and what to try.

    Examples
    --------
    >>> from hardware import P840_1_UNIPOLAR, LimitViolation
    >>> try:
    ...     check_wave(P840_1_UNIPOLAR, np.array([0.0, 50.0, 120.0]), rate=10e3)
    ... except LimitViolation as refusal:
    ...     print(refusal)
    wave: 120 V at sample 2 (200 us) is 20 V outside the limits 0 .. 100 V (1 of 3 ...
    """
    wave = finite_wave(volts, "wave")
    rate = finite_number(rate, "wave: rate")
    if not rate > 0.0:
        raise LimitViolation(f"wave: a rate of {rate:g} Hz; give a positive one")
    _check_range(envelope, wave, rate, converter)
    _check_steps(envelope, wave, rate, haste)
    if start is not None:
        check_join(envelope, finite_number(start, "wave: start"), float(wave[0]), rate, "entry")
    if end is not None:
        check_join(envelope, float(wave[-1]), finite_number(end, "wave: end"), rate, "exit")
    _check_content(envelope, wave, rate)
    _check_dwell(envelope, wave, rate, held)


def check_join(envelope: Envelope, before: float, after: float, rate: float, what: str) -> None:
    """Refuse a jump (V) into a waveform (`what` is ``"entry"``) or out of it (``"exit"``)."""
    largest = envelope.fastest(before, after) * _duration(envelope, rate)
    if abs(after - before) > largest + envelope.slack:
        advice = f"ramp({after:g}) first" if what == "entry" else "add samples that lead there"
        raise LimitViolation(
            f"wave, {what}: the step from {before:g} V to {after:g} V exceeds the {largest:.3g} V "
            f"allowed at once; {advice} ({engineering(envelope.ramp_time(before, after), 's')})"
        )


def _duration(envelope: Envelope, rate: float) -> float:
    """Return the time in which a jump of a waveform is taken to happen (s)."""
    return min(1.0 / rate, envelope.update_period)


def _check_range(envelope: Envelope, wave: Array, rate: float, converter: Converter | None) -> None:
    low, high, whose = envelope.v_min, envelope.v_max, "limits"
    if converter is not None:
        if converter.rate_max is not None and rate > converter.rate_max * (1.0 + ROUNDING):
            raise LimitViolation(
                f"wave: {engineering(rate, 'Hz')} is faster than the converter's "
                f"{engineering(converter.rate_max, 'Hz')}; resample the waveform"
            )
        if converter.v_min > low or converter.v_max < high:
            low, high = max(low, converter.v_min), min(high, converter.v_max)
            whose = "limits (with the converter's own range)"
    lowest, highest = float(wave.min()), float(wave.max())
    if lowest < low - envelope.slack or highest > high + envelope.slack:
        outside = np.flatnonzero((wave < low - envelope.slack) | (wave > high + envelope.slack))
        first = int(outside[0])
        excess = max(low - wave[first], wave[first] - high)
        raise LimitViolation(
            f"wave: {wave[first]:g} V at {_where(first, rate)} is {excess:.3g} V outside the "
            f"{whose} {low:g} .. {high:g} V ({outside.size} of {wave.size} samples, range "
            f"{lowest:g} .. {highest:g} V); {_fitting(low, high, lowest, highest)}"
        )
    if converter is not None and 0.0 < highest - lowest < converter.resolution:
        raise LimitViolation(
            f"wave: {engineering(highest - lowest, 'V')} peak to peak is less than one step of the "
            f"converter ({engineering(converter.resolution, 'V')}); enlarge it or send a constant"
        )


def _fitting(low: float, high: float, lowest: float, highest: float) -> str:
    if highest - lowest <= high - low:
        return f"shift it by {low - lowest if lowest < low else high - highest:+.4g} V"
    return f"its {highest - lowest:g} V peak to peak must become {high - low:g} V or less"


def _check_steps(envelope: Envelope, wave: Array, rate: float, haste: float) -> None:
    """Refuse jumps between samples that are too fast or need too much current."""
    if wave.size < 2:
        return
    duration = _duration(envelope, rate)
    steps = np.abs(np.diff(wave))
    largest = float(steps.max())
    allowed = envelope.slew * duration
    if largest > allowed + envelope.slack:
        k = int(np.argmax(steps > allowed + envelope.slack))
        raise LimitViolation(
            f"wave: the step to {_where(k + 1, rate)} is {engineering(float(steps[k]), 'V')} in "
            f"{engineering(duration, 's')}, {engineering(float(steps[k]) / duration, 'V/s')} "
            f"against slew {engineering(envelope.slew, 'V/s')}; "
            + _advice(envelope, wave, rate, haste)
        )
    curve, i_max = envelope.curve, envelope.i_max
    if curve is None or i_max is None:
        return
    charge = i_max * duration
    # almost every waveform passes with the largest capacitance everywhere
    if curve.largest * (largest - envelope.slack) <= charge:
        return
    suspects = np.flatnonzero(curve.largest * (steps - envelope.slack) > charge)
    worst = curve.worst_of_each(wave[suspects], wave[suspects + 1])
    excess = steps[suspects] > charge / worst + envelope.slack
    if not excess.any():
        return
    first = int(np.argmax(excess))
    k = int(suspects[first])
    current = worst * steps[suspects] / duration
    raise LimitViolation(
        f"wave: the step to {_where(k + 1, rate)} needs {engineering(float(current[first]), 'A')} "
        f"into {engineering(float(worst[first]), 'F')}, allowed are {engineering(i_max, 'A')}; "
        + _advice(envelope, wave, rate, haste)
    )


def _advice(envelope: Envelope, wave: Array, rate: float, haste: float) -> str:
    """Say how large or how slow a waveform may be whose steps are too large."""
    size = allowed_share(envelope, wave, rate, haste) * float(wave.max() - wave.min())
    frequency = dominant(wave, rate)
    at = "in this form" if frequency is None else f"at {engineering(frequency, 'Hz')}"
    factor = 1.0 / _steps_share(envelope, wave, rate, haste)
    slower = f"{_rounded(factor, up=True)} times slower"
    # beyond the update period a jump is no slower than before: only samples in between help
    if factor > haste * rate * envelope.update_period * (1.0 + ROUNDING):
        slower += " with more samples"
    return f"largest allowed {at} is {_rounded(size, up=False)} V peak to peak, or play it {slower}"


def allowed_share(envelope: Envelope, wave: ArrayLike, rate: float, haste: float = 1.0) -> float:
    """Return by how much a waveform has to be scaled so that its steps are allowed, at most 1.

    Parameters
    ----------
    envelope : Envelope
    wave : array_like
        (n,), voltages at the actuator (V).
    rate : float
        Hz.
    haste : float
        How much faster the player may run to catch up.
    """
    volts = np.asarray(wave, float)
    share = _steps_share(envelope, volts, rate, haste)
    if share == 1.0 or envelope.f_max is None or envelope.f_max >= rate / 2.0:
        return share
    content = float(above(volts, rate, envelope.f_max).max())
    allowed = envelope.f_share * (envelope.v_max - envelope.v_min)
    return min(share, allowed / content) if content > 0.0 else share


def _steps_share(envelope: Envelope, wave: Array, rate: float, haste: float) -> float:
    steps = np.abs(np.diff(wave))
    largest = float(steps.max(initial=0.0))
    if largest == 0.0:
        return 1.0
    duration = _duration(envelope, haste * rate)
    share = min(1.0, envelope.slew * duration / largest)
    curve, i_max = envelope.curve, envelope.i_max
    if curve is not None and i_max is not None:
        suspects = np.flatnonzero(curve.largest * steps > i_max * duration)
        if suspects.size:
            worst = curve.worst_of_each(wave[suspects], wave[suspects + 1])
            share = min(share, float(np.min(i_max * duration / (worst * steps[suspects]))))
    return share


def _rounded(number: float, *, up: bool) -> str:
    """Return three digits, rounded up or down so that what is advised works."""
    if not 0.0 < number < math.inf:
        return f"{number:g}"
    unit = 10.0 ** (math.floor(math.log10(number)) - 2)
    # what is a few roundings off counts as the number itself
    whole = math.ceil(number / unit - 1e-9) if up else math.floor(number / unit + 1e-9)
    return f"{whole * unit:.4g}"


def _check_content(envelope: Envelope, wave: Array, rate: float) -> None:
    if envelope.f_max is None or envelope.f_max >= rate / 2.0 or wave.size < 2:
        return
    allowed = envelope.f_share * (envelope.v_max - envelope.v_min)
    content = above(wave, rate, envelope.f_max)
    k = int(np.argmax(content))
    if content[k] > allowed + envelope.slack:
        frequency = dominant(wave, rate)
        advice = "smooth its corners"
        if frequency is not None and frequency > envelope.f_max:
            advice = f"its {engineering(frequency, 'Hz')} must become lower"
        raise LimitViolation(
            f"wave: content above {engineering(envelope.f_max, 'Hz')} reaches "
            f"{engineering(float(content[k]), 'V')} at {_where(k, rate)}, allowed are "
            f"{engineering(allowed, 'V')}; {advice}, or give it at most "
            f"{_rounded(allowed / float(content[k]) * float(np.ptp(wave)), up=False)} V peak "
            "to peak"
        )


def _check_dwell(envelope: Envelope, wave: Array, rate: float, held: Sequence[float]) -> None:
    before = held or (0.0,) * len(envelope.dwell)
    for dwell, already in zip(envelope.dwell, before, strict=True):
        beyond = wave > dwell.level if dwell.level > envelope.safe else wave < dwell.level
        carried = already + lead(beyond) / rate if beyond[0] else 0.0
        first, count = longest(beyond)
        seconds = count / rate
        if carried >= seconds:
            first, seconds = 0, carried
        if seconds > dwell.seconds * (1.0 + ROUNDING):
            side = "above" if dwell.level > envelope.safe else "below"
            added = f" (of these {engineering(already, 's')} before it)" if first == 0 else ""
            raise LimitViolation(
                f"wave: from {_where(first, rate)} on {engineering(seconds, 's')} {side} "
                f"{dwell.level:g} V{added if already else ''}, allowed are "
                f"{engineering(dwell.seconds, 's')}; play it faster, lower it, or rest in between"
            )


def _where(sample: int, rate: float) -> str:
    return f"sample {sample} ({engineering(sample / rate, 's')})"
