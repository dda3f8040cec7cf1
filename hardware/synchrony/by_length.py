"""Clocks from the length alone: what the actuator's answer tells, and what it cannot.

Two ways. A periodic drive: the answer of a plant that does not change is periodic too, so its
phase may not drift; that gives the ratio, never the delay. Any other drive: plays of the voltage
(a rate-independent hysteresis) with creep; a delay moves all frequencies by a phase that grows
with them, such a hysteresis does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.synchrony.alignment import Alignment
from hardware.synchrony.by_response import skew_by_response
from hardware.synchrony.coarse import first_guess
from hardware.synchrony.fit import AlignmentData, FittedTimeMap, TimeMapGuess, fit
from hardware.synchrony.gaps import structured
from hardware.synchrony.held import HeldColumns, Shape
from hardware.synchrony.jitter import jitter_of
from hardware.synchrony.period import fundamental, one_loop
from hardware.synchrony.played import Played
from hardware.synchrony.spread import covariance_of, reach, spread_out
from hardware.synchrony.stream import LENGTH, VOLTAGE, Stream
from hardware.synchrony.time_map import TimeMap
from hardware.synchrony.toned import Toned
from hardware.synchrony.wiring import ClockWiring

HARMONICS = 9
PLAYS = (12, 20)
SEPARABLE = 0.3
"""Least share of a shift in time that hysteresis and creep must not be able to imitate."""
AS_GOOD = 1.5
MISSED = 2.0
"""Factor on the standard errors for what the plays leave out."""
MANY = 3.0
"""Standard errors beyond which two numbers do not tell of the same delay."""
CREEP = (0.01, 0.1, 1.0, 10.0)
"""Time constants of the creep allowed for (s)."""
FIRST_LAG = 0.4
FINER = 8
"""Parts of a step of the drive at which a model of the actuator is asked."""
Model = Callable[[Array], Array]


def align_by_length(
    drive: Stream,
    sensor: Stream,
    wiring: ClockWiring,
    *,
    model: Model | None = None,
) -> Alignment:
    """Estimate the clocks from drive and length.

    The delay is given only if the drive is not one periodic tone, the record separates a delay
    from hysteresis and creep, and ``wiring.plant_lag_error`` bounds the actuator's own lag, which
    no record of this kind tells from a delay; or if the wiring itself knows it.

    Parameters
    ----------
    drive, sensor : Stream
    wiring : ClockWiring
    model : callable, optional
        Length, up to offset and gain, of a finely sampled voltage, both ``(n,)``: taken in place
        of plays and creep, where the actuator is known.

    Raises
    ------
    UnusableInput
        If the drive does not move, the length does not follow, or the record is too short.
    """
    volts = drive.channel(VOLTAGE)
    if float(np.ptp(volts)) <= 1e-12 * float(np.abs(volts).max(initial=0.0)):
        raise UnusableInput("clock: the drive is constant, so nothing marks the time; let it move")
    tone = fundamental(volts, drive.rate)
    if model is None and tone is not None and one_loop(volts, drive.rate, tone):
        return _by_phase(drive, sensor, wiring, tone)
    return _by_plays(drive, sensor, wiring, model)


def _by_phase(drive: Stream, sensor: Stream, wiring: ClockWiring, tone: float) -> Alignment:
    """Periodic drive: the ratio from the drift of fundamental and harmonics."""
    step = 1.0 / drive.rate
    t = sensor.time
    usable = sensor.usable(LENGTH) & (t >= 1.0 / tone + wiring.delay)
    t = t[usable]
    if t.size < 64 or (t[-1] - t[0]) * tone < 2.0:
        raise UnusableInput(
            f"clock: fewer than 2 periods of {tone:.4g} Hz after the first; record at least 3"
        )
    orders = min(HARMONICS, max(int(0.45 * min(drive.rate, sensor.rate) / tone), 1))
    lag = FIRST_LAG * step if wiring.lag is None else wiring.lag
    held = Toned(tone, orders, step, wiring.hold == "zero", lag)
    free = ("delay", "skew") if wiring.shared_clock else wiring.free
    # the delay is one phase with the coefficients; only the steps of the drive show a part of it
    beliefs: tuple[tuple[str, float, float], ...] = (
        ("delay", wiring.delay, step), ("skew", 0.0, wiring.most_skew)
    )  # fmt: skip
    if wiring.hold == "zero":
        # hysteresis of a lagged step is not quite the lagged step of a hysteresis
        free += ("lag",)
        loose = step if wiring.lag is None else max(wiring.lag_error, 0.2 * step)
        beliefs += (("lag", lag, loose),)
    material = AlignmentData(
        held, t, sensor.channel(LENGTH)[usable], _trend(t, tone), free, beliefs
    )
    start = TimeMapGuess(wiring.bent(TimeMap(wiring.delay)), lag)
    fitted = _widened(material, start, tone)
    covariance = spread_out(covariance_of(material, fitted), material, fitted)
    covariance[0] = covariance[:, 0] = 0.0
    known = wiring.delay_error is not None
    covariance[0, 0] = wiring.delay_error**2 if wiring.delay_error is not None else np.inf
    found = replace(fitted.guess.map, delay=wiring.delay)
    jitter, error = jitter_of(fitted.rest, fitted.slope)
    answer, answer_error = _answer_lag(drive, material, fitted, tone)
    return Alignment(
        found, covariance, "phase", known, float(sensor.time[-1]), reach(len(free)), wiring.hold,
        wiring.lag or 0.0, wiring.lag_error, jitter, error, rms=fitted.rms,
        answer_lag=answer, answer_lag_error=answer_error,
        notes=(f"one tone of {tone:.6g} Hz: a delay and the lag of the loop are one phase",),
    )  # fmt: skip


def _widened(material: AlignmentData, start: TimeMapGuess, tone: float) -> FittedTimeMap:
    """Fit windows that double, so that a large ratio error does not skip a period."""
    n = material.time.size
    step = float(np.median(np.diff(material.time)))
    size = int(np.clip(3.0 / (tone * step), 32 * (2 * HARMONICS + 8), n))
    guess = start
    while size < n:
        part = replace(
            material.part(slice(0, size)), free=("delay", "skew"), beliefs=material.beliefs[:2]
        )
        guess = fit(part, guess, steps=6).guess
        size = min(4 * size, n)
    return fit(material, guess)


def _answer_lag(
    drive: Stream, material: AlignmentData, fitted: FittedTimeMap, tone: float
) -> tuple[float, float]:
    """Lag of the fundamental behind the drive's less the delay (s), and its standard deviation."""
    w = 2.0 * np.pi * tone
    own = Toned(tone, material.held.count // 2, material.held.step, False).at(drive.time)[0]
    (c, d), *_ = np.split(
        np.linalg.lstsq(np.column_stack([own, np.ones(drive.n)]), drive.channel(VOLTAGE))[0], [2]
    )
    a, b = fitted.coefficients[:2]
    lag = (math.atan2(b, a) - math.atan2(d, c)) / w - fitted.guess.map.delay
    lag -= round(lag * tone) / tone
    # the phase belongs to the start of the record, so an error of the ratio turns it as well
    free = [k for k, n in enumerate(fitted.guess.map.names) if n in material.free and n != "delay"]
    by = fitted.guess.map.columns(material.time)[:, free] * fitted.slope[:, None]
    columns = material.held.at(fitted.guess.map.to_drive(material.time))[0]
    j = np.column_stack([columns, by, material.trend])
    size = np.linalg.norm(j, axis=0)
    inverse = np.linalg.pinv((j / size).T @ (j / size), rcond=1e-13, hermitian=True)
    turn = np.array([-b, a]) / ((a * a + b * b) * w * size[:2])
    variance = float(turn @ inverse[:2, :2] @ turn) * float(np.mean(fitted.rest**2))
    return lag, math.sqrt(variance)


def _trend(t: Array, tone: float) -> Array:
    """Offset and creep: what moves slowly besides the drive."""
    u = (t - t[0]) / (t[-1] - t[0])
    return np.column_stack([np.ones(t.size), u, np.log1p((t - t[0]) * tone)])


@dataclass(frozen=True, slots=True)
class _Way:
    plays: int
    creep: bool


def _by_plays(drive: Stream, sensor: Stream, wiring: ClockWiring, model: Model | None) -> Alignment:
    """Free drive: the map under which plays and creep explain the length best."""
    step = 1.0 / drive.rate
    usable = sensor.usable(LENGTH)
    t = sensor.time[usable]
    lag = FIRST_LAG * step if wiring.lag is None else wiring.lag
    trend = np.ones((t.size, 1))
    held = HeldColumns(drive.filled(VOLTAGE)[:, None], step, wiring.hold, lag)
    plain = AlignmentData(held, t, sensor.channel(LENGTH)[usable], trend)
    far = _far(sensor, wiring)
    skew = 1e-9 if wiring.shared_clock else wiring.most_skew
    guess = first_guess(plain, held, wiring.delay, far, skew, lag).guess
    start = TimeMap(guess.map.delay) if wiring.shared_clock else wiring.bent(guess.map)
    guess = TimeMapGuess(start, 0.0 if model else guess.lag)
    free = wiring.free
    beliefs: tuple[tuple[str, float, float], ...] = ()
    shapes: list[Shape]
    if model is not None:
        shapes = [_modelled(held, model)]
    else:
        shapes = [_played(held, _Way(n, creep)) for n in PLAYS for creep in (False, True)]
        if wiring.lag is None or wiring.lag_error > 0.0:
            free += ("lag",)
            beliefs = (("lag", lag, step if wiring.lag is None else wiring.lag_error),)
    results = []
    for shape in shapes:
        material = replace(plain, held=shape, free=free, beliefs=beliefs)
        # a known actuator is the only way on, so it goes all the way from the first guess
        fitted = fit(material, guess, steps=48 if model else 12, most=0.5 * step / shape.step)
        results.append((material, fitted))
        guess = fitted.guess
    material, fitted = min(results, key=lambda r: r[1].rms)
    # plays on a grid are not the actuator: what they miss below the noise biases as well
    spread = MISSED**2 * covariance_of(material, fitted)
    # how far the answer hangs on the model of the plant, among those that explain the record
    good = [r[1] for r in results if r[1].rms <= AS_GOOD * fitted.rms]
    delays = np.array([f.guess.map.delay - f.guess.lag for f in good])
    doubt = float(np.ptp(delays)) / 2.0
    covariance = spread_out(spread, material, fitted)
    if not wiring.shared_clock:
        covariance[1, 1] += (0.5 * float(np.ptp([f.guess.map.skew for f in good]))) ** 2
    if structured(fitted):
        # so much time would explain what no model explained
        late = float(np.mean(fitted.rest**2) / (np.mean(fitted.slope**2) + 1e-300))
        covariance[0, 0] += late
        covariance[1, 1] += 0.0 if wiring.shared_clock else 12.0 * late / float(np.ptp(t)) ** 2
    share = min(r[1].share for r in results)
    if "skew" in free and not wiring.drifting and model is None:
        answer = skew_by_response(drive, sensor, wiring.delay)
        # free dynamics explain what plays leave of a resonant actuator, and tell the ratio better
        if answer is not None and MISSED * answer.error < math.sqrt(float(covariance[1, 1])):
            told = replace(fitted.guess.map, skew=answer.value, drift=answer.drift)
            fitted = replace(fitted, guess=replace(fitted.guess, map=told))
            covariance[0, 1] = covariance[1, 0] = 0.0
            covariance[1, 1] = (MISSED * answer.error) ** 2
            covariance[2, 2] = (MISSED * answer.drift_error) ** 2
    return _judged(
        fitted, covariance, doubt, share, sensor, wiring, reach(len(free))
    )  # fmt: skip


def _judged(
    fitted: FittedTimeMap, covariance: Array, model: float, share: float,
    sensor: Stream, wiring: ClockWiring, factor: float,
) -> Alignment:  # fmt: skip
    """Say whether the delay may be told."""
    found = fitted.guess.map
    less_lag = f"delay less the actuator's own lag is {1e6 * found.delay:.4g} us"
    formal = factor * math.sqrt(float(covariance[0, 0]))
    notes = [
        f"{less_lag} (+- {1e6 * formal:.2g} by noise, +- {1e6 * model:.2g} by the model of "
        f"hysteresis and creep, which can imitate {100 * (1 - share):.0f} % of a shift)"
    ]
    covariance[0, 0] += model**2
    known = True
    if _contradicts(found.delay, float(covariance[0, 0]), sensor, wiring):
        notes = [
            "delay less the actuator's own lag cannot be told from this signal: what the length "
            "says of it is far beyond what the trigger allows, as creep and hysteresis move it; "
            "drive with several frequencies or steps (if those say so too, see to the trigger)"
        ]
    if wiring.delay_error is not None:
        found = replace(found, delay=wiring.delay)
        covariance[0] = covariance[:, 0] = 0.0
        covariance[0, 0] = wiring.delay_error**2
    elif share >= SEPARABLE and wiring.plant_lag_error is not None:
        covariance[0, 0] += wiring.plant_lag_error**2
    else:
        known = False
        found = replace(found, delay=wiring.delay)
        covariance[0] = covariance[:, 0] = 0.0
        covariance[0, 0] = np.inf
        notes.append(
            "state plant_lag_error, if the actuator's lag is known to be small"
            if share >= SEPARABLE
            else "drive with several frequencies or steps to tell a delay from hysteresis"
        )
    jitter, error = jitter_of(fitted.rest, fitted.slope)
    return Alignment(
        found, covariance, "length", known, float(sensor.time[-1]), factor, wiring.hold,
        fitted.guess.lag, wiring.lag_error, jitter, error, rms=fitted.rms, notes=tuple(notes),
    )  # fmt: skip


def _contradicts(delay: float, variance: float, sensor: Stream, wiring: ClockWiring) -> bool:
    """Whether a delay is by many of its errors beyond where a known trigger makes one look."""
    if wiring.delay_error is None:
        return False
    error = math.sqrt(variance + wiring.delay_error**2)
    return abs(delay - wiring.delay) > _far(sensor, wiring) + MANY * error


def _far(sensor: Stream, wiring: ClockWiring) -> float:
    return 16.0 / sensor.rate if wiring.most_delay is None else wiring.most_delay


def _modelled(held: HeldColumns, model: Model) -> HeldColumns:
    """Return the answer of a known actuator, joined by straight lines."""
    fine = held.step / FINER * np.arange((held.columns.shape[0] - 1) * FINER + 1)
    answer = np.asarray(model(held.at(fine)[0][:, 0]), float)
    return HeldColumns(answer.reshape(fine.size, -1), held.step / FINER, "linear")


def _played(held: HeldColumns, way: _Way) -> Played:
    """Return plays evenly up to half the span, with or without creep."""
    r = 0.5 * float(np.ptp(held.columns)) * np.arange(1, way.plays + 1) / (way.plays + 1)
    return Played(held, tuple(r.tolist()), CREEP if way.creep else ())
