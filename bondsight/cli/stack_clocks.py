"""Drive and sensor with clocks of their own, on simulated stacks (section 6.6 of the thesis)."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators import stack_lumped
from actuators.stack.loop_width import HysteresisLoop, loop_of
from bondgraph import simulate
from bondgraph.hysteresis import AlJanaideh, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondsight.cli.stack_figures import clock_figure
from hardware.synchrony import (
    Alignment,
    ClockWiring,
    Stream,
    TimeMap,
    align,
    between,
    delay_from_lags,
    false_width,
    merged,
)

__all__ = ["clock_skew"]

FloatArray = NDArray[np.float64]
Plant = Callable[[FloatArray, FloatArray], FloatArray]
"""Displacement from even times (s) and voltages (V)."""

RATE, SAMPLES = 3125.0, 32768
FREQUENCIES = (2.0, 10.0, 100.0)
NOISE = 2e-9
RESISTANCE = 190.0
END = (SAMPLES - 1) / RATE - 0.02
"""Where the last loop ends (s)."""
KNOTS = (0.0, 5.0, 10.5)
"""Between these instants (s) a drifting ratio is linear."""
CLOCKS = {
    "equal clocks": TimeMap(),
    "100 ppm": TimeMap(skew=100e-6),
    "-100 ppm": TimeMap(skew=-100e-6),
    # -60, 20 and 90 ppm at the knots
    "-60 .. 90 ppm, drifting": TimeMap(0.0, -60e-6, 16e-6, ((5.0, 70e-6 / 5.5 - 16e-6),)),
}
SMOOTH = ClockWiring(hold="linear", lag=0.0)
"""A command that is smooth between its samples."""
BENDING = ClockWiring(hold="linear", lag=0.0, drifting=True, knots=KNOTS[1:2])


def clock_skew(figure: Path | None = None) -> int:
    """Show the false width that two clocks make, the estimates, and what is left."""
    print(
        f"{SAMPLES} samples at {RATE:g} Hz, 0..100 V, {1e9 * NOISE:g} nm noise; thickness of the "
        "last period in nm"
    )
    loops: dict[str, dict[str, tuple[FloatArray, FloatArray]]] = {}
    for plant in PLANTS:
        for label, clock in CLOCKS.items():
            print(f"Plant {plant}, {label}")
            for f in FREQUENCIES:
                curves = _row(plant, f, clock)
                if label == "100 ppm" and plant == "without rate":
                    loops[f"{f:g} Hz"] = curves
    _delays()
    _free_command()
    if figure is not None:
        clock_figure(loops, figure)
    return 0


def _operator(time: FloatArray, volt: FloatArray) -> FloatArray:
    return AlJanaideh.stack_2hz().run(volt)[0]


def _rate_dependent(time: FloatArray, volt: FloatArray) -> FloatArray:
    """Return the lumped stack behind a resistance that widens the loop with frequency."""
    law = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
    return simulate(stack_lumped(law, resistance=RESISTANCE), time, {"V_in": volt})["x"]


PLANTS: dict[str, Plant] = {"without rate": _operator, "with rate": _rate_dependent}


def _volt(time: FloatArray, f: float) -> FloatArray:
    """0 to 100 V; at rest before the start."""
    return np.asarray(50 - 50 * np.cos(2 * np.pi * f * np.maximum(time, 0.0)))


def _record(plant: str, f: float, clock: TimeMap) -> tuple[Stream, Stream]:
    """Take `x` by the sensor's clock and the command by the drive's."""
    time = np.arange(SAMPLES) / RATE
    at = clock.to_drive(time)
    # the simulation wants even times: run it on the drive's clock, finer where that one bends
    fine = np.linspace(at[0], at[-1], 8 * SAMPLES if clock.bends else SAMPLES)
    x = PLANTS[plant](fine, _volt(fine, f))
    if clock.bends:
        x = np.interp(at, fine, x)
    x = x + NOISE * np.random.default_rng(round(f)).standard_normal(SAMPLES)
    return Stream.of(RATE, V=_volt(time, f)), Stream.of(RATE, x=x)


def _last(
    at: FloatArray, values: FloatArray, f: float
) -> tuple[HysteresisLoop, FloatArray, FloatArray]:
    """Mean of the loops of the last tenth of a second, at least one period."""
    count = max(1, round(0.1 * f))
    phase = np.arange(1000) / 1000
    time = END - (count - np.arange(count)[:, None] - phase) / f
    x = np.interp(time.ravel(), at, values)
    if f > 20:  # few samples a period: between them by band limitation
        position = (time.ravel() - at[0]) * (at.size - 1) / (at[-1] - at[0])
        x = between(values, np.zeros(at.size, np.uint16), position).values
    mean, volt = x.reshape(count, -1).mean(axis=0), _volt(time[-1], f)
    return loop_of(volt, mean), volt, mean


def _corrected(
    drive: Stream, sensor: Stream, found: Alignment, f: float
) -> tuple[HysteresisLoop, FloatArray, FloatArray]:
    """Mean of the last loops by the drive's clock."""
    together = merged(drive, sensor, found)
    return _last(together.time, together.channels["x"], f)


@lru_cache(maxsize=8)
def _true(plant: str, f: float) -> HysteresisLoop:
    """Return the loop with equal clocks."""
    _, sensor = _record(plant, f, CLOCKS["equal clocks"])
    return _last(sensor.time, sensor.channels["x"], f)[0]


def _row(plant: str, f: float, clock: TimeMap) -> dict[str, tuple[FloatArray, FloatArray]]:
    drive, sensor = _record(plant, f, clock)
    true = _true(plant, f)
    before, volt, raw = _last(sensor.time, sensor.channels["x"], f)
    found = align(drive, sensor, BENDING if clock.bends else SMOOTH)
    after, volt_after, mended = _corrected(drive, sensor, found, f)
    middle = END - 0.5 / f
    misfit = float(clock.to_drive(middle)) - middle
    formula = false_width(true.stroke, f, misfit)
    knots = np.array(KNOTS if clock.bends else KNOTS[:1])
    ratios = ", ".join(
        f"{1e6 * r:.2f} +- {1e6 * half:.2f}"
        for r, half in zip(found.map.skew_at(knots), found.skew_half_at(knots), strict=True)
    )
    print(
        f"  {f:5g} Hz: true {1e9 * true.thickness:7.1f}, seen {1e9 * before.thickness:8.1f} (a "
        f"misfit of {1e6 * misfit:7.1f} us alone makes {1e9 * formula:6.1f}), corrected "
        f"{1e9 * after.thickness:7.1f}; ppm {ratios}"
    )
    return {"two clocks": (volt, raw), "corrected": (volt_after, mended)}


def _delays() -> None:
    """Start the sensor late: what one frequency tells, and what three do."""
    late = TimeMap(160e-6, 100e-6)
    print(f"Sensor 100 ppm and {1e6 * late.delay:g} us late (half a sample)")
    for plant in PLANTS:
        lags = []
        for f in FREQUENCIES:
            drive, sensor = _record(plant, f, late)
            found = align(drive, sensor, SMOOTH)
            lags.append(found.answer_lag)
            after, *_ = _corrected(drive, sensor, found, f)
            true = _true(plant, f)
            print(
                f"  {plant}, {f:5g} Hz: true {1e9 * true.thickness:7.1f}, ratio corrected "
                f"{1e9 * after.thickness:7.1f}; lag less delay {1e6 * found.answer_lag:.1f} us"
            )
        delay, phase = delay_from_lags(FREQUENCIES, lags)
        print(
            f"  {plant}: if there were no rate dependence, delay {1e6 * delay:.1f} us and lag "
            f"{phase:.4f} rad"
        )


def _free_command() -> None:
    """Fit ratio and delay of a command without a period."""
    clock = TimeMap(160e-6, 100e-6)
    time = np.arange(SAMPLES) / RATE

    def volt(t: FloatArray) -> FloatArray:
        s = np.maximum(t, 0.0)[:, None]
        f, size = np.array([1.37, 5.11, 13.7, 31.3]), np.array([20.0, 14.0, 8.0, 6.0])
        return np.asarray(50 + np.sin(2 * np.pi * f * s) @ size)

    fine = np.linspace(-0.01, float(clock.to_drive(time[-1])) + 0.01, 8 * SAMPLES)
    print("Command of four incommensurate sines, 100 ppm and 160 us, fit with plays")
    for plant, run in PLANTS.items():
        x = np.interp(clock.to_drive(time), fine, run(fine, volt(fine)))
        x = x + NOISE * np.random.default_rng(5).standard_normal(SAMPLES)
        # the plant is taken to answer at once: a lag of its own counts as delay
        wiring = ClockWiring(hold="linear", lag=0.0, plant_lag_error=0.0)
        found = align(Stream.of(RATE, V=volt(time)), Stream.of(RATE, x=x), wiring)
        print(f"  {plant}: {found.sentence}; rms left {1e9 * found.rms:.2f} nm")
