"""What slow ramps of a stack tell: rest, T, remanence, and k where a force is recorded."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from actuators.stack.loading_curve import (
    Interval,
    LoadingCurve,
    LoadingSlopes,
    largest_rises,
    loading_slopes,
    transducer_constant,
    whole_slope,
)
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

USUAL = ("V_in", "V", "x", "F_e")
"""Names that are taken where a unit has several channels."""
LEAST_REST = 8
"""Samples."""
STILL = 1e-4
"""Share of the voltage span within which a voltage rests."""
GRAVITY = 9.80665
"""m/s^2."""
AT_ZERO = 1e-2
"""Share of the voltage span within which a virgin curve has to begin."""
SLOPES = (1e-10, 1e-5)
"""m/V: one layer of a hard ceramic gives 2e-10, the longest stacks that are sold 1.5e-6."""
HIGHEST = 1e4
"""V; stacks end at 1 kV, single discs at a few."""
SURE = 4.0
"""Standard errors from which on a slope is one."""
USUAL_CREEP = (0.02, 0.01)
"""Share of the displacement in a decade, and the time (s) from which on decades count."""
STEADY = 0.2
"""Of the time of the last fifth of the voltage, what the last fiftieth takes; 0.1 on a ramp."""


@dataclass(frozen=True, slots=True, eq=False)
class FromRest:
    """A record that begins at rest, its displacement counted from there.

    Attributes
    ----------
    name : str
    volt, x : ndarray, shape (N,), V and m
    rate : float
        Hz.
    resting : int
        Samples at rest.
    noise : float
        Standard deviation of the displacement from sample to sample, m.
    """

    name: str
    volt: FloatArray
    x: FloatArray
    rate: float
    resting: int
    noise: float

    @property
    def largest_rise(self) -> LoadingCurve:
        """The samples of the first largest rise."""
        part = largest_rises(self.volt, 1e-3 * float(np.ptp(self.volt)))[0]
        return LoadingCurve(self.volt[part], self.x[part])

    def remanence(self) -> Interval | None:
        """Return what is left at the first voltage after the largest stroke, m; None if unknown.

        Read at the first voltage, from a parabola through the last twentieth of the fall.
        """
        span, top = float(np.ptp(self.volt)), int(np.argmax(self.volt))
        away = self.volt[top:] - self.volt[0]
        # a triangle that is played once ends a sample before the first voltage
        back = np.flatnonzero(away <= 10.0 * STILL * span)
        if not back.size:
            return None
        part = np.flatnonzero(away[: int(back[0]) + 1] <= 0.05 * span) + top
        if part.size < LEAST_REST:
            return None
        columns = np.vander(self.volt[part] - self.volt[0], 3)
        found, _, _, _ = np.linalg.lstsq(columns, self.x[part], rcond=None)
        spread = np.linalg.pinv(columns)[2]
        own = self.noise * float(np.linalg.norm(spread))
        return Interval.of(float(found[2]), math.hypot(own, self.noise / math.sqrt(self.resting)))


def channel_in(recording: Recording, unit: str) -> FloatArray:
    """Return the command or the only channel of a unit: ``V_in`` or ``V``, ``x``, ``F_e``.

    Raises
    ------
    UnusableInput
        If there is none, or several without such a name.
    """
    found = [c for c in recording.channels if recording.units[c] == unit]
    called = [c for c in USUAL if c in found] or found
    if (len(found) > 1 and called == found) or not found:
        raise UnusableInput(
            f"{recording.name}: has {len(found)} channels in {unit} "
            f"({', '.join(found) or ', '.join(recording.channels)}); say which with map="
        )
    return np.asarray(recording[called[0]])


def from_rest(recording: Recording) -> FromRest:
    """Return a record measured from its rest.

    Parameters
    ----------
    recording : Recording
        With a voltage and a displacement, see `channel_in`.

    Raises
    ------
    UnusableInput
        If it does not begin at rest at 0 V, or the voltage never rises.
    """
    u, x = channel_in(recording, "V"), channel_in(recording, "m")
    span = float(np.ptp(u))
    if span == 0.0:
        raise UnusableInput(f"{recording.name}: the voltage is constant; record a ramp or a sine")
    shake = float(np.median(np.abs(np.diff(u, 2)))) / (0.6745 * math.sqrt(6.0)) if u.size > 2 else 0
    moved = np.flatnonzero(np.abs(u - u[0]) > max(STILL * span, 8.0 * shake))
    resting = int(moved[0]) if moved.size else u.size
    if resting < LEAST_REST:
        raise UnusableInput(
            f"{recording.name}: has {resting} samples of rest before the voltage moves, at least "
            f"{LEAST_REST} are needed to know where it begins; record some tenths of a second at "
            "the first voltage (bondsight acquire --rest 0.3)"
        )
    begin = float(u[:resting].mean())
    if abs(begin) > AT_ZERO * float(np.abs(u).max()):
        raise UnusableInput(
            f"{recording.name}: begins at {begin:.4g} V; plays are known from 0 V on, so record "
            "from rest at 0 V"
        )
    if u.max() - begin < 0.5 * span:
        raise UnusableInput(f"{recording.name}: the voltage falls; record the loading upwards")
    steps = np.diff(x[:resting])
    noise = float(np.std(steps) / math.sqrt(2.0))
    return FromRest(recording.name, u, x - float(x[:resting].mean()), recording.fs, resting, noise)


@dataclass(frozen=True, slots=True)
class RampFit:
    """What one ramp tells.

    Attributes
    ----------
    name : str
    slopes : LoadingSlopes
        Of the first largest rise, m/V.
    transducer : Interval
        ``T = k dx/dV`` at the end of the rise, N/V.
    remanence : Interval or None
        m; None if the record does not come back to rest.
    noise : float
        m.
    bend : float
        Share by which the slope rises in the last tenth of the voltage: where a hysteretic store
        still takes a part there, T is too small, and nothing in a free ramp tells by how much.
    steady : bool
        The voltage rises up to its end as fast as before; if it slows down, as a sine does, delay
        and creep bend the curve too.
    usual_creep : float
        Share by which usual creep raises the slope of a rise that takes so long.
    unsure : tuple of float
        Shares by which T may be less and more, as creep is not known; 0 where it was taken out.
    """

    name: str
    slopes: LoadingSlopes
    transducer: Interval
    remanence: Interval | None
    noise: float
    bend: float
    steady: bool = True
    usual_creep: float = 0.0
    unsure: tuple[float, float] = (0.0, 0.0)

    @property
    def constant(self) -> Interval:
        """T with an interval that holds what is not known of creep, N/V."""
        return self.transducer.widened(*self.unsure)


def require_stack(record: FromRest) -> None:
    """Refuse what no piezo stack does.

    Parameters
    ----------
    record : FromRest

    Raises
    ------
    UnusableInput
        If the displacement does not follow the largest rise, falls there, or voltage or slope are
        orders of magnitude beyond any stack.
    """
    curve = record.largest_rise
    span, stroke = float(np.ptp(curve.volt)), float(np.ptp(curve.displacement))
    name, least, most = record.name, *SLOPES
    moves = f"x moves {1e6 * stroke:.4g} um in {span:.4g} V"
    try:
        slope = whole_slope(curve)
    except UnusableInput as error:
        raise UnusableInput(f"{name}: {error}") from None
    if span < 1e-3 and stroke > 1e-2:
        raise UnusableInput(f"{name}: {moves}; the columns of voltage and x look exchanged")
    if span > HIGHEST:
        raise UnusableInput(
            f"{name}: the voltage rises by {span:.4g} V, more than any stack bears; it looks in "
            "mV, not V: write the right unit into the file"
        )
    if abs(slope.value) < SURE * slope.standard_error:
        raise UnusableInput(
            f"{name}: x does not follow the voltage: the slope of the rise, "
            f"{1e9 * slope.value:.2g} nm/V, is not told from zero by its error, "
            f"{1e9 * slope.standard_error:.2g} nm/V; look at amplifier, sensor and wiring, and "
            "whether x is the right channel"
        )
    if slope.value < 0.0:
        raise UnusableInput(
            f"{name}: the displacement falls where the voltage rises ({1e9 * slope.value:.4g} "
            "nm/V); turn the sign of x or of the voltage"
        )
    if slope.value > most:
        unit = "mm" if slope.value < 1e3 * most else "um"
        raise UnusableInput(
            f"{name}: {moves}, {1e9 * slope.value:.4g} nm/V, far beyond any piezo stack (the "
            f"longest give 1500); x looks in {unit}, not m: write the right unit into the file"
        )
    if slope.value < least:
        raise UnusableInput(
            f"{name}: {moves}, {1e9 * slope.value:.2g} nm/V, less than one layer of ceramic gives "
            "(0.2); the voltage looks in mV, not V, or x is too small by its unit: write the right "
            "unit into the file"
        )


def require_different(records: Sequence[FromRest], fresh: FromRest | None = None) -> None:
    """Refuse a recording that is given twice, and one that judges what was fitted to it.

    Raises
    ------
    UnusableInput
        If two records have the same samples.
    """
    for i, one in enumerate(records):
        for other in records[:i]:
            if _same(one, other):
                raise UnusableInput(
                    f"{one.name}: is given twice (the samples are those of {other.name}); give "
                    "each recording once, in the order in which they were taken"
                )
        if fresh is not None and _same(one, fresh):
            raise UnusableInput(
                f"--validate {fresh.name}: is among the recordings that are fitted (its samples "
                f"are those of {one.name}); validate with one that no fit sees"
            )


def _same(one: FromRest, other: FromRest) -> bool:
    return np.array_equal(one.volt, other.volt) and np.array_equal(one.x, other.x)


def fit_ramp(record: FromRest, stiffness: Interval) -> RampFit:
    """Return slopes, T and remanence of a ramp (section 6.2 of the stack actuator thesis).

    Parameters
    ----------
    record : FromRest
    stiffness : Interval
        Short-circuit stiffness k, N/m; its error goes into that of T.

    Raises
    ------
    UnusableInput
        If the stiffness is not positive, or the rise has too few samples.
    """
    curve = record.largest_rise
    try:
        slopes = loading_slopes(curve)
    except UnusableInput as said:
        raise UnusableInput(f"{record.name}: {said}") from None
    span = float(np.ptp(curve.volt))
    end = curve.volt >= curve.volt.max() - 0.2 * span
    curvature = float(
        np.polyfit(curve.volt[end] - curve.volt[end].mean(), curve.displacement[end], 2)[0]
    )
    last = slopes.last
    t = transducer_constant(last, stiffness.value, stiffness.error)
    bend = 2.0 * curvature * 0.1 * span / last.value if last.value else 0.0
    slow, begin = USUAL_CREEP
    creep = slow * math.log10(max(curve.volt.size / record.rate / begin, 1.0))
    steady = last.samples < STEADY * np.count_nonzero(end)
    return RampFit(
        record.name, slopes, t, record.remanence(), record.noise, bend, bool(steady), creep
    )


def mean_of(values: Iterable[Interval]) -> Interval:
    """Return the mean of measurements, its error from their spread where that is larger.

    Examples
    --------
    >>> mean_of([Interval.of(1.0, 0.1), Interval.of(1.2, 0.1)]).value
    1.1
    """
    found = list(values)
    numbers = np.array([v.value for v in found])
    own = math.sqrt(sum(v.error**2 for v in found)) / len(found)
    spread = float(numbers.std(ddof=1)) / math.sqrt(len(found)) if len(found) > 1 else 0.0
    return Interval.of(float(numbers.mean()), max(own, spread))


def stiffness_from_load(recording: Recording) -> Interval:
    """Return k (N/m) from a recorded force at constant voltage: ``dx = dF / k``.

    A force ``F_e`` acts along x, ``F`` is that of a gauge, which presses against it. A steady
    drift of x is taken off.

    Raises
    ------
    UnusableInput
        If no force moves, or the voltage does.
    """
    force, x = channel_in(recording, "N"), _held(recording)
    if not np.ptp(force) > 0.0:
        raise UnusableInput(f"{recording.name}: the force is constant; load and unload the stack")
    if "F" in recording.channels and "F_e" not in recording.channels:
        force = -force
    columns = np.column_stack((force, np.ones(x.size), np.linspace(-1.0, 1.0, x.size)))
    found = np.linalg.pinv(columns) @ x
    compliance, rest = float(found[0]), x - columns @ found
    rho = min(max(float(rest[1:] @ rest[:-1]) / max(float(rest @ rest), 1e-300), 0.0), 0.99)
    own = float(np.linalg.norm(np.linalg.pinv(columns)[0]))
    error = own * math.sqrt(float(rest @ rest) / (x.size - 3) * (1 + rho) / (1 - rho))
    if not compliance > 0.0:
        raise UnusableInput(f"{recording.name}: x falls with the force; turn the sign of the force")
    return Interval.of(1.0 / compliance, error / compliance**2)


def stiffness_from_weight(recording: Recording, mass: float) -> Interval:
    """Return k (N/m) from the step of x when a mass (kg) is put on the upright stack, or taken off.

    The two tenths of the record before and behind the step are averaged, less the tenth in which
    somebody's hands are there.

    Raises
    ------
    UnusableInput
        If the voltage moves, the mass is none, or no step stands out.

    Examples
    --------
    >>> x = np.where(np.arange(1000) < 400, 0.0, -0.5 * 9.80665 / 60e6)
    >>> r = Recording("weight", np.arange(1000) / 100.0, {"V": 0 * x, "x": x}, {"V": "V", "x": "m"})
    >>> round(stiffness_from_weight(r, 0.5).value / 1e6, 6)
    60.0
    """
    if not mass > 0.0:
        raise UnusableInput(f"--weight {mass:g}: give the mass that is put on, kg, above 0")
    x = _held(recording)
    tenth = x.size // 10
    if tenth < LEAST_REST:
        raise UnusableInput(
            f"{recording.name}: {x.size} samples; record at least {10 * LEAST_REST}"
        )
    total = np.concatenate(([0.0], np.cumsum(x)))
    mean = (total[2 * tenth :] - total[: -2 * tenth]) / (2 * tenth)
    # between the means of two tenths on either side of a tenth
    steps = mean[3 * tenth :] - mean[: -3 * tenth]
    at = int(np.argmax(np.abs(steps)))
    sides = [x[at : at + 2 * tenth], x[at + 3 * tenth : at + 5 * tenth]]
    # what moves slowly counts: the halves of a side may differ
    halves = [h.mean() for side in sides for h in np.array_split(side, 2)]
    error = math.hypot(halves[0] - halves[1], halves[2] - halves[3]) / 2.0
    error = max(error, math.hypot(*(float(np.std(s)) for s in sides)) / math.sqrt(2 * tenth))
    step = abs(float(steps[at]))
    if not step > 6.0 * error:
        raise UnusableInput(
            f"{recording.name}: no step of x stands out ({1e9 * step:.2g} nm, known to "
            f"{1e9 * error:.2g} nm); put the mass on in the middle of the record, or a larger one"
        )
    return Interval.of(mass * GRAVITY / step, mass * GRAVITY / step**2 * error)


def _held(recording: Recording) -> FloatArray:
    """Return the displacement of a record whose voltage is held."""
    volts = {c: np.asarray(recording[c]) for c in recording.channels if recording.units[c] == "V"}
    # a monitor has its noise; the command has none
    asked = [volts[c] for c in USUAL if c in volts] or list(volts.values())
    if any(np.ptp(v) > 0.01 * (1.0 + np.abs(v).max()) for v in asked):
        raise UnusableInput(
            f"{recording.name}: voltage and force move together; hold the voltage while loading "
            "(bondsight acquire --signal hold:SECONDS:VOLTS)"
        )
    return channel_in(recording, "m")
