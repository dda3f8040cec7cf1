"""Figures of the studies of the ultrasonic actuator, a row of panels each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuators.ultrasonic import drive_study as drive
from actuators.ultrasonic import motion_study as motion
from actuators.ultrasonic.characteristic import force


def _panels(count: int) -> tuple[Figure, Sequence[Axes]]:
    figure = Figure(figsize=(5.0 * count, 3.6), layout="constrained", dpi=120)
    axes = [figure.add_subplot(1, count, i + 1) for i in range(count)]
    for a in axes:
        a.grid(alpha=0.3)
    return figure, axes


def characteristic_figure(study: drive.CharacteristicStudy) -> Figure:
    """Draw force over voltage, and speeds in time."""
    figure, axes = _panels(2)
    volts = np.linspace(-10, 10, 801)
    axes[0].plot(volts, force(volts))
    axes[0].set(xlabel="control voltage [V]", ylabel="force [N]")
    for volt, speed in study.speeds.items():
        axes[1].plot(1e3 * study.time, 1e3 * speed, label=f"{volt:g} V")
    axes[1].set(xlabel="time [ms]", ylabel="speed [mm/s]")
    axes[1].legend(fontsize=7)
    return figure


def driver_figure(study: drive.DriverStudy) -> Figure:
    """Draw the amplitude after every step."""
    figure, axes = _panels(1)
    for (start, end), a in study.amplitudes.items():
        axes[0].plot(1e3 * study.time, a, label=f"{start} V to {end} V")
    axes[0].set(xlabel="time [ms]", ylabel="amplitude [V of control]")
    axes[0].legend(fontsize=7)
    return figure


def wire_figure(study: drive.WireStudy) -> Figure:
    """Draw the three wires at 10 V against ground and back electrode, and the change."""
    figure, axes = _panels(3)
    w, swapped = study.steady[10.0], study.swapped
    for name, line in (("back", w.back), ("active", w.positive), ("floating", w.negative)):
        axes[0].plot(1e6 * w.time, line, label=name)
    axes[0].set(xlabel="time [us]", ylabel="to ground [V]", xlim=(0, 15))
    axes[1].plot(1e6 * w.time, w.active, label="V_a")
    axes[1].plot(1e6 * w.time, w.passive, label="V_p")
    axes[1].set(xlabel="time [us]", ylabel="to the back electrode [V]", xlim=(0, 15))
    for name, line in (("positive", swapped.positive), ("negative", swapped.negative)):
        axes[2].plot(1e3 * swapped.time, line - swapped.back, lw=0.2, label=name)
    axes[2].set(xlabel="time [ms]", ylabel="to the back electrode [V]", title="9 V to -9 V")
    for a in axes:
        a.legend(fontsize=7, loc="upper right")
    return figure


def resonance_figure(study: drive.ResonanceStudy) -> Figure:
    """Draw detuning and vibration while the plate warms up at 10 V."""
    figure, axes = _panels(2)
    for quality in drive.QUALITIES:
        free, locked = study.warming[quality, 10.0]
        axes[0].plot(free.time[::100], free.detuning[::100], label=f"fixed, Q {quality:g}")
        axes[1].plot(free.time[::100], free.amplitude[::100], label=f"fixed, Q {quality:g}")
    axes[0].plot(locked.time[::100], locked.detuning[::100], "k", label="tracked")
    axes[1].plot(locked.time[::100], locked.amplitude[::100], "k", label="tracked")
    axes[0].set(xlabel="time [s]", ylabel="detuning [Hz]")
    axes[1].set(xlabel="time [s]", ylabel="vibration", ylim=(0, 1.05))
    axes[0].legend(fontsize=7)
    return figure


def open_loop_figure(study: motion.OpenLoopStudy) -> Figure:
    """Draw positions on the first guide."""
    figure, axes = _panels(2)
    for a, volt in zip(axes, (3.0, 10.0), strict=True):
        r = study.runs[0, volt]
        a.plot(1e3 * r.time[::10], 1e3 * r.position[:24, ::10].T, lw=0.7)
        a.set(xlabel="time [ms]", ylabel="position [mm]", title=f"{volt:g} V")
    return figure


def closed_loop_figure(study: motion.ClosedLoopStudy) -> Figure:
    """Draw answers to steps, without and with dry friction."""
    figure, axes = _panels(2)
    for factor in (0.95, 1.05, 1.25, 2.0):
        a = study.smooth[factor]
        axes[0].plot(a.time, 1e3 * a.position, lw=0.8, label=f"{factor:g} of the limit")
    axes[0].set(xlim=(0, 0.6), ylim=(7.4, 8.8), title="without dry friction")
    for rate in (100.0, 500.0, 2e3, 16e3):
        a = study.rough[rate, 1e-5]
        axes[1].plot(a.time, 1e3 * a.position, lw=0.8, label=f"{rate:g} Hz")
    axes[1].set(xlim=(0, 0.3), title="with dry friction, tolerance 10 um")
    for a_ in axes:
        a_.set(xlabel="time [s]", ylabel="position [mm]")
        a_.legend(fontsize=7)
    return figure


TOPICS: Final[dict[str, tuple[Callable[[], Any], Callable[[Any], Figure]]]] = {
    "characteristic": (drive.characteristic, characteristic_figure),
    "driver": (drive.driver_steps, driver_figure),
    "wires": (drive.wires, wire_figure),
    "open_loop": (motion.open_loop, open_loop_figure),
    "closed_loop": (motion.closed_loop, closed_loop_figure),
    "resonance": (drive.resonance, resonance_figure),
}
"""Name -> study, whose text holds its numbers, and what draws it."""
