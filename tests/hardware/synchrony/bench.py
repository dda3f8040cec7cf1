"""A drive, a hysteretic stack and a sensor with a clock of its own.

The set-up of section 6.6 of the stack actuator thesis: 0 to 100 V, about 4.4 um, a converter that
steps every 320 us, 32,768 samples of the interferometer at nominally 3125 Hz. The amplifier lags
by 100 us; noise of the length is 2 nm, of the copy 10 mV at the actuator, both rms and white.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bondgraph.hysteresis import AlJanaideh
from bondgraph.support.arrays import FloatArray as Array
from hardware.simulators.rig import DeviceClock
from hardware.synchrony import HeldColumns, Stream, TimeMap

RATE, SAMPLES, LAG = 3125.0, 32768, 100e-6
STACK = AlJanaideh.stack_2hz()


def sine(f: float) -> Callable[[Array], Array]:
    return lambda t: np.asarray(50.0 - 50.0 * np.cos(2.0 * np.pi * f * t))


def many(t: Array) -> Array:
    f, size = np.array([1.37, 5.11, 13.7, 31.3]), np.array([20.0, 14.0, 8.0, 6.0])
    return np.asarray(50.0 + np.sin(2.0 * np.pi * f * t[:, None]) @ size)


def true_map(clock: DeviceClock) -> TimeMap:
    """Time of the drive (whose clock is the true time here) over that of the sensor."""
    return TimeMap(clock.offset, 1e-6 * clock.ppm, 1e-6 * clock.drift_ppm / 60.0)


def record(
    volt: Callable[[Array], Array],
    clock: DeviceClock,
    *,
    n: int = SAMPLES,
    lag: float = LAG,
    copy_noise: float = 10e-3,
    noise: float = 2e-9,
    seed: int = 0,
    drive_rate: float = RATE,
    length: bool = True,
) -> tuple[Stream, Stream]:
    """Return the drive's stream and the sensor's, with ``x`` and ``V_copy``."""
    rng = np.random.default_rng(seed)
    count = int((n / RATE + 0.1) * drive_rate)
    volts = volt(np.arange(count) / drive_rate)
    held = HeldColumns(volts[:, None], 1.0 / drive_rate, "zero", lag)
    s = clock.instants(0.0, 0, n, RATE)
    channels = {"V_copy": held.at(s)[0][:, 0] + copy_noise * rng.standard_normal(n)}
    if length:
        # the voltage goes one way between the steps: they and the wanted instants are enough
        at = np.concatenate([s, np.arange(count) / drive_rate])
        order = np.argsort(at, kind="stable")
        x = np.empty(at.size)
        x[order] = STACK.run(held.at(at[order])[0][:, 0])[0]
        channels["x"] = x[:n] + noise * rng.standard_normal(n)
    return Stream.of(drive_rate, V=volts), Stream.of(RATE, **channels)


def width(volts: Array, x: Array) -> float:
    """Width of the loop at 50 V: straight lines through both branches, 40 to 60 V."""
    rising = np.gradient(volts) > 0.0
    near = np.abs(volts - 50.0) < 10.0
    level = [
        float(np.polyfit(volts[near & up] - 50.0, x[near & up], 1)[1]) for up in (rising, ~rising)
    ]
    return level[1] - level[0]


def widths(drive: Stream, sensor: Stream, *maps: TimeMap, lag: float = LAG) -> list[float]:
    """Width of the last second's loops, the drive taken at the instants that each map tells."""
    held = HeldColumns(drive.channels["V"][:, None], 1.0 / drive.rate, "zero", lag)
    late = slice(sensor.n - round(sensor.rate), None)
    return [
        width(held.at(m.to_drive(sensor.time[late]))[0][:, 0], sensor.channels["x"][late])
        for m in maps
    ]
