"""Judgement of single commands: a jump now, or a ramp."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.signals.quantity import engineering
from hardware.envelope.limits import ROUNDING, Converter, Envelope
from hardware.envelope.plain_numbers import finite_number
from hardware.errors import LimitViolation


def check_set(
    envelope: Envelope,
    present: float,
    volts: float,
    since_last: float | None = None,
    *,
    converter: Converter | None = None,
    held: Sequence[float] = (),
) -> None:
    """Refuse a jump that the envelope does not allow.

    Parameters
    ----------
    envelope : Envelope
    present : float
        Voltage now (V).
    volts : float
        Voltage wanted (V).
    since_last : float, optional
        Time since the command before (s); None if there was none.
    converter : Converter, optional
        What the device can produce.
    held : sequence of float
        For every dwell of the envelope, how long it has been exceeded already (s).

    Raises
    ------
    LimitViolation
        Which limit, by how much, and what to try.
    """
    volts = finite_number(volts, "set")
    present = finite_number(present, "set: the present voltage")
    check_range(envelope, volts, "set", converter)
    if since_last is not None and not since_last >= envelope.update_period * (1.0 - ROUNDING):
        raise LimitViolation(
            f"set({volts:g}): {engineering(since_last, 's')} after the command before, allowed "
            f"is {engineering(envelope.update_period, 's')}; wait, or play a waveform"
        )
    step = abs(volts - present)
    largest = envelope.largest_step(present, volts)
    if step > largest + envelope.slack:
        reason = _reason(envelope, present, volts)
        raise LimitViolation(
            f"set({volts:g}): a step of {step:g} V from {present:g} V exceeds the {largest:.3g} V "
            f"that {reason} allows within {engineering(envelope.update_period, 's')}; "
            f"ramp({volts:g}) takes {engineering(envelope.ramp_time(present, volts), 's')}"
        )
    held = held or (0.0,) * len(envelope.dwell)
    for dwell, seconds in zip(envelope.dwell, held, strict=True):
        if seconds > dwell.seconds * (1.0 + ROUNDING) and envelope.is_beyond(dwell, volts):
            raise LimitViolation(
                f"set({volts:g}): beyond {dwell.level:g} V for {engineering(seconds, 's')}, "
                f"allowed are {engineering(dwell.seconds, 's')}; go back behind {dwell.level:g} V"
            )


def nearest(envelope: Envelope, present: float, volts: float, limits: tuple[float, float]) -> float:
    """Return the voltage (V) next to a wanted one that a single command may reach.

    Parameters
    ----------
    envelope : Envelope
    present, volts : float
        Now and wanted (V), finite.
    limits : tuple of float
        Lowest and highest voltage of envelope and converter (V).
    """
    target = min(max(volts, limits[0]), limits[1])
    largest = envelope.largest_step(present, target)
    return min(max(target, present - largest), present + largest)


def check_range(
    envelope: Envelope, volts: float, what: str, converter: Converter | None = None
) -> None:
    """Refuse a voltage (V) that actuator or converter do not have."""
    if volts > envelope.v_max + envelope.slack:
        _outside(volts, what, volts - envelope.v_max, "above v_max", envelope.v_max)
    if volts < envelope.v_min - envelope.slack:
        _outside(volts, what, envelope.v_min - volts, "below v_min", envelope.v_min)
    if converter is not None:
        if volts > converter.v_max + envelope.slack:
            _outside(volts, what, volts - converter.v_max, "above the converter's", converter.v_max)
        if volts < converter.v_min - envelope.slack:
            _outside(volts, what, converter.v_min - volts, "below the converter's", converter.v_min)


def check_ramp(
    envelope: Envelope,
    present: float,
    volts: float,
    rate: float | None = None,
    *,
    converter: Converter | None = None,
    held: Sequence[float] = (),
) -> float:
    """Return the rate (V/s) of a ramp that the envelope allows, or refuse it.

    Parameters are those of `check_set`; `rate` in V/s, by default the gentle one.

    Raises
    ------
    LimitViolation
        Target outside, too fast, or so slow that it stays beyond a dwell's level for too long.
    """
    volts = finite_number(volts, "ramp")
    check_range(envelope, volts, "ramp", converter)
    speed = envelope.ramp_rate if rate is None else finite_number(rate, "ramp: rate")
    fastest = envelope.fastest(present, volts)
    if speed <= 0.0:
        raise LimitViolation(f"ramp({volts:g}): a rate of {speed:g} V/s never arrives; give > 0")
    if speed > fastest * (1.0 + ROUNDING):
        raise LimitViolation(
            f"ramp({volts:g}): {engineering(speed, 'V/s')} is faster than the "
            f"{engineering(fastest, 'V/s')} that {_reason(envelope, present, volts)} allows; "
            f"without a rate it takes {engineering(envelope.ramp_time(present, volts), 's')}"
        )
    held = held or (0.0,) * len(envelope.dwell)
    for dwell, already in zip(envelope.dwell, held, strict=True):
        # leaving is always allowed, however slowly
        if not envelope.is_beyond(dwell, volts):
            continue
        begin = present if envelope.is_beyond(dwell, present) else dwell.level
        spent = already + abs(volts - begin) / speed
        if spent > dwell.seconds * (1.0 + ROUNDING):
            raise LimitViolation(
                f"ramp({volts:g}): would spend {engineering(spent, 's')} beyond {dwell.level:g} V, "
                f"allowed are {engineering(dwell.seconds, 's')}; ramp faster or stay behind it"
            )
    return speed


def _reason(envelope: Envelope, before: float, after: float) -> str:
    if (
        envelope.curve is None
        or envelope.i_max is None
        or envelope.fastest(before, after) == envelope.slew
    ):
        return f"slew {engineering(envelope.slew, 'V/s')}"
    worst = envelope.curve.worst(before, after)
    return f"{engineering(envelope.i_max, 'A')} into {engineering(worst, 'F')}"


def _outside(volts: float, what: str, excess: float, side: str, limit: float) -> None:
    raise LimitViolation(
        f"{what}({volts:g}): {excess:.3g} V {side} {limit:g} V; nothing was sent, the nearest "
        f"allowed is {what}({limit:g})"
    )
