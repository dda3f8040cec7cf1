"""Drive side of the ultrasonic actuator: characteristic, driver, wires, resonance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators import ultrasonic as us
from bondgraph import simulate
from bondsight.cli.ultrasonic_figure import Draw

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def characteristic() -> tuple[int, Draw]:
    """Voltage to force to speed, by simulation of the bond graph."""
    sheet = us.M661
    print(
        f"data sheet: {sheet.sine_rms:.2f} V rms of a 120 Vpp sine "
        f"(printed {sheet.voltage_rms:g}), "
        f"{sheet.supply_power:.1f} W from the supply (printed {sheet.power:g}), "
        f"b = F/v = {sheet.damping:g} N s/m, at most {sheet.largest_output:.3f} W mechanical "
        f"({100 * sheet.largest_output / sheet.power:.1f} % of 5 W)"
    )
    for r in us.REMARKS:
        print(f"  note: {r}")
    print("the points between 2 V and 6 V join what the text says; they are not digitised")
    time = np.arange(1201) * 1e-4
    paths = {}
    for volt in (-10.0, -4.0, -3.0, 1.5, 3.0, 4.0, 10.0):
        run = simulate(
            us.ultrasonic_stage(), time, {"V_c": np.full(time.size, volt)}, x0=np.zeros(2)
        )
        paths[volt] = run["v"]
        print(
            f"{volt:6.1f} V: force {float(us.force(volt)):6.3f} N, speed {1e3 * run['v'][-1]:7.1f} "
            f"mm/s, F/b {1e3 * float(us.force(volt)) / sheet.damping:7.1f} mm/s"
        )

    def draw(axes: Sequence[Axes]) -> None:
        volts = np.linspace(-10, 10, 801)
        axes[0].plot(volts, us.force(volts))
        axes[0].set(xlabel="control voltage [V]", ylabel="force [N]")
        for volt, speed in paths.items():
            axes[1].plot(1e3 * time, 1e3 * speed, label=f"{volt:g} V")
        axes[1].set(xlabel="time [ms]", ylabel="speed [mm/s]")
        axes[1].legend(fontsize=7)

    return 2, draw


def driver() -> tuple[int, Draw]:
    """Settling times of the driver's output."""
    d = us.fitted_driver()
    print(
        f"assumed: lag {1e3 * d.lag:.4f} ms = Q/(pi f) at Q = 100; fitted to the ratio 2 and to "
        f"0.1 ms: slews {1e-3 * d.upward:.2f} V/ms up, {1e-3 * d.downward:.2f} V/ms down"
    )
    time = np.arange(4001) * 1e-6
    paths = {}
    for start, end in ((-4, 4), (4, -4), (-9, 9), (9, -9)):
        command = np.where(time > 0.2e-3, float(end), float(start))
        a = us.envelope(time, command, d)
        paths[start, end] = a
        late = np.flatnonzero(np.abs(a - end) > 0.05 * abs(end - start))[-1]
        print(
            f"{start:3d} V to {end:2d} V settles (5 % of the step) in "
            f"{1e3 * d.settling_time(start, end):.3f} ms, simulated "
            f"{1e3 * (time[late + 1] - 0.201e-3):.3f} ms"
        )
    ratio = d.settling_time(-9, 9) / d.settling_time(-4, 4)
    longer = d.settling_time(9, -9) - d.settling_time(-9, 9)
    print(
        f"ratio {ratio:.3f} (a pure lag has 1, a pure slew 2.25), opposite direction "
        f"{1e3 * longer:.3f} ms longer"
    )

    def draw(axes: Sequence[Axes]) -> None:
        for (start, end), a in paths.items():
            axes[0].plot(1e3 * time, a, label=f"{start} V to {end} V")
        axes[0].set(xlabel="time [ms]", ylabel="amplitude [V of control]")
        axes[0].legend(fontsize=7)

    return 1, draw


def wires() -> tuple[int, Draw]:
    """Waveforms on the three wires, and what they deliver."""
    sheet, plate = us.M661, us.Plate()
    step = 1 / (sheet.frequency * 64)
    time = np.arange(64 * 12) * step
    found = {v: us.three_wire(time, np.full(time.size, v)) for v in (10.0, -10.0)}
    for v, w in found.items():
        role = "positive" if v > 0 else "negative"
        print(
            f"{v:5.0f} V: {role} electrode active {np.ptp(w.active):.1f} Vpp, "
            f"{np.sqrt(np.mean(w.active**2)):.2f} V rms, floating {np.ptp(w.passive):.2f} Vpp to "
            f"the back electrode; to ground: back {np.ptp(w.back):.1f}, active "
            f"{np.ptp(w.active + w.back):.1f}, floating {np.ptp(w.passive + w.back):.1f} Vpp"
        )
    y = complex(plate.admittance(sheet.frequency))
    print(
        f"plate at resonance: {sheet.sine_rms**2 * y.real:.3f} W, "
        f"{1e3 * sheet.sine_rms * abs(y):.0f} mA rms (printed limits {sheet.power:g} W, "
        f"{1e3 * sheet.current:.0f} mA); R_m {plate.resistance:.0f} ohm, "
        f"L_m {1e3 * plate.inductance:.1f} mH, C_m "
        f"{1e12 * plate.motional_capacitance:.1f} pF, coupling {plate.coupling:.3f}"
    )
    print(
        f"assumed: C_0 {1e9 * plate.capacitance:g} nF (the printed current allows "
        f"{1e9 * sheet.largest_capacitance:.2f} nF), Q {plate.quality:g}, half the amplitude on "
        "the back electrode"
    )
    swap = np.arange(64 * 700) * step
    swapped = us.three_wire(swap, np.where(swap < 0.5e-3, 9.0, -9.0))

    def draw(axes: Sequence[Axes]) -> None:
        w = found[10.0]
        for name, line in (("back", w.back), ("active", w.positive), ("floating", w.negative)):
            axes[0].plot(1e6 * time, line, label=name)
        axes[0].set(xlabel="time [us]", ylabel="to ground [V]", xlim=(0, 15))
        axes[1].plot(1e6 * time, w.active, label="V_a")
        axes[1].plot(1e6 * time, w.passive, label="V_p")
        axes[1].set(xlabel="time [us]", ylabel="to the back electrode [V]", xlim=(0, 15))
        axes[2].plot(1e3 * swap, swapped.positive - swapped.back, lw=0.2, label="positive")
        axes[2].plot(1e3 * swap, swapped.negative - swapped.back, lw=0.2, label="negative")
        axes[2].set(xlabel="time [ms]", ylabel="to the back electrode [V]", title="9 V to -9 V")
        for a in axes:
            a.legend(fontsize=7, loc="upper right")

    return 3, draw


def resonance() -> tuple[int, Draw]:
    """Heating detunes a fixed drive; a phase-locked loop follows."""
    heating = us.Heating()
    print(
        f"assumed: {heating.resistance:g} K/W, {heating.time_constant:g} s, "
        f"{1e6 * heating.coefficient:g} ppm/K; loop of {us.PhaseLock().bandwidth:g} Hz; 150 s"
    )
    kept = {}
    for quality in (100.0, 350.0, 1000.0):
        plate = us.Plate(quality=quality)
        for volt in (10.0, 5.0):
            free = us.run_plate(plate, heating, control=volt, duration=150.0)
            locked = us.run_plate(plate, heating, us.PhaseLock(), control=volt, duration=150.0)
            kept[quality, volt] = free, locked
            print(
                f"Q {quality:5.0f}, {volt:4.1f} V: fixed drive ends {free.detuning[-1]:6.1f} Hz "
                f"off (equilibrium {us.warm_detuning(plate, heating, volt):6.1f}), vibration "
                f"{100 * free.amplitude[-1]:5.1f} %, force {free.force[-1]:.3f} N; tracked "
                f"{np.abs(locked.detuning[1000:]).max():.2f} Hz at most, {locked.detuning[-1]:.1e} "
                f"at the end, vibration {100 * locked.amplitude[-1]:.2f} %, force "
                f"{locked.force[-1]:.3f} N, {locked.warming[-1]:.1f} K"
            )
    plate = us.Plate()
    print(
        f"C_0 uncompensated: omega C_0 R_m = {plate.susceptance * plate.resistance:.3f} > 0.5, "
        f"zero phase of the whole current exists: {us.zero_phase(plate, 0.0) is not None}"
    )
    cold = us.Heating(resistance=0.0)
    for share in (0.5, 0.8, 0.9):
        settled, edge = us.zero_phase(plate, share) or (float("nan"), float("nan"))
        lock = us.PhaseLock(compensation=share, span=30e3)
        ends = [
            us.run_plate(plate, cold, lock, detuning=f, duration=20.0).detuning[-1]
            for f in (-5e3, 0.97 * edge, 1.03 * edge)
        ]
        print(
            f"{100 * share:.0f} % compensated: rests {settled:.1f} Hz high, locks below "
            f"{edge:.0f} Hz; from -5000 Hz, 0.97 and 1.03 of that it ends at "
            + ", ".join(f"{e:.1f}" for e in ends)
        )
    far = [us.run_plate(plate, cold, us.PhaseLock(), detuning=f, duration=3.0) for f in (-9e3, 9e3)]
    for r in far:
        back = r.time[np.flatnonzero(np.abs(r.detuning) > 10)[-1]]
        print(f"compensated, from {r.detuning[0]:.0f} Hz: within 10 Hz after {back:.2f} s")

    def draw(axes: Sequence[Axes]) -> None:
        for quality in (100.0, 350.0, 1000.0):
            free, locked = kept[quality, 10.0]
            axes[0].plot(free.time[::100], free.detuning[::100], label=f"fixed, Q {quality:g}")
            axes[1].plot(free.time[::100], free.amplitude[::100], label=f"fixed, Q {quality:g}")
        axes[0].plot(locked.time[::100], locked.detuning[::100], "k", label="tracked")
        axes[1].plot(locked.time[::100], locked.amplitude[::100], "k", label="tracked")
        axes[0].set(xlabel="time [s]", ylabel="detuning [Hz]")
        axes[1].set(xlabel="time [s]", ylabel="vibration", ylim=(0, 1.05))
        axes[0].legend(fontsize=7)

    return 2, draw
