"""Clocks from a copy of the voltage that was sampled together with the length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from hardware.synchrony.alignment import Alignment, How, SilentLoss
from hardware.synchrony.coarse import Coarse, first_guess
from hardware.synchrony.edges import by_edges
from hardware.synchrony.fit import AlignmentData, FittedTimeMap, TimeMapGuess
from hardware.synchrony.gaps import find_gaps, structured
from hardware.synchrony.held import HeldColumns
from hardware.synchrony.jitter import jitter_of
from hardware.synchrony.settle import settled
from hardware.synchrony.spread import covariance_of, reach, spread_out
from hardware.synchrony.stream import COPY, VOLTAGE, Stream
from hardware.synchrony.time_map import TimeMap
from hardware.synchrony.wiring import ClockWiring

FIRST_LAG = 0.4
"""First guess of an unknown lag, in steps of the drive."""
_Solved = tuple[Coarse, FittedTimeMap, tuple[FittedTimeMap, ...]]
WIDE_LAG = 20.0
MENDED = 0.5
"""Share of the squares that gaps may leave to be believed."""
FAST = 0.03
"""Lag in steps of the drive below which only the edges, not the slopes, tell the time."""


def align_by_copy(drive: Stream, sensor: Stream, wiring: ClockWiring) -> Alignment:
    """Fit ``copy(t) = gain V(s(t) - latency) + offset`` with the hold and the amplifier's lag.

    Parameters
    ----------
    drive, sensor : Stream
    wiring : ClockWiring

    Raises
    ------
    UnusableInput
        If the drive does not move, or the copy does not follow it.
    """
    held, material = _material(drive, sensor, wiring)
    step = material.held.step
    lag = wiring.lag if wiring.lag is not None else FIRST_LAG * step
    smooth = max(lag, FIRST_LAG * step) if wiring.hold == "zero" else lag
    far = 16.0 / sensor.rate if wiring.most_delay is None else wiring.most_delay
    expected = wiring.delay - wiring.copy_latency
    skew = wiring.most_skew if not wiring.shared_clock else 1e-9
    material = _declared(material, wiring)

    def solved(given: AlignmentData) -> _Solved:
        coarse = first_guess(given, held, expected, max(far, 2.0 / sensor.rate), skew, smooth)
        begun = TimeMapGuess(wiring.bent(coarse.guess.map), max(smooth, 1e-3 * step))
        if wiring.shared_clock:
            begun = TimeMapGuess(TimeMap(begun.map.delay), begun.lag)
        return (coarse, *settled(given, held, begun, wiring.lag))

    coarse, fitted, rivals = solved(material)
    gaps: tuple[SilentLoss, ...] = ()
    if structured(fitted):
        mended = _mended(material, held, (coarse, fitted, rivals), wiring.lag, solved)
        gaps, material, (coarse, fitted, rivals) = mended
    notes: tuple[str, ...] = ()
    if structured(fitted):
        notes = (
            "what is left of the copy is no noise: let the ratio drift (drifting), or check hold, "
            "lag and gain of the copy",
        )
    how: How = "copy"
    if wiring.hold == "zero" and fitted.guess.lag < FAST * step:
        guess, covariance = by_edges(material, held, fitted, wiring.shared_clock)
        factor, how = reach(2), "copy, by its edges"
        lag_error = wiring.lag_error if wiring.lag is not None else fitted.guess.lag
        covariance[0, 0] += fitted.guess.lag**2
    else:
        covariance, lag_error = _covariance(material, fitted)
        guess, factor = fitted.guess, reach(len(material.free))
        if "lag" not in material.free:
            lag_error = wiring.lag_error
    if factor * covariance[0, 0] ** 0.5 > 0.1 * step and wiring.hold == "zero":
        notes += (
            "at these rates the copy shows which step is held but hardly since when: declare the "
            "lag of the amplifier, put a low-pass of about one step before the actuator or the "
            "copy, or take rates that do not divide each other",
        )
    # a hollow as deep: the truth may lie there
    apart = [np.outer(d, d) for r in rivals if (d := r.guess.map.numbers - guess.map.numbers).any()]
    if apart:
        covariance = covariance + max(apart, key=lambda o: float(o[0, 0]))
    if structured(fitted) and how == "copy":
        # so much time would explain all that is left
        steep = float(np.mean(fitted.slope**2)) + 1e-300
        covariance[0, 0] += float(np.mean(fitted.rest**2)) / steep
        if not wiring.shared_clock:
            covariance[1, 1] += covariance[0, 0] / float(np.ptp(material.time)) ** 2
    kept = np.flatnonzero(sensor.usable(COPY))
    gaps = tuple(SilentLoss(int(kept[g.first]), g.missing) for g in gaps)
    jitter, jitter_error = jitter_of(fitted.rest, fitted.slope)
    covariance[0, 0] += wiring.copy_latency_error**2
    found = replace(guess.map, delay=guess.map.delay + wiring.copy_latency)
    if coarse.others:
        notes += (
            "the record looks the same for delays of "
            + ", ".join(f"{1e3 * (d + wiring.copy_latency):.4g}" for d in coarse.others[:4])
            + " ms; the one nearest to the expected was taken",
        )
    known = factor * float(covariance[0, 0]) ** 0.5 < 1.0 / sensor.rate
    return Alignment(
        found, covariance, how, known, float(sensor.time[-1]), factor, wiring.hold,
        guess.lag if how == "copy" else (wiring.lag or 0.0), lag_error, jitter, jitter_error,
        float(fitted.coefficients[0]), float(fitted.coefficients[1]), fitted.rms,
        gaps, tuple(d + wiring.copy_latency for d in coarse.others), notes,
    )  # fmt: skip


def _material(
    drive: Stream, sensor: Stream, wiring: ClockWiring
) -> tuple[HeldColumns, AlignmentData]:
    usable = sensor.usable(COPY)
    time = sensor.time[usable]
    held = HeldColumns(drive.filled(VOLTAGE)[:, None], 1.0 / drive.rate, wiring.hold)
    return held, AlignmentData(held, time, sensor.channel(COPY)[usable], np.ones((time.size, 1)))


def _mended(
    material: AlignmentData,
    held: HeldColumns,
    now: _Solved,
    lag: float | None,
    solved: Callable[[AlignmentData], _Solved],
) -> tuple[tuple[SilentLoss, ...], AlignmentData, _Solved]:
    """Look for lost samples; keep them only if they explain what was left."""
    gaps = find_gaps(material, held, now[0].early, lag)
    if not gaps:
        return (), material, now
    time, step = material.time.copy(), float(np.median(np.diff(material.time)))
    for gap in gaps:
        time[gap.first :] += gap.missing * step
    moved = replace(material, time=time)
    again = solved(moved)
    if again[1].power > MENDED * now[1].power:
        return (), material, now
    return gaps, moved, again


def _declared(material: AlignmentData, wiring: ClockWiring) -> AlignmentData:
    """Return the material with what is free and what is believed of it."""
    free = wiring.free
    beliefs: tuple[tuple[str, float, float], ...] = ()
    if wiring.lag is None or wiring.lag_error > 0.0:
        free += ("lag",)
    if wiring.lag is not None and wiring.lag_error > 0.0:
        beliefs = (("lag", wiring.lag, wiring.lag_error),)
    elif wiring.lag is None:
        # keeps the covariance finite where lag and delay are one
        beliefs = (("lag", 0.0, WIDE_LAG * material.held.step),)
    return replace(material, free=free, beliefs=beliefs)


def _covariance(material: AlignmentData, fitted: FittedTimeMap) -> tuple[Array, float]:
    """Covariance of the numbers of the map, and the error of the lag."""
    found = covariance_of(material, fitted)
    whole = spread_out(found, material, fitted)
    lag = float(np.sqrt(found[-1, -1])) if "lag" in material.free else 0.0
    return whole, lag
