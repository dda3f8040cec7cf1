"""Drive and sensor with clocks of their own: what synchronisation mends on simulated stacks."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from actuators.stack.clock_study import NOISE, PLANTS, RATE, SAMPLES, cosine, sensed
from actuators.stack.loop_width import HysteresisLoop, loop_of
from bondgraph.support.ops import FloatArray
from hardware.synchrony import (
    ClockWiring,
    Stream,
    TimeMap,
    align,
    between,
    delay_from_lags,
    false_width,
    merged,
)

Curves = dict[str, tuple[FloatArray, FloatArray]]
FREQUENCIES = (2.0, 10.0, 100.0)
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
LATE = TimeMap(160e-6, 100e-6)
SMOOTH = ClockWiring(hold="linear", lag=0.0)
"""A command that is smooth between its samples."""
BENDING = ClockWiring(hold="linear", lag=0.0, drifting=True, knots=KNOTS[1:2])


def clock_skew() -> dict[str, Curves]:
    """Print the false width that two clocks make, the estimates, and what is left.

    Returns
    -------
    dict
        Frequency -> loops seen and corrected, of the plant without rate at 100 ppm.
    """
    print(
        f"{SAMPLES} samples at {RATE:g} Hz, 0..100 V, {1e9 * NOISE:g} nm noise; thickness of the "
        "last period in nm"
    )
    loops: dict[str, Curves] = {}
    for plant in PLANTS:
        for label, clock in CLOCKS.items():
            print(f"Plant {plant}, {label}")
            for f in FREQUENCIES:
                curves = _row(plant, f, clock)
                if label == "100 ppm" and plant == "without rate":
                    loops[f"{f:g} Hz"] = curves
    _delays()
    _free_command()
    return loops


def _record(plant: str, f: float, clock: TimeMap) -> tuple[Stream, Stream]:
    """Take `x` by the sensor's clock and the command by the drive's."""
    time = np.arange(SAMPLES) / RATE
    at = clock.to_drive(time)
    # the simulation wants even times: run it on the drive's clock, finer where that one bends
    fine = np.linspace(at[0], at[-1], 8 * SAMPLES if clock.bends else SAMPLES)
    x = sensed(
        plant, lambda t: cosine(t, f), at if clock.bends else fine,
        fine=fine if clock.bends else None, seed=round(f),
    )  # fmt: skip
    return Stream.of(RATE, V=cosine(time, f)), Stream.of(RATE, x=x)


def _last(
    at: FloatArray, values: FloatArray, f: float
) -> tuple[HysteresisLoop, tuple[FloatArray, FloatArray]]:
    """Mean of the loops of the last tenth of a second, at least one period."""
    count = max(1, round(0.1 * f))
    phase = np.arange(1000) / 1000
    time = END - (count - np.arange(count)[:, None] - phase) / f
    x = np.interp(time.ravel(), at, values)
    if f > 20:  # few samples a period: between them by band limitation
        position = (time.ravel() - at[0]) * (at.size - 1) / (at[-1] - at[0])
        x = between(values, np.zeros(at.size, np.uint16), position).values
    curve = cosine(time[-1], f), x.reshape(count, -1).mean(axis=0)
    return loop_of(*curve), curve


@lru_cache(maxsize=8)
def _true(plant: str, f: float) -> HysteresisLoop:
    """Return the loop with equal clocks."""
    _, sensor = _record(plant, f, TimeMap())
    return _last(sensor.time, sensor.channels["x"], f)[0]


def _row(plant: str, f: float, clock: TimeMap) -> Curves:
    drive, sensor = _record(plant, f, clock)
    true = _true(plant, f)
    before, seen = _last(sensor.time, sensor.channels["x"], f)
    found = align(drive, sensor, BENDING if clock.bends else SMOOTH)
    together = merged(drive, sensor, found)
    after, mended = _last(together.time, together.channels["x"], f)
    middle = END - 0.5 / f
    misfit = float(clock.to_drive(middle)) - middle
    knots = np.array(KNOTS if clock.bends else KNOTS[:1])
    ratios = ", ".join(
        f"{1e6 * r:.2f} +- {1e6 * half:.2f}"
        for r, half in zip(found.map.skew_at(knots), found.skew_half_at(knots), strict=True)
    )
    print(
        f"  {f:5g} Hz: true {1e9 * true.thickness:7.1f}, seen {1e9 * before.thickness:8.1f} (a "
        f"misfit of {1e6 * misfit:7.1f} us alone makes "
        f"{1e9 * false_width(true.stroke, f, misfit):6.1f}), corrected "
        f"{1e9 * after.thickness:7.1f}; ppm {ratios}"
    )
    return {"two clocks": seen, "corrected": mended}


def _delays() -> None:
    """Start the sensor late: what one frequency tells, and what three do."""
    print(f"Sensor 100 ppm and {1e6 * LATE.delay:g} us late (half a sample)")
    for plant in PLANTS:
        lags = []
        for f in FREQUENCIES:
            drive, sensor = _record(plant, f, LATE)
            found = align(drive, sensor, SMOOTH)
            lags.append(found.answer_lag)
            together = merged(drive, sensor, found)
            after, _ = _last(together.time, together.channels["x"], f)
            print(
                f"  {plant}, {f:5g} Hz: true {1e9 * _true(plant, f).thickness:7.1f}, ratio "
                f"corrected {1e9 * after.thickness:7.1f}; lag less delay "
                f"{1e6 * found.answer_lag:.1f} us"
            )
        delay, phase = delay_from_lags(FREQUENCIES, lags)
        print(
            f"  {plant}: if there were no rate dependence, delay {1e6 * delay:.1f} us and lag "
            f"{phase:.4f} rad"
        )


def _free_command() -> None:
    """Fit ratio and delay of a command without a period."""

    def volt(t: FloatArray) -> FloatArray:
        s = np.maximum(t, 0.0)[:, None]
        f, size = np.array([1.37, 5.11, 13.7, 31.3]), np.array([20.0, 14.0, 8.0, 6.0])
        return np.asarray(50 + np.sin(2 * np.pi * f * s) @ size)

    time = np.arange(SAMPLES) / RATE
    at = LATE.to_drive(time)
    fine = np.linspace(-0.01, float(at[-1]) + 0.01, 8 * SAMPLES)
    print("Command of four incommensurate sines, 100 ppm and 160 us, fit with plays")
    for plant in PLANTS:
        x = sensed(plant, volt, at, fine=fine, seed=5)
        # the plant is taken to answer at once: a lag of its own counts as delay
        wiring = ClockWiring(hold="linear", lag=0.0, plant_lag_error=0.0)
        found = align(Stream.of(RATE, V=volt(time)), Stream.of(RATE, x=x), wiring)
        print(f"  {plant}: {found.sentence}; rms left {1e9 * found.rms:.2f} nm")
