"""Hysteresis compensation of the stack, measured: exact inverses, robustness, closed loop."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuators.compensation import (
    P840_1,
    SAMPLE_RATE,
    UNIPOLAR,
    AdaptiveInverse,
    AnalyticMotion,
    BondGraphStack,
    ControlLoop,
    LumpedStack,
    Margins,
    ProportionalIntegral,
    SampledPlant,
    Tracking,
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

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODEL, OTHER = AlJanaideh.stack_2hz(), Ang.stack_2hz()
"""Eq. (6.2) and (6.3): one stack; the virtual actuators are drawn around the first."""
NOISE = 2e-9
"""Standard deviation of the displacement sensor, m."""
NANO = 1e9
Response = Callable[[VirtualActuator, FloatArray, float], FloatArray]
"""Displacement (m) of an actuator under voltages (V) at a sample rate (Hz)."""


@dataclass(frozen=True, slots=True)
class InverseOperator:
    """Voltages (V) and largest error (m) of the inverse of an operator, starting from `memory`."""

    operator: str
    memory: str
    low: float
    high: float
    largest: float


@dataclass(frozen=True, slots=True)
class InverseModel:
    """Errors (m) of the inverse of a whole model at `frequency` (Hz); steps of the voltage (V)."""

    name: str
    frequency: float
    rms: float
    largest: float
    steps: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class LoopMargins:
    """Margins of a loop while all plays slip, or none."""

    loop: str
    state: str
    margins: Margins


@dataclass(frozen=True, slots=True)
class TrackingTable:
    """Tracking of every strategy (rows) on every actuator (columns); samples held at a limit."""

    what: str
    frequency: float
    columns: tuple[str, ...]
    rows: Mapping[str, tuple[Tracking, ...]]
    held: int = 0

    def __str__(self) -> str:
        """Return the table."""
        title = f"{self.what}, reference (7.3) at {self.frequency:g} Hz: rms/largest error/loop"
        lines = [f"== {title} (nm)", f"{'':20s}" + "".join(f"{c:>14s}" for c in self.columns)]
        lines += [f"{n:20s}" + "".join(map(_cell, row)) for n, row in self.rows.items()]
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class CompensationStudy:
    """What all runs on the virtual actuators share.

    Attributes
    ----------
    actuator : VirtualActuator
        The nominal one.
    scenarios : mapping of str to VirtualActuator
        Those that deviate from it, the nominal one first.
    linear_gain : float
        Secant gain of `MODEL`, m/V.
    """

    actuator: VirtualActuator
    scenarios: Mapping[str, VirtualActuator]
    loops: Mapping[str, ControlLoop]
    controller: ProportionalIntegral
    linear_gain: float
    seed: int

    def margins(self) -> tuple[LoopMargins, ...]:
        """Return the margins behind the inverse, behind a gain, and of the worst actuator."""
        found = []
        for name, real, by in (
            ("behind the inverse", self.actuator, 0.0),
            ("behind a plain gain", self.actuator, self.linear_gain),
            ("all deviations, inverse", self.scenarios["all"], 0.0),
        ):
            for slipping, word in ((True, "within a stroke"), (False, "after a reversal")):
                plant = _sampled(real, slipping)
                # the inverse divides by the slope of the model, the plain gain by the same always
                own = by or _sampled(self.actuator, slipping).static_gain
                m = margins(plant.scaled(1.0 / own), self.controller)
                found.append(LoopMargins(name, word, m))
        return tuple(found)

    def margin_table(self) -> str:
        """Return `margins` as text."""
        c = self.controller
        lines = [
            f"== closed loop at {SAMPLE_RATE:g} Hz: kp {c.proportional:.4g}, "
            f"ki {c.integral:.4g} 1/s",
            "gain margin, phase margin, delay margin, crossover, loop gain at the resonance, poles",
        ]
        for row in self.margins():
            m = row.margins
            lines.append(
                f"{row.loop:24s} {row.state:17s} {m.gain:5.2f}  {m.phase:5.1f} deg  "
                f"{1e6 * m.delay:6.0f} us {m.crossover:6.0f} Hz  {m.resonance:5.2f}  {m.radius:.4f}"
            )
        return "\n".join(lines)

    def tracked(self, frequency: float) -> TrackingTable:
        """Run every strategy on every actuator, two periods at `frequency` (Hz)."""
        wanted, ahead, noise = self._motions(frequency)
        actuators = tuple(self.scenarios.values())
        rows, held = {}, 0
        for name, loop in self.loops.items():
            runs = [run_loop(loop, a, wanted.x, noise, preview=ahead.x) for a in actuators]
            held += sum(int(run.clipped.sum()) for run in runs)
            rows[name] = tuple(tracking(wanted.x, run.x) for run in runs)
        voltages = model_voltages(MODEL, self.actuator, ahead)
        for name, v in voltages.items():
            rows[name] = tuple(tracking(wanted.x, a.run(v, SAMPLE_RATE)) for a in actuators)
        return TrackingTable("virtual actuator", frequency, tuple(self.scenarios), rows, held)

    def open_loop(self, what: str, frequency: float, respond: Response) -> TrackingTable:
        """Run the feedforwards on another plant, `what`, for the first two actuators."""
        wanted, _, _ = self._motions(frequency)
        first = dict(list(self.scenarios.items())[:2])
        rows = {}
        fixed = {
            name: loop.model for name, loop in self.loops.items()
            if not isinstance(loop.model, AdaptiveInverse)
        }  # fmt: skip
        for name, model in list(fixed.items())[:3]:
            v = feedforward(model, wanted.x)
            found = (respond(a, v, SAMPLE_RATE) for a in first.values())
            rows[name] = tuple(tracking(wanted.x, x) for x in found)
        return TrackingTable(what, frequency, tuple(first), rows)

    def figure(self, frequency: float) -> Figure:
        """Draw paths over the reference, errors and voltages in time, with all deviations."""
        from matplotlib.figure import Figure

        wanted, ahead, noise = self._motions(frequency)
        figure = Figure(figsize=(9.3, 6.2), layout="constrained", dpi=150)
        axes = figure.subplot_mosaic([["path", "error"], ["path", "voltage"]])
        worst = self.scenarios["all"]
        for name in ("linear feedforward", "Al Janaideh inverse", "PI + inverse"):
            run = run_loop(self.loops[name], worst, wanted.x, noise, preview=ahead.x)
            axes["path"].plot(1e6 * wanted.x, 1e6 * run.x, lw=1.0, label=name)
            axes["error"].plot(wanted.time, NANO * (wanted.x - run.x), lw=0.8)
            axes["voltage"].plot(wanted.time, run.voltage, lw=0.8)
        ends = 1e6 * np.array([wanted.x.min(), wanted.x.max()])
        axes["path"].plot(ends, ends, "k:", lw=0.8, label="wanted")
        axes["path"].set(xlabel="reference (um)", ylabel="displacement (um)")
        axes["path"].legend(frameon=False)
        axes["error"].set(xlabel="time (s)", ylabel="error (nm)")
        axes["voltage"].set(xlabel="time (s)", ylabel="voltage (V)")
        return figure

    def _motions(self, frequency: float) -> tuple[AnalyticMotion, AnalyticMotion, FloatArray]:
        """Return the reference at the samples, half a sample later, and the sensor's noise."""
        time = np.arange(round(2.0 * SAMPLE_RATE / frequency) + 1) / SAMPLE_RATE
        noise = NOISE * np.random.default_rng(self.seed).standard_normal(time.size)
        ahead = thesis_reference(time + 0.5 / SAMPLE_RATE, frequency)
        return thesis_reference(time, frequency), ahead, noise


def compensation_study(
    *,
    frequencies: Iterable[float] = (),
    spread: float = 0.1,
    seed: int = 1,
) -> CompensationStudy:
    """Draw virtual actuators and design the loops that compensate them.

    Parameters
    ----------
    frequencies : iterable of float
        Of the references that will be asked for (checked here), Hz.
    spread, seed : float, int
        Relative spread of the actuator's weights and thresholds, and the seed of it and of the
        sensor's noise.

    Raises
    ------
    UnusableInput
        If an option cannot be used.
    """
    rates = tuple(frequencies)
    if not all(0.0 < f <= SAMPLE_RATE / 40 for f in rates):
        raise UnusableInput(
            f"compensate: frequencies {rates} Hz must lie above 0 and up to 1/40 of the sample "
            f"rate {SAMPLE_RATE:g} Hz"
        )
    if not 0.0 <= spread < 0.5:
        raise UnusableInput(f"compensate: needs 0 <= spread {spread:g} < 0.5")
    x = thesis_reference(np.linspace(0.0, 2.0, 20_001)).x
    gain = float(x.max() / feedforward(MODEL, x).max())
    actuator = actuator_like(MODEL)
    plants = [_sampled(actuator, slipping) for slipping in (True, False)]
    controller = choose_gains([p.scaled(1.0 / p.static_gain) for p in plants])
    loops = strategies(MODEL, OTHER, gain, controller)
    scenarios = deviating(actuator, seed, spread)
    return CompensationStudy(actuator, scenarios, loops, controller, gain, seed)


def inverse_operators(seed: int) -> tuple[InverseOperator, ...]:
    """Return how exact the operator inverses are on the reference (7.3)."""
    x_ref = thesis_reference(np.linspace(0.0, 2.0, 20_001)).x
    history = np.append(np.random.default_rng(seed).uniform(0.0, 100.0, 40), 0.0)
    found = []
    for operator in (MODEL, OTHER):
        virgin, used = operator.initial_memory(0.0), operator.run(history)[1]
        for word, memory, believed, limits in (
            ("virgin", virgin, virgin, UNIPOLAR),
            ("used, memory known", used, used, P840_1),
            ("used, taken for virgin", used, virgin, UNIPOLAR),
        ):
            v, e = operator_residual(operator, operator, x_ref, memory, believed, envelope=limits)
            numbers = (float(n) for n in (v.min(), v.max(), np.abs(e).max()))
            found.append(InverseOperator(operator.kind, word, *numbers))
    return tuple(found)


def operator_table(rows: Iterable[InverseOperator]) -> str:
    """Return the table of `inverse_operators`."""
    lines = ["== inverse operators, reference (7.3), simulated: V range, largest error (nm)"]
    lines += [
        f"{r.operator:12s} {r.memory:23s} {r.low:6.2f} .. {r.high:5.2f} V  {NANO * r.largest:9.2e}"
        for r in rows
    ]
    return "\n".join(lines)


def inverse_models() -> tuple[InverseModel, ...]:
    """Return how exact the inverses of whole models are."""
    maxwell, lumped, stack = MaxwellResistiveCapacitor.stack_2hz(), LumpedStack(), BondGraphStack()
    law = field_law(OTHER, stack)
    found = []

    def add(name: str, f: float, e: FloatArray, steps: tuple[float, ...] = ()) -> None:
        rms, largest = float(np.sqrt(np.mean(e**2))), float(np.abs(e).max())
        found.append(InverseModel(name, f, rms, largest, steps))

    for f in (1.0, 50.0, 500.0):
        time = np.linspace(0.0, 2.0 / f, 20_001)
        for name, reference in (("(7.3)", thesis_reference), ("smooth", smooth_reference)):
            e = lumped_residual(reference(time, f), maxwell, lumped)
            add(f"lumped, {name}", f, e, tuple(voltage_steps(reference, f, maxwell, lumped)))
        smooth = smooth_reference(time, f)
        add("bond graph, smooth", f, bond_graph_residual(smooth, law, stack))
    return tuple(found)


def model_table(rows: Iterable[InverseModel]) -> str:
    """Return the table of `inverse_models`."""
    lines = [
        "== inverse models, simulated: rms, largest error (nm); steps of V at 0 and half a period"
    ]
    lines += [
        f"{r.name:20s} {r.frequency:5g} Hz  {NANO * r.rms:8.1e} {NANO * r.largest:8.1e}"
        + "".join(f"  {s:8.1e} V" for s in r.steps)
        for r in rows
    ]
    return "\n".join(lines)


def _sampled(actuator: VirtualActuator, slipping: bool) -> SampledPlant:
    a, b = actuator.linear_model(slipping=slipping)
    return SampledPlant.from_continuous(a, b, np.eye(b.size)[1], 1.0 / SAMPLE_RATE)


def _cell(t: Tracking) -> str:
    values = (NANO * v for v in (t.rms, t.largest, t.thickness))
    return f"{'/'.join(f'{v:.0f}' if v >= 9.95 else f'{v:.1f}' for v in values):>14s}"
