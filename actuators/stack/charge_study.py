"""The stack under charge drive: loop, force cycle, drift and leakage, by simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.charge_drive import (
    charge_of,
    corner_frequency,
    current_driven,
    current_for,
    with_spring_load,
)
from actuators.stack.conversions import Polarised, polarisation_operator
from actuators.stack.loop_width import HysteresisLoop, loop_of
from actuators.stack.lumped import stack_lumped
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C
from bondgraph.hysteresis import Ang, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.simulate import simulate
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.ops import FloatArray


@dataclass(frozen=True, slots=True)
class DriveComparison:
    """A loop over the command by voltage and by charge; `curves` holds commands (V, C) and x."""

    name: str
    load: str
    by_voltage: HysteresisLoop
    by_charge: HysteresisLoop
    curves: Mapping[str, tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, slots=True)
class ForceCycle:
    """Loops of x over an external force while the voltage, or the charge, is held."""

    name: str
    by_voltage: HysteresisLoop
    by_charge: HysteresisLoop


@dataclass(frozen=True, slots=True)
class OffsetDrift:
    """Drift (m/s) under an offset current, and what the displacement a charge makes of it."""

    name: str
    rate: float
    expected: float


@dataclass(frozen=True, slots=True)
class LeakyCharge:
    """Leakage (ohm), corner (Hz), gain there without and with Maxwell elements, 2 Hz loop."""

    leak: float
    corner: float
    linear_gain: float
    maxwell_gain: float
    loop: HysteresisLoop


def drive_comparisons() -> tuple[DriveComparison, ...]:
    """Loops under voltage and under equal charge, without and with load; charge a cosine too."""
    time = _even(3001, 0.5e-3)
    wave = 0.5 - 0.5 * np.cos(4 * np.pi * time)
    none = np.zeros(time.size)
    last = slice(2000, 3000)
    found = []
    for stack, free in _stacks().items():
        signal, factor = _charge(free)
        for load, change in LOADS.items():
            graph = change(free)
            volt = simulate(
                graph,
                time,
                {"V_in": 100 * wave, "F_e": none},
                observed=(signal,),
                x0="rest",
                hold="linear",
            )
            current = current_for(time, float(volt[signal].max()) * factor * wave)
            driven = _from_rest(current_driven(graph), time, {"i_in": current, "F_e": none})
            curves = {
                "voltage": (100 * wave[last], volt["x"][last]),
                "charge": (charge_of(time, current)[last], driven["x"][last]),
            }
            by_voltage, by_charge = (loop_of(*curve) for curve in curves.values())
            found.append(DriveComparison(stack, load, by_voltage, by_charge, curves))
    return tuple(found)


def force_cycles() -> tuple[ForceCycle, ...]:
    """Hold the command while an external force goes 0 .. -500 N and back at 2 Hz."""
    time = _even(4001, 0.5e-3)
    ramp = np.minimum(time / 0.5, 1.0)
    force = np.where(time < 0.5, 0.0, -250 + 250 * np.cos(4 * np.pi * (time - 0.5)))
    last = slice(3000, 4000)
    current = current_for(time, 70e-6 * ramp**2 * (3 - 2 * ramp))
    found = []
    for name, graph in _stacks().items():
        volt = simulate(graph, time, {"V_in": 50 * ramp, "F_e": force}, x0="rest", hold="linear")
        driven = _from_rest(current_driven(graph), time, {"i_in": current, "F_e": force})
        loops = (loop_of(force[last], run["x"][last]) for run in (volt, driven))
        found.append(ForceCycle(name, *loops))
    return tuple(found)


def drifts() -> tuple[OffsetDrift, ...]:
    """Integrate an offset current of 1 uA for 10 s."""
    time = _even(1001, 1e-2)
    offset = {"i_in": np.full(1001, 1e-6), "F_e": np.zeros(1001)}
    found = []
    for name, graph in _stacks().items():
        p = {n: v.value for n, v in graph.parameters.items()}
        t, k = p["T"], p["k"]
        per_charge = t if "C_nl" in graph.elements else t / (k * p["C"] + t**2)
        x = _from_rest(current_driven(graph), time, offset)["x"]
        found.append(OffsetDrift(name, float(x[-1] - x[500]) / 5.0, per_charge * 1e-6))
    return tuple(found)


def leaks() -> tuple[LeakyCharge, ...]:
    """Loop and corner with a leakage resistance; the gain at the corner from a simulation."""
    maxwell = stack_lumped(Hysteretic(MaxwellResistiveCapacitor.stack_2hz()))
    p = {n: v.value for n, v in stack_lumped().parameters.items()}
    free = p["C"] + p["T"] ** 2 / p["k"]
    time = _even(3001, 0.5e-3)
    current = current_for(time, 140e-6 * (0.5 - 0.5 * np.cos(4 * np.pi * time)))
    found = []
    for leak in (1e6, 10e6, 100e6):
        corner = corner_frequency(leak, free)
        linear, with_loop = (_gain(g, leak, corner, free) for g in (stack_lumped(), maxwell))
        run = _from_rest(current_driven(maxwell, leak=leak), time, {"i_in": current})
        loop = loop_of(charge_of(time, current)[2000:3000], run["x"][2000:3000])
        found.append(LeakyCharge(leak, corner, linear, with_loop, loop))
    return tuple(found)


def drive_table(rows: tuple[DriveComparison, ...]) -> str:
    """Return the table of `drive_comparisons`."""
    lines = [
        "2 Hz, third period: loop thickness over the command, share of the stroke",
        f"  {'':44s}{'voltage drive':>22s}{'charge drive':>24s}{'ratio':>9s}",
    ]
    lines += [
        f"  {f'{r.name}, {r.load}':44s}{_size(r.by_voltage):>22s}{_size(r.by_charge):>24s}"
        f"{abs(r.by_voltage.percent / r.by_charge.percent):9.0f}"
        for r in rows
    ]
    return "\n".join(lines)


def force_table(rows: tuple[ForceCycle, ...]) -> str:
    """Return the table of `force_cycles`."""
    lines = ["Command held at mid stroke, force cycle 0 .. -500 N: loop of x over the force"]
    for r in rows:
        stiff = [500.0 / loop.stroke / 1e6 for loop in (r.by_voltage, r.by_charge)]
        lines.append(
            f"  {r.name:44s}{_size(r.by_voltage):>22s}{_size(r.by_charge):>24s}   stiffness "
            f"{stiff[0]:.1f} and {stiff[1]:.1f} N/um"
        )
    return "\n".join(lines)


def drift_table(rows: tuple[OffsetDrift, ...]) -> str:
    """Return the table of `drifts`."""
    lines = [
        f"  {r.name:44s}{1e6 * r.rate:8.4f} um/s, (x/q) i_0 = {1e6 * r.expected:.4f} um/s"
        for r in rows
    ]
    return "\n".join(["Offset current of 1 uA for 10 s, from 0 V", *lines])


def leak_table(rows: tuple[LeakyCharge, ...]) -> str:
    """Return the table of `leaks`."""
    lines = ["Leakage across the stack (lumped): corner, gain there (0.7071 if linear), 2 Hz loop"]
    lines += [
        f"  {r.leak / 1e6:5.0f} Mohm: {1e3 * r.corner:7.3f} mHz, gain {r.linear_gain:.4f} linear, "
        f"{r.maxwell_gain:.4f} with Maxwell elements, 2 Hz loop {_size(r.loop)}, "
        f"1 uA offset settles at {r.leak * 1e-6:g} V"
        for r in rows
    ]
    return "\n".join(lines)


def _even(samples: int, step: float) -> FloatArray:
    return np.asarray(np.arange(samples) * step, float)


def _stacks() -> dict[str, BondGraph]:
    maxwell = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
    ang = Hysteretic(polarisation_operator(Ang.stack_2hz()))
    return {
        "lumped, Maxwell": stack_lumped(maxwell, external_force=True),
        "bond graph, Ang": stack_bond_graph(ang, external_force=True),
    }


def _slipping(graph: BondGraph) -> BondGraph:
    """Add a load that sticks and slips: 20 N/um up to 20 N."""
    law = Hysteretic(MaxwellResistiveCapacitor((20e6,), (20.0,)))
    return graph.with_branch("body", (C("load", law=law, unit="N/m"),))


LOADS: dict[str, Callable[[BondGraph], BondGraph]] = {
    "free": lambda g: g,
    "spring 20 N/um": lambda g: with_spring_load(g, 20e6),
    "slipping load 20 N": _slipping,
}


def _size(loop: HysteresisLoop) -> str:
    return f"{1e9 * loop.thickness:.3g} nm, {loop.percent:.3g} %"


def _from_rest(
    graph: BondGraph, time: FloatArray, commands: Mapping[str, FloatArray]
) -> Trajectory:
    """Simulate from all stores empty: a current has no state of rest of its own."""
    return simulate(graph, time, commands, x0=np.zeros(compile_model(graph).n_x), hold="linear")


def _charge(graph: BondGraph) -> tuple[str, float]:
    """Return the signal that holds the charge of the stack, and its factor."""
    return ("q_H", 1.0) if "H" in graph.elements else ("q_C_nl", 1.0 / Polarised().length)


def _gain(graph: BondGraph, leak: float, frequency: float, free: float) -> float:
    """Displacement of the eighth period over that without leakage, amplitude 50 V."""
    time = _even(4001, 8.0 / 4000 / frequency)
    charge = 50.0 * free * np.sin(2 * np.pi * frequency * time)
    commands = {"i_in": current_for(time, charge)}
    x, ideal = (
        _from_rest(current_driven(graph, leak=r), time, commands)["x"][3500:] for r in (leak, None)
    )
    return float(np.ptp(x) / np.ptp(ideal))
