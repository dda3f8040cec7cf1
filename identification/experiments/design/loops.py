"""Signals for memories: erase them, or walk through all their first-order reversal curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from actuators.stack.excitation import demagnetisation
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, require_known
from identification.experiments.design.signal import Signal


def demagnetise(
    thresholds: Sequence[float],
    bias: float,
    rate: float,
    *,
    frequency: float = 1.8,
    step: float | None = None,
    start: float = 0.0,
    envelope: DriveLimits | None = None,
    name: str = "u",
    unit: str = "V",
) -> Signal:
    """Return the decay around `bias` that erases plays of all `thresholds`.

    `actuators.stack.excitation.demagnetisation` as a signal; see there for what is left.

    Parameters
    ----------
    thresholds : sequence of float
        Half widths of the plays.
    bias : float
        Where the decay ends.
    rate : float
        Samples per second, Hz.
    frequency : float
        Of the half waves, Hz.
    step : float, optional
        Largest decrease from one turning point to the next; a tenth of the closest thresholds.
    start : float
        Value before the decay.
    envelope : DriveLimits, optional
        Limits; none if not given.
    """
    room = envelope if envelope is not None else DriveLimits()
    widest = 4.0 * (float(np.max(thresholds)) + abs(bias) + abs(start)) + 1.0
    limits = replace(room, low=max(room.low, -widest), high=min(room.high, widest))
    made = demagnetisation(
        thresholds, bias, step=step, start=start, frequency=frequency, rate=rate, limits=limits
    )
    half = round(0.5 * rate / frequency)
    return Signal(
        name, made.time, made.volt, unit, "demagnetisation", "linear",
        marks=tuple(range(0, made.time.size, half)), notes=(f"decays to {bias:g} {unit}",),
    )  # fmt: skip


def reversal_curves(
    saturation: float,
    reversals: Sequence[float] | int,
    rate: float,
    *,
    slew: float,
    lowest: float | None = None,
    start: float | None = None,
    course: str = "linear",
    dwell: float = 0.0,
    name: str = "u",
    unit: str = "V",
) -> Signal:
    """Return first-order reversal curves: from saturation down to each reversal, and up again.

    Each descent from saturation follows the same major branch, each ascent is one reversal
    curve, and the rise to saturation wipes the memory out before the next (Mayergoyz,
    Mathematical Models of Hysteresis (1991)). `Signal.marks` are the turning points in samples:
    the first arrival at saturation, then reversal and saturation by turns.

    Parameters
    ----------
    saturation : float
        Where every play has turned.
    reversals : sequence of float, or int
        Turning points below saturation; or so many, evenly spaced, down to `lowest`.
    rate : float
        Samples per second, Hz.
    slew : float
        Largest rate of change, units per second.
    lowest : float, optional
        Last of the evenly spaced reversals; the negative of saturation if not given.
    start : float, optional
        First value; the lowest reversal if not given.
    course : {"linear", "cosine"}
        Ramps of one speed, or half cosines that do not jump in speed (longer by pi / 2).
    dwell : float
        Rest at every turning point, s.

    Examples
    --------
    >>> s = reversal_curves(10.0, 4, 100.0, slew=50.0)
    >>> [float(s.values[m]) for m in s.marks][:4]
    [10.0, 5.0, 10.0, 0.0]
    """
    if isinstance(reversals, int):
        if reversals < 1:
            raise UnusableInput("reversal curves: at least one reversal is needed")
        end = -saturation if lowest is None else float(lowest)
        turns = np.linspace(saturation, end, reversals + 1)[1:]
    else:
        turns = np.asarray(reversals, float)
    if turns.size == 0 or not np.isfinite(turns).all() or not (turns < saturation).all():
        raise UnusableInput(
            f"reversal curves: every reversal must lie below the saturation of {saturation:g}"
        )
    first = float(turns.min()) if start is None else float(start)
    points = [first, saturation]
    for t in turns:
        points += [float(t), saturation]
    made = through(
        points, rate, slew=slew, course=course, dwell=dwell, name=name, unit=unit,
        kind="first-order reversal curves",
    )  # fmt: skip
    return replace(made, marks=made.marks[1:])


def through(
    points: Sequence[float],
    rate: float,
    *,
    slew: float,
    course: str = "linear",
    dwell: float = 0.0,
    name: str = "u",
    unit: str = "V",
    kind: str = "turning points",
) -> Signal:
    """Return a course through given turning points, no faster than `slew`; marks are the points.

    Each way takes the fewest whole samples that keep the slew limit, so turning points are
    samples. Parameters as in `reversal_curves`.
    """
    require_known("course", kind, ("linear", "cosine"), course)
    at = np.asarray(points, float)
    if at.size < 2 or not slew > 0.0 or not rate > 0.0 or dwell < 0.0:
        raise UnusableInput(f"{kind}: needs two points, a positive slew and rate, and dwell >= 0")
    steeper = 0.5 * np.pi if course == "cosine" else 1.0
    rest = round(dwell * rate)
    values: list[FloatArray] = [at[:1]]
    marks, filled = [0], 1
    for a, b in pairwise(at):
        n = max(1, int(np.ceil(abs(b - a) * steeper * rate / slew * (1 - 1e-12))))
        part = np.arange(1, n + 1) / n
        if course == "cosine":
            part = 0.5 - 0.5 * np.cos(np.pi * part)
        values += [a + (b - a) * part, np.full(rest, b)]
        filled += n
        marks.append(filled - 1)
        filled += rest
    joined = np.concatenate(values)
    return Signal(
        name, np.arange(joined.size) / rate, joined, unit, kind, "linear", marks=tuple(marks),
        notes=(f"{course} ways of at most {slew:g} {unit}/s",),
    )  # fmt: skip
