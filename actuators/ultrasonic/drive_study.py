"""Drive side of the ultrasonic actuator: characteristic, driver, wires, resonance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from actuators import ultrasonic as us
from bondgraph.simulation.simulate import simulate
from bondgraph.support.ops import FloatArray

QUALITIES = (100.0, 350.0, 1000.0)


@dataclass(frozen=True, slots=True)
class CharacteristicStudy:
    """Speeds (m/s, (N,)) after a control voltage (V) was put on, by the bond graph."""

    time: FloatArray
    speeds: Mapping[float, FloatArray]

    def __str__(self) -> str:
        """Return the numbers."""
        sheet = us.M661
        lines = [
            f"data sheet: {sheet.sine_rms:.2f} V rms of a 120 Vpp sine "
            f"(printed {sheet.voltage_rms:g}), "
            f"{sheet.supply_power:.1f} W from the supply (printed {sheet.power:g}), "
            f"b = F/v = {sheet.damping:g} N s/m, at most {sheet.largest_output:.3f} W mechanical "
            f"({100 * sheet.largest_output / sheet.power:.1f} % of 5 W)",
            *(f"  note: {r}" for r in us.REMARKS),
            "the points between 2 V and 6 V join what the text says; they are not digitised",
        ]
        for volt, v in self.speeds.items():
            force = float(us.force(volt))
            lines.append(
                f"{volt:6.1f} V: force {force:6.3f} N, speed {1e3 * v[-1]:7.1f} "
                f"mm/s, F/b {1e3 * force / sheet.damping:7.1f} mm/s"
            )
        return "\n".join(lines)


def characteristic() -> CharacteristicStudy:
    """Voltage to force to speed, by simulation of the bond graph."""
    time = np.asarray(np.arange(1201) * 1e-4, float)

    def speed(volt: float) -> FloatArray:
        command = {"V_c": np.full(time.size, volt)}
        return simulate(
            us.ultrasonic_stage(), time, command, x0=np.zeros(2), hold="linear", accuracy=1e-3
        )["v"]

    return CharacteristicStudy(
        time, {v: speed(v) for v in (-10.0, -4.0, -3.0, 1.5, 3.0, 4.0, 10.0)}
    )


@dataclass(frozen=True, slots=True)
class DriverStudy:
    """Amplitudes (V of control, (N,)) after steps from one to another control voltage."""

    driver: us.Driver
    time: FloatArray
    amplitudes: Mapping[tuple[int, int], FloatArray]

    def settled(self, start: int, end: int) -> float:
        """Return the simulated time (s) to 5 % of a step of `amplitudes`."""
        off = np.abs(self.amplitudes[start, end] - end) > 0.05 * abs(end - start)
        return float(self.time[np.flatnonzero(off)[-1] + 1] - 0.201e-3)

    def __str__(self) -> str:
        """Return the numbers."""
        d = self.driver
        ratio = d.settling_time(-9, 9) / d.settling_time(-4, 4)
        longer = d.settling_time(9, -9) - d.settling_time(-9, 9)
        lines = [
            f"assumed: lag {1e3 * d.lag:.4f} ms = Q/(pi f) at Q = 100; fitted to the ratio 2 and "
            f"to 0.1 ms: slews {1e-3 * d.upward:.2f} V/ms up, {1e-3 * d.downward:.2f} V/ms down"
        ]
        lines += [
            f"{start:3d} V to {end:2d} V settles (5 % of the step) in "
            f"{1e3 * d.settling_time(start, end):.3f} ms, simulated "
            f"{1e3 * self.settled(start, end):.3f} ms"
            for start, end in self.amplitudes
        ]
        lines.append(
            f"ratio {ratio:.3f} (a pure lag has 1, a pure slew 2.25), opposite direction "
            f"{1e3 * longer:.3f} ms longer"
        )
        return "\n".join(lines)


def driver_steps() -> DriverStudy:
    """Settling times of the driver's output."""
    d, time = us.fitted_driver(), np.asarray(np.arange(4001) * 1e-6, float)
    steps = ((-4, 4), (4, -4), (-9, 9), (9, -9))
    commands = {(a, b): np.where(time > 0.2e-3, float(b), float(a)) for a, b in steps}
    return DriverStudy(d, time, {k: us.envelope(time, c, d) for k, c in commands.items()})


@dataclass(frozen=True, slots=True)
class WireStudy:
    """Waveforms on the three wires at control voltages (V), and over a change from 9 to -9 V."""

    plate: us.Plate
    steady: Mapping[float, us.ThreeWire]
    swapped: us.ThreeWire

    def __str__(self) -> str:
        """Return the numbers."""
        lines, sheet, plate = [], us.M661, self.plate
        for v, w in self.steady.items():
            role = "positive" if v > 0 else "negative"
            lines.append(
                f"{v:5.0f} V: {role} electrode active {np.ptp(w.active):.1f} Vpp, "
                f"{np.sqrt(np.mean(w.active**2)):.2f} V rms, floating {np.ptp(w.passive):.2f} Vpp "
                f"to the back electrode; to ground: back {np.ptp(w.back):.1f}, active "
                f"{np.ptp(w.active + w.back):.1f}, floating {np.ptp(w.passive + w.back):.1f} Vpp"
            )
        y = complex(plate.admittance(sheet.frequency))
        return "\n".join(
            [
                *lines,
                f"plate at resonance: {sheet.sine_rms**2 * y.real:.3f} W, "
                f"{1e3 * sheet.sine_rms * abs(y):.0f} mA rms (printed limits {sheet.power:g} W, "
                f"{1e3 * sheet.current:.0f} mA); R_m {plate.resistance:.0f} ohm, "
                f"L_m {1e3 * plate.inductance:.1f} mH, C_m "
                f"{1e12 * plate.motional_capacitance:.1f} pF, coupling {plate.coupling:.3f}",
                f"assumed: C_0 {1e9 * plate.capacitance:g} nF (the printed current allows "
                f"{1e9 * sheet.largest_capacitance:.2f} nF), Q {plate.quality:g}, half the "
                "amplitude on the back electrode",
            ]
        )


def wires() -> WireStudy:
    """Waveforms on the three wires, and what they deliver."""
    step = 1 / (us.M661.frequency * 64)
    time, swap = np.arange(64 * 12) * step, np.arange(64 * 700) * step
    steady = {v: us.three_wire(time, np.full(time.size, v)) for v in (10.0, -10.0)}
    return WireStudy(us.Plate(), steady, us.three_wire(swap, np.where(swap < 0.5e-3, 9.0, -9.0)))


@dataclass(frozen=True, slots=True)
class ResonanceStudy:
    """Runs while the plate warms up, and of locks on a cold plate.

    Attributes
    ----------
    warming : mapping
        Quality and control voltage (V) -> run with a fixed frequency, run with the lock.
    compensated : mapping
        Share of C_0's current that is compensated -> where the lock rests and up to where it
        locks (Hz), and where it ends from three starts (Hz).
    far : tuple of Tracked
        From far below and far above.
    """

    heating: us.Heating
    warming: Mapping[tuple[float, float], tuple[us.Tracked, us.Tracked]]
    compensated: Mapping[float, tuple[float, float, tuple[float, ...]]]
    far: tuple[us.Tracked, ...]

    def __str__(self) -> str:
        """Return the numbers."""
        heating, plate = self.heating, us.Plate()
        lines = [
            f"assumed: {heating.resistance:g} K/W, {heating.time_constant:g} s, "
            f"{1e6 * heating.coefficient:g} ppm/K; loop of {us.PhaseLock().bandwidth:g} Hz; 150 s"
        ]
        for (quality, volt), (free, locked) in self.warming.items():
            rest = us.warm_detuning(us.Plate(quality=quality), heating, volt)
            lines.append(
                f"Q {quality:5.0f}, {volt:4.1f} V: fixed drive ends {free.detuning[-1]:6.1f} Hz "
                f"off (equilibrium {rest:6.1f}), vibration "
                f"{100 * free.amplitude[-1]:5.1f} %, force {free.force[-1]:.3f} N; tracked "
                f"{np.abs(locked.detuning[1000:]).max():.2f} Hz at most, {locked.detuning[-1]:.1e} "
                f"at the end, vibration {100 * locked.amplitude[-1]:.2f} %, force "
                f"{locked.force[-1]:.3f} N, {locked.warming[-1]:.1f} K"
            )
        lines.append(
            f"C_0 uncompensated: omega C_0 R_m = {plate.susceptance * plate.resistance:.3f} > 0.5, "
            f"zero phase of the whole current exists: {us.zero_phase(plate, 0.0) is not None}"
        )
        lines += [
            f"{100 * share:.0f} % compensated: rests {settled:.1f} Hz high, locks below "
            f"{edge:.0f} Hz; from -5000 Hz, 0.97 and 1.03 of that it ends at "
            + ", ".join(f"{e:.1f}" for e in ends)
            for share, (settled, edge, ends) in self.compensated.items()
        ]
        for r in self.far:
            back = r.time[np.flatnonzero(np.abs(r.detuning) > 10)[-1]]
            lines.append(
                f"compensated, from {r.detuning[0]:.0f} Hz: within 10 Hz after {back:.2f} s"
            )
        return "\n".join(lines)


def resonance() -> ResonanceStudy:
    """Heating detunes a fixed drive; a phase-locked loop follows."""
    heating, cold, plate, lock = (
        us.Heating(),
        us.Heating(resistance=0.0),
        us.Plate(),
        us.PhaseLock(),
    )

    def warm(quality: float, volt: float) -> tuple[us.Tracked, us.Tracked]:
        p = us.Plate(quality=quality)
        free = us.run_plate(p, heating, control=volt, duration=150.0)
        return free, us.run_plate(p, heating, lock, control=volt, duration=150.0)

    def partly(share: float) -> tuple[float, float, tuple[float, ...]]:
        settled, edge = us.zero_phase(plate, share) or (float("nan"), float("nan"))
        wide = us.PhaseLock(compensation=share, span=30e3)
        runs = (
            us.run_plate(plate, cold, wide, detuning=f, duration=20.0)
            for f in (-5e3, 0.97 * edge, 1.03 * edge)
        )
        return settled, edge, tuple(float(r.detuning[-1]) for r in runs)

    return ResonanceStudy(
        heating,
        {(quality, volt): warm(quality, volt) for quality in QUALITIES for volt in (10.0, 5.0)},
        {share: partly(share) for share in (0.5, 0.8, 0.9)},
        tuple(us.run_plate(plate, cold, lock, detuning=f, duration=3.0) for f in (-9e3, 9e3)),
    )
