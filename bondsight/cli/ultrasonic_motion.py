"""Motion of the ultrasonic actuator: open loop and the sampled position loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from actuators import ultrasonic as us
from bondgraph.support.errors import UnusableInput
from bondsight.cli.ultrasonic_figure import Draw

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RATES = (50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 16e3)
"""Hz. The text prints no rate of real-time readings; tens to hundreds a second are an estimate
for one request at a time over USB, 16 kHz is the printed limit of the normal mode."""


def open_loop() -> tuple[int, Draw]:
    """How far a constant voltage brings stages on rough guides."""
    print(
        "friction drawn, not measured: uniform in 0..0.5 N every 0.5 mm; 64 starts in the lower "
        "half of the 18 mm"
    )
    shown = {}
    for seed in (0, 1, 2):
        stage = us.guided_stage(seed)
        print(
            f"guide {seed}: sure to move everywhere from {us.lowest_sure_voltage(stage):.2f} V on; "
            f"{1e3 * us.speed_at_sure_voltage(stage):.0f} mm/s where friction is lowest"
        )
        for volt in (3.0, 4.0, 10.0):
            r = us.constant_voltage(volt, seed=seed)
            pulse = us.constant_voltage(volt, duration=0.02, seed=seed)
            shown[seed, volt] = r
            print(
                f"guide {seed}, {volt:4.1f} V for 0.6 s: {100 * r.not_started:5.1f} % never move, "
                f"{100 * r.stuck:5.1f} % get stuck, {100 * r.arrived:5.1f} % arrive, end positions "
                f"spread {1e3 * r.spread:.3f} mm; after 20 ms the distances spread "
                f"{100 * pulse.relative_spread:.1f} % of {1e3 * float(np.mean(pulse.moved)):.2f} mm"
            )

    def draw(axes: Sequence[Axes]) -> None:
        for a, volt in zip(axes, (3.0, 10.0), strict=True):
            r = shown[0, volt]
            a.plot(1e3 * r.time[::10], 1e3 * r.position[:24, ::10].T, lw=0.7)
            a.set(xlabel="time [ms]", ylabel="position [mm]", title=f"{volt:g} V")

    return 2, draw


def closed_loop() -> tuple[int, Draw]:
    """Which sample rate a position loop needs, by margin, by poles and by simulation."""
    lead = us.ultrasonic_stage().parameters
    tau = lead["m"].value / lead["b"].value
    print("one whole sample from reading to force, hold of one sample; rates in Hz")
    for crossover in (2.0, 5.0, 10.0, 20.0, 50.0):
        for derivative in (0.0, tau):
            loop = us.designed(crossover, derivative=derivative)
            stable = us.stability_rate(loop)
            try:
                enough = f"{us.margin_rate(loop):8.1f}"
            except UnusableInput:
                enough = "    none"
            name = "PID" if derivative else "PI "
            print(
                f"crossover {crossover:4.0f} Hz, {name}: stable above {stable:7.1f}, 45 degrees "
                f"above {enough}"
            )
    for rate in RATES[:5]:
        print(
            f"  at {rate:g} Hz the stage goes {1e3 * us.M661.max_velocity / rate:.1f} mm a sample"
        )
    loop = us.designed(20.0, derivative=tau)
    stable = us.stability_rate(loop)
    print("PID of 20 Hz without dry friction, step of 0.2 mm:")
    smooth = {}
    for factor in (0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 8.0):
        a = us.step_answer(loop.controller, us.Sampling(factor * stable), step=2e-4, duration=3.0)
        smooth[factor] = a
        radius = us.spectral_radius(loop, factor * stable)
        print(
            f"  {factor * stable:7.1f} Hz ({factor:4.2f} of the limit, largest pole {radius:.4f}): "
            f"overshoot {100 * a.overshoot:6.0f} %, swing at the end {1e6 * a.swing:10.4f} um"
        )
    stage = us.guided_stage(0, holding=us.M661.holding_force)
    kick = replace(loop.controller, breakaway=0.5)
    print("the same with dry friction of 0..0.5 N and 0.5 N added towards the target, step 2 mm:")
    rough = {}
    for rate in RATES:
        lines = []
        for tolerance in (0.0, 1e-5, 1e-4):
            way = us.Sampling(rate, tolerance=tolerance)
            a = us.step_answer(kick, way, stage=stage, step=2e-3, duration=1.0)
            rough[rate, tolerance] = a
            lines.append(f"{1e6 * a.swing:9.2f} um (error {1e6 * a.error:8.1f})")
        print(f"  {rate:7.0f} Hz: swing with tolerance 0 / 10 / 100 um: " + "; ".join(lines))

    def draw(axes: Sequence[Axes]) -> None:
        for factor in (0.95, 1.05, 1.25, 2.0):
            a = smooth[factor]
            axes[0].plot(a.time, 1e3 * a.position, lw=0.8, label=f"{factor:g} of the limit")
        axes[0].set(xlim=(0, 0.6), ylim=(7.4, 8.8), title="without dry friction")
        for rate in (100.0, 500.0, 2e3, 16e3):
            a = rough[rate, 1e-5]
            axes[1].plot(a.time, 1e3 * a.position, lw=0.8, label=f"{rate:g} Hz")
        axes[1].set(xlim=(0, 0.3), title="with dry friction, tolerance 10 um")
        for a_ in axes:
            a_.set(xlabel="time [s]", ylabel="position [mm]")
            a_.legend(fontsize=7)

    return 2, draw
