"""Hysteresis compensation of the stack, measured: exact inverses, robustness, closed loop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuators.compensation import (
    P840_1,
    AnalyticMotion,
    BondGraphStack,
    ControlLoop,
    DriveLimits,
    LumpedStack,
    ProportionalIntegral,
    SampledPlant,
    VirtualActuator,
    actuator_like,
    bond_graph_residual,
    choose_gains,
    deviating,
    feedforward,
    field_law,
    lumped_residual,
    margins,
    model_voltages,
    operator_residual,
    run_loop,
    smooth_reference,
    strategies,
    thesis_reference,
    tracking,
    voltage_steps,
)
from bondgraph.hysteresis import AlJanaideh, Ang, MaxwellResistiveCapacitor
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

__all__ = ["bench_response", "compensate"]

FORMATS = (".svg", ".png")
MODEL, OTHER = AlJanaideh.stack_2hz(), Ang.stack_2hz()
"""Eq. (6.2) and (6.3): one stack; the virtual actuators are drawn around the first."""
NANO = 1e9


@dataclass(frozen=True, slots=True)
class CompensationSetting:
    """What all runs on the virtual actuator share."""

    loops: Mapping[str, ControlLoop]
    controller: ProportionalIntegral
    envelope: DriveLimits
    sample_rate: float
    linear_gain: float
    noise: float
    seed: int


def compensate(
    out: Path,
    *,
    frequencies: Iterable[float] = (1.0, 50.0),
    sample_rate: float = 20_000.0,
    limits: tuple[float, float] = (0.0, 100.0),
    spread: float = 0.1,
    noise: float = 2e-9,
    gain_margin: float = 2.0,
    phase_margin: float = 60.0,
    seed: int = 1,
) -> int:
    """Print the tables of the compensation and draw its figure (.svg, .png); return 0.

    Parameters
    ----------
    out : Path
    frequencies, sample_rate : iterable of float, float
        Of the reference (the first one is drawn) and of the loop, Hz.
    limits : tuple of float
        Voltages the actuator may see, V.
    spread, noise, seed : float, float, int
        Relative spread of the actuator's weights and thresholds, standard deviation of the
        displacement sensor (m), and the seed of both.
    gain_margin, phase_margin : float
        Least margins of the loop, factor and degrees.

    Raises
    ------
    UnusableInput, VoltageLimit
        If an option cannot be used, or the reference does not fit into the limits.
    """
    out = Path(out)
    rates = tuple(frequencies)
    if out.suffix.lower() not in FORMATS:
        raise UnusableInput(f"compensate: figure {out} must end in {' or '.join(FORMATS)}")
    if not out.parent.is_dir():
        raise UnusableInput(f"compensate: the folder of {out} does not exist; make it first")
    if not rates or not all(0.0 < f <= sample_rate / 40 for f in rates):
        raise UnusableInput(
            f"compensate: frequencies {rates} Hz must lie above 0 and up to 1/40 of the sample "
            f"rate {sample_rate:g} Hz"
        )
    if not (0.0 <= spread < 0.5 and noise >= 0.0):
        raise UnusableInput(
            f"compensate: needs 0 <= spread {spread:g} < 0.5 and noise {noise:g} >= 0"
        )
    envelope = DriveLimits(*limits)
    gain = _inverse_operators(envelope, seed)
    _whole_models(envelope)
    actuator = actuator_like(MODEL)
    plants = [_sampled(actuator, slipping, sample_rate) for slipping in (True, False)]
    controller = choose_gains(
        [p.scaled(1.0 / p.static_gain) for p in plants], gain=gain_margin, phase=phase_margin
    )
    loops = strategies(MODEL, OTHER, gain, controller, envelope=envelope, sample_rate=sample_rate)
    setting = CompensationSetting(loops, controller, envelope, sample_rate, gain, noise, seed)
    scenarios = deviating(actuator, seed, spread)
    _margin_table(setting, actuator, scenarios["all"])
    for f in rates:
        _tracking_table(setting, scenarios, f)
    _bench_table(setting, dict(list(scenarios.items())[:2]), max(rates))
    _figure(setting, scenarios["all"], rates[0], out)
    print(f"\nfigure: {out}")
    return 0


def _inverse_operators(envelope: DriveLimits, seed: int) -> float:
    """Print how exact the operator inverses are; return the secant gain of `MODEL`, m/V."""
    x_ref = thesis_reference(np.linspace(0.0, 2.0, 20_001)).x
    history = np.append(np.random.default_rng(seed).uniform(0.0, 100.0, 40), 0.0)
    print("== inverse operators, reference (7.3), simulated: V range, largest error (nm)")
    for operator in (MODEL, OTHER):
        virgin, used = operator.initial_memory(0.0), operator.run(history)[1]
        for word, memory, believed, limits in (
            ("virgin", virgin, virgin, envelope),
            ("used, memory known", used, used, P840_1),
            ("used, taken for virgin", used, virgin, envelope),
        ):
            v, e = operator_residual(operator, operator, x_ref, memory, believed, envelope=limits)
            print(
                f"{operator.kind:12s} {word:23s} {v.min():6.2f} .. {v.max():5.2f} V  "
                f"{NANO * np.abs(e).max():9.2e}"
            )
    return float(x_ref.max() / feedforward(MODEL, x_ref, envelope=envelope).max())


def _whole_models(envelope: DriveLimits) -> None:
    """Print how exact the inverses of whole models are."""
    print(
        "\n== inverse models, simulated: rms, largest error (nm); steps of V at 0 and half a period"
    )
    maxwell, lumped, stack = MaxwellResistiveCapacitor.stack_2hz(), LumpedStack(), BondGraphStack()
    law = field_law(OTHER, stack)
    for f in (1.0, 50.0, 500.0):
        time = np.linspace(0.0, 2.0 / f, 20_001)
        for name, reference in (("(7.3)", thesis_reference), ("smooth", smooth_reference)):
            e = lumped_residual(reference(time, f), maxwell, lumped, envelope=envelope)
            steps = voltage_steps(reference, f, maxwell, lumped)
            _residual_line(f"lumped, {name}", f, e, f"  {steps[0]:8.1e} V  {steps[1]:8.1e} V")
        e = bond_graph_residual(smooth_reference(time, f), law, stack, envelope=envelope)
        _residual_line("bond graph, smooth", f, e)


def _residual_line(name: str, f: float, e: FloatArray, more: str = "") -> None:
    rms, largest = NANO * float(np.sqrt(np.mean(e**2))), NANO * float(np.abs(e).max())
    print(f"{name:20s} {f:5g} Hz  {rms:8.1e} {largest:8.1e}{more}")


def _sampled(actuator: VirtualActuator, slipping: bool, sample_rate: float) -> SampledPlant:
    a, b = actuator.linear_model(slipping=slipping)
    return SampledPlant.from_continuous(a, b, np.eye(b.size)[1], 1.0 / sample_rate)


def _margin_table(
    setting: CompensationSetting, actuator: VirtualActuator, worst: VirtualActuator
) -> None:
    c = setting.controller
    print(
        f"\n== closed loop at {setting.sample_rate:g} Hz: kp {c.proportional:.4g}, "
        f"ki {c.integral:.4g} 1/s"
    )
    print("gain margin, phase margin, delay margin, crossover, loop gain at the resonance, poles")
    for name, real, by in (
        ("behind the inverse", actuator, 0.0),
        ("behind a plain gain", actuator, setting.linear_gain),
        ("all deviations, inverse", worst, 0.0),
    ):
        for slipping, word in ((True, "within a stroke"), (False, "after a reversal")):
            plant = _sampled(real, slipping, setting.sample_rate)
            # the inverse divides by the slope of the model, the plain gain always by the same
            own = by or _sampled(actuator, slipping, setting.sample_rate).static_gain
            m = margins(plant.scaled(1.0 / own), c)
            print(
                f"{name:24s} {word:17s} {m.gain:5.2f}  {m.phase:5.1f} deg  {1e6 * m.delay:6.0f} us "
                f"{m.crossover:6.0f} Hz  {m.resonance:5.2f}  {m.radius:.4f}"
            )


def _motions(
    setting: CompensationSetting, frequency: float
) -> tuple[AnalyticMotion, AnalyticMotion, FloatArray]:
    """Return the reference at the samples, the one half a sample later, and the sensor's noise."""
    time = np.arange(round(2.0 * setting.sample_rate / frequency) + 1) / setting.sample_rate
    noise = setting.noise * np.random.default_rng(setting.seed).standard_normal(time.size)
    ahead = thesis_reference(time + 0.5 / setting.sample_rate, frequency)
    return thesis_reference(time, frequency), ahead, noise


def _tracking_table(
    setting: CompensationSetting, scenarios: dict[str, VirtualActuator], frequency: float
) -> None:
    wanted, ahead, noise = _motions(setting, frequency)
    _header("virtual actuator", frequency, scenarios)
    held = 0
    for name, loop in setting.loops.items():
        cells = []
        for actuator in scenarios.values():
            run = run_loop(loop, actuator, wanted.x, noise, preview=ahead.x)
            held += int(run.clipped.sum())
            cells.append(_cell(wanted.x, run.x))
        print(f"{name:20s}" + "".join(cells))
    nominal = next(iter(scenarios.values()))
    voltages = model_voltages(MODEL, nominal, ahead, envelope=setting.envelope)
    for name, voltage in voltages.items():
        runs = (a.run(voltage, setting.sample_rate) for a in scenarios.values())
        print(f"{name:20s}" + "".join(_cell(wanted.x, x) for x in runs))
    low, high = setting.envelope.low, setting.envelope.high
    print(f"samples held at {low:g} or {high:g} V, all runs together: {held}")


def _header(what: str, frequency: float, columns: Iterable[str]) -> None:
    print(f"\n== {what}, reference (7.3) at {frequency:g} Hz: rms/largest error/loop (nm)")
    print(f"{'':20s}" + "".join(f"{c:>14s}" for c in columns))


def _cell(wanted: FloatArray, x: FloatArray) -> str:
    t = tracking(wanted, x)
    values = (NANO * v for v in (t.rms, t.largest, t.thickness))
    return f"{'/'.join(f'{v:.0f}' if v >= 9.95 else f'{v:.1f}' for v in values):>14s}"


def _bench_table(
    setting: CompensationSetting, scenarios: dict[str, VirtualActuator], frequency: float
) -> None:
    """Open loop on the virtual bench, whose equations and integrator are independent."""
    wanted, _, _ = _motions(setting, frequency)
    _header("virtual bench", frequency, scenarios)
    for name, loop in list(setting.loops.items())[:3]:
        voltage = feedforward(loop.model, wanted.x, envelope=setting.envelope)
        runs = (bench_response(a, voltage, setting.sample_rate) for a in scenarios.values())
        print(f"{name:20s}" + "".join(_cell(wanted.x, x) for x in runs))


def bench_response(
    actuator: VirtualActuator, voltage: FloatArray, sample_rate: float
) -> FloatArray:
    """Return the displacement (m) of the bench's plant, the voltage linear between samples.

    Parameters
    ----------
    actuator : VirtualActuator
        Gives the numbers; creep and amplifier are not part of this plant.
    voltage : ndarray, shape (N,), V
    sample_rate : float
        Hz.
    """
    from hardware.simulators.integrator import march
    from hardware.simulators.nonsmooth import MaxwellSlipPlant
    from hardware.simulators.plant import PlantParameters

    a = actuator
    numbers = PlantParameters(
        C_q=a.capacitance, T=a.transducer, k=a.stiffness, m=a.mass, b=a.damping, R_e=a.resistance
    )
    plant = MaxwellSlipPlant(numbers, "C_nl", a.slip_limits, a.slip_gains, 0.0)
    substeps = actuator.substeps(1.0 / sample_rate)
    n = (voltage.size - 1) * substeps
    drive = np.interp(np.arange(n + 1) / substeps, np.arange(voltage.size), voltage)
    path = march(plant, np.full(n, 1.0 / (sample_rate * substeps)), drive)
    return path.x[::substeps]


def _figure(
    setting: CompensationSetting, actuator: VirtualActuator, frequency: float, out: Path
) -> None:
    """Paths over the reference, errors and voltages in time, for the actuator that deviates."""
    from identification.report.canvas import drawing

    wanted, ahead, noise = _motions(setting, frequency)
    with drawing("compensate", 6.2, paper=True) as canvas:
        axes = canvas.figure.subplot_mosaic([["path", "error"], ["path", "voltage"]])
        for name in ("linear feedforward", "Al Janaideh inverse", "PI + inverse"):
            run = run_loop(setting.loops[name], actuator, wanted.x, noise, preview=ahead.x)
            axes["path"].plot(1e6 * wanted.x, 1e6 * run.x, lw=1.0, label=name)
            axes["error"].plot(wanted.time, NANO * (wanted.x - run.x), lw=0.8)
            axes["voltage"].plot(wanted.time, run.voltage, lw=0.8)
        ends = 1e6 * np.array([wanted.x.min(), wanted.x.max()])
        axes["path"].plot(ends, ends, "k:", lw=0.8, label="wanted")
        axes["path"].set(xlabel="reference (um)", ylabel="displacement (um)")
        axes["path"].legend()
        axes["error"].set(xlabel="time (s)", ylabel="error (nm)")
        axes["voltage"].set(xlabel="time (s)", ylabel="voltage (V)")
        canvas.figure.savefig(out, dpi=150)
