"""Motion of the ultrasonic actuator: open loop and the sampled position loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from actuators import ultrasonic as us
from bondgraph.support.errors import UnusableInput

RATES = (50.0, 100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 16e3)
"""Hz. The text prints no rate of real-time readings; tens to hundreds a second are an estimate
for one request at a time over USB, 16 kHz is the printed limit of the normal mode."""


@dataclass(frozen=True, slots=True)
class OpenLoopStudy:
    """Runs at a guide (its seed) and a control voltage (V), for 0.6 s and as a pulse of 20 ms."""

    guides: Mapping[int, us.Stage]
    runs: Mapping[tuple[int, float], us.Runs]
    pulses: Mapping[tuple[int, float], us.Runs]

    def __str__(self) -> str:
        """Return the numbers."""
        lines = [
            "friction drawn, not measured: uniform in 0..0.5 N every 0.5 mm; 64 starts in the "
            "lower half of the 18 mm"
        ]
        for seed, stage in self.guides.items():
            lines.append(
                f"guide {seed}: sure to move everywhere from {us.lowest_sure_voltage(stage):.2f} V "
                f"on; {1e3 * us.speed_at_sure_voltage(stage):.0f} mm/s where friction is lowest"
            )
            for (_, volt), r in ((k, r) for k, r in self.runs.items() if k[0] == seed):
                pulse = self.pulses[seed, volt]
                lines.append(
                    f"guide {seed}, {volt:4.1f} V for 0.6 s: {100 * r.not_started:5.1f} % never "
                    f"move, {100 * r.stuck:5.1f} % get stuck, {100 * r.arrived:5.1f} % arrive, end "
                    f"positions spread {1e3 * r.spread:.3f} mm; after 20 ms the distances spread "
                    f"{100 * pulse.relative_spread:.1f} % of "
                    f"{1e3 * float(np.mean(pulse.moved)):.2f} mm"
                )
        return "\n".join(lines)


def open_loop() -> OpenLoopStudy:
    """How far a constant voltage brings stages on rough guides."""
    cases = [(seed, volt) for seed in (0, 1, 2) for volt in (3.0, 4.0, 10.0)]
    return OpenLoopStudy(
        {seed: us.guided_stage(seed) for seed in (0, 1, 2)},
        {(s, v): us.constant_voltage(v, seed=s) for s, v in cases},
        {(s, v): us.constant_voltage(v, duration=0.02, seed=s) for s, v in cases},
    )


@dataclass(frozen=True, slots=True)
class CrossoverRates:
    """Sample rates (Hz) above which a loop of `crossover` (Hz) is stable, and has 45 degrees."""

    crossover: float
    derivative: bool
    stable: float
    margin: float | None


@dataclass(frozen=True, slots=True)
class ClosedLoopStudy:
    """Rates that a position loop needs, and answers to steps.

    Attributes
    ----------
    rates : tuple of CrossoverRates
    present : float
        What the PI loop of 10 Hz needs (Hz) if its integral holds the present error too.
    loop : SampledLoop
        PID of 20 Hz, stable above `stable` Hz.
    smooth : mapping of float to Answer
        Share of `stable` -> answer without dry friction.
    rough : mapping of (float, float) to Answer
        Rate (Hz) and tolerance (m) -> answer with dry friction.
    """

    rates: tuple[CrossoverRates, ...]
    present: float
    loop: us.SampledLoop
    stable: float
    smooth: Mapping[float, us.Answer]
    rough: Mapping[tuple[float, float], us.Answer]

    def __str__(self) -> str:
        """Return the numbers."""
        lines = [
            "one whole sample from reading to force, hold of one sample; rates in Hz",
            "the integral holds the errors before the present one; with that too PI of 10 Hz needs "
            f"{self.present:.1f}",
        ]
        lines += [
            f"crossover {r.crossover:4.0f} Hz, {'PID' if r.derivative else 'PI '}: stable above "
            f"{r.stable:7.1f}, 45 degrees above "
            + ("    none" if r.margin is None else f"{r.margin:8.1f}")
            for r in self.rates
        ]
        lines += [
            f"  at {rate:g} Hz the stage goes {1e3 * us.M661.max_velocity / rate:.1f} mm a sample"
            for rate in RATES[:5]
        ]
        lines.append("PID of 20 Hz without dry friction, step of 0.2 mm:")
        for factor, a in self.smooth.items():
            rate = factor * self.stable
            lines.append(
                f"  {rate:7.1f} Hz ({factor:4.2f} of the limit, largest pole "
                f"{us.spectral_radius(self.loop, rate):.4f}): "
                f"overshoot {100 * a.overshoot:6.0f} %, swing at the end {1e6 * a.swing:10.4f} um"
            )
        lines.append(
            "the same with dry friction of 0..0.5 N and 0.5 N added towards the target, step 2 mm:"
        )
        for rate in RATES:
            answers = [a for (r, _), a in self.rough.items() if r == rate]
            swings = [f"{1e6 * a.swing:9.2f} um (error {1e6 * a.error:8.1f})" for a in answers]
            lines.append(
                f"  {rate:7.0f} Hz: swing with tolerance 0 / 10 / 100 um: " + "; ".join(swings)
            )
        return "\n".join(lines)


def closed_loop() -> ClosedLoopStudy:
    """Which sample rate a position loop needs, by margin, by poles and by simulation."""
    lead = us.ultrasonic_stage().parameters
    tau = lead["m"].value / lead["b"].value
    rates = tuple(
        _rates(crossover, derivative)
        for crossover in (2.0, 5.0, 10.0, 20.0, 50.0)
        for derivative in (0.0, tau)
    )
    loop = us.designed(20.0, derivative=tau)
    stable = us.stability_rate(loop)
    smooth = {
        f: us.step_answer(loop.controller, us.Sampling(f * stable), step=2e-4, duration=3.0)
        for f in (0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 8.0)
    }
    stage = us.guided_stage(0, holding=us.M661.holding_force)
    kick = replace(loop.controller, breakaway=0.5)
    rough = {
        (rate, tolerance): us.step_answer(
            kick, us.Sampling(rate, tolerance=tolerance), stage=stage, step=2e-3, duration=1.0
        )
        for rate in RATES
        for tolerance in (0.0, 1e-5, 1e-4)
    }
    present = us.stability_rate(us.designed(10.0), present=True)
    return ClosedLoopStudy(rates, present, loop, stable, smooth, rough)


def _rates(crossover: float, derivative: float) -> CrossoverRates:
    loop = us.designed(crossover, derivative=derivative)
    try:
        margin: float | None = us.margin_rate(loop)
    except UnusableInput:
        margin = None
    return CrossoverRates(crossover, bool(derivative), us.stability_rate(loop), margin)
