"""Drive and sensor with clocks of their own, on simulated stacks (section 6.6 of the thesis)."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators import stack_lumped
from actuators.stack.loop_width import HysteresisLoop, loop_of
from bondgraph import Recording, simulate
from bondgraph.hysteresis import AlJanaideh, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondsight.cli.stack_figures import clock_figure
from identification.clock import ClockMap, resampled, synchronised, thickness_from_misfit
from identification.clock_fit import clock_from_fit
from identification.clock_phase import clock_from_phase, delay_from_lags

__all__ = ["clock_skew"]

FloatArray = NDArray[np.float64]
Plant = Callable[[FloatArray, FloatArray], FloatArray]
"""Displacement from even times (s) and voltages (V)."""

RATE, SAMPLES = 3125.0, 32768
FREQUENCIES = (2.0, 10.0, 100.0)
NOISE = 2e-9
RESISTANCE = 190.0
PLAYS = 12
CLOCKS = {
    "equal clocks": ClockMap((0.0,)),
    "100 ppm": ClockMap((100e-6,)),
    "-100 ppm": ClockMap((-100e-6,)),
    "-60 .. 90 ppm, drifting": ClockMap((-60e-6, 20e-6, 90e-6), (0.0, 5.0, 10.5)),
}


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


def _record(plant: str, f: float, clock: ClockMap) -> Recording:
    """Take `x` by the sensor's clock and the command by the drive's."""
    time = np.arange(SAMPLES) / RATE
    at = clock.to_drive(time)
    # the simulation wants even times: run it on the drive's clock, finer where that one bends
    fine = np.linspace(at[0], at[-1], SAMPLES if len(clock.ratio) == 1 else 8 * SAMPLES)
    x = PLANTS[plant](fine, _volt(fine, f))
    if len(clock.ratio) > 1:
        x = np.interp(at, fine, x)
    x = x + NOISE * np.random.default_rng(round(f)).standard_normal(SAMPLES)
    arrays = {"t_s": time, "V_in[V]": _volt(time, f), "x[m]": x}
    return Recording.from_arrays(f"{plant}, {f:g} Hz", arrays)


def _last(recording: Recording, f: float) -> tuple[HysteresisLoop, FloatArray, FloatArray]:
    """Mean of the loops of the last tenth of a second, at least one period."""
    count = max(1, round(0.1 * f))
    end = float(recording.time[-1]) - 0.02
    phase = np.arange(1000) / 1000
    time = end - (count - np.arange(count)[:, None] - phase) / f
    x = np.interp(time.ravel(), recording.time, recording["x"])
    if f > 20:  # few samples a period: between them by band limitation
        x = resampled(recording.time, recording["x"], time.ravel())
    mean, volt = x.reshape(count, -1).mean(axis=0), _volt(time[-1], f)
    return loop_of(volt, mean), volt, mean


@lru_cache(maxsize=8)
def _true(plant: str, f: float) -> HysteresisLoop:
    """Return the loop with equal clocks."""
    return _last(_record(plant, f, CLOCKS["equal clocks"]), f)[0]


def _row(plant: str, f: float, clock: ClockMap) -> dict[str, tuple[FloatArray, FloatArray]]:
    seen = _record(plant, f, clock)
    time, u, x = seen.time, seen["V_in"], seen["x"]
    true = _true(plant, f)
    before, volt, raw = _last(seen, f)
    found = clock_from_phase(time, u, x, knots=clock.knots)
    after, volt_after, mended = _last(synchronised(seen, found.clock), f)
    fit = clock_from_fit(time, u, x, knots=clock.knots, plays=PLAYS, settle=1.0 / f)
    general = ClockMap(fit.clock.ratio, fit.clock.knots)
    after_fit, *_ = _last(synchronised(seen, general), f)
    misfit = float(clock.misfit(float(time[-1]) - 0.02 - 0.5 / f))
    formula = thickness_from_misfit(true.stroke, f, misfit)
    ratios = ", ".join(
        f"{1e6 * r:.2f} +- {5e5 * (b - a):.2f}"
        for r, (a, b) in zip(found.clock.ratio, found.ratio_ci95, strict=True)
    )
    others = ", ".join(f"{1e6 * r:.2f}" for r in fit.clock.ratio)
    print(
        f"  {f:5g} Hz: true {1e9 * true.thickness:7.1f}, seen {1e9 * before.thickness:8.1f} (a "
        f"misfit of {1e6 * misfit:7.1f} us alone makes {1e9 * formula:6.1f}), corrected "
        f"{1e9 * after.thickness:7.1f} by phase, {1e9 * after_fit.thickness:7.1f} by fit; "
        f"ppm {ratios} by phase, {others} by fit"
    )
    return {"two clocks": (volt, raw), "corrected": (volt_after, mended)}


def _delays() -> None:
    """Start the sensor late: what one frequency tells, and what three do."""
    late = ClockMap((100e-6,), (), 160e-6)
    print(f"Sensor 100 ppm and {1e6 * late.delay:g} us late (half a sample)")
    for plant in PLANTS:
        lags = []
        for f in FREQUENCIES:
            seen = _record(plant, f, late)
            found = clock_from_phase(seen.time, seen["V_in"], seen["x"])
            lags.append(found.lag)
            after, *_ = _last(synchronised(seen, found.clock), f)
            true = _true(plant, f)
            print(
                f"  {plant}, {f:5g} Hz: true {1e9 * true.thickness:7.1f}, ratio corrected "
                f"{1e9 * after.thickness:7.1f}; lag less delay {1e6 * found.lag:.1f} us"
            )
        delay, phase = delay_from_lags(FREQUENCIES, lags)
        print(
            f"  {plant}: if there were no rate dependence, delay {1e6 * delay:.1f} us and lag "
            f"{phase:.4f} rad"
        )


def _free_command() -> None:
    """Fit ratio and delay of a command without a period."""
    clock = ClockMap((100e-6,), (), 160e-6)
    time = np.arange(SAMPLES) / RATE

    def volt(t: FloatArray) -> FloatArray:
        s = np.maximum(t, 0.0)[:, None]
        f, size = np.array([1.37, 5.11, 13.7, 31.3]), np.array([20.0, 14.0, 8.0, 6.0])
        return np.asarray(50 + np.sin(2 * np.pi * f * s) @ size)

    fine = np.linspace(-0.01, float(clock.to_drive(time[-1])) + 0.01, 8 * SAMPLES)
    print("Command of four incommensurate sines, 100 ppm and 160 us, fit with 24 plays")
    for plant, run in PLANTS.items():
        x = np.interp(clock.to_drive(time), fine, run(fine, volt(fine)))
        x = x + NOISE * np.random.default_rng(5).standard_normal(SAMPLES)
        found = clock_from_fit(time, volt(time), x)
        print(f"  {plant}: {found}; rms left {1e9 * found.rms:.2f} nm")
