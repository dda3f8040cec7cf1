"""The stack under charge drive: loop, force cycle, drift and leakage, by simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators import stack_bond_graph, stack_lumped
from actuators.stack.charge_drive import (
    charge_of,
    corner_frequency,
    current_driven,
    current_for,
    dipole_law,
    with_spring_load,
)
from actuators.stack.loop_width import HysteresisLoop, loop_of
from bondgraph import BondGraph, C, Trajectory, derive, simulate
from bondgraph.hysteresis import Ang, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondsight.cli.stack_figures import charge_figure

__all__ = ["charge_drive"]

FloatArray = NDArray[np.float64]
Commands = Mapping[str, FloatArray]
LENGTH, RATIO = 18e-3, 0.0327
ANG = Ang.stack_2hz()


def charge_drive(figure: Path | None = None) -> int:
    """Loop under voltage and under charge drive, with and without load; drift and corner."""
    print("2 Hz, third period: loop thickness over the command, share of the stroke")
    print(f"  {'':44s}{'voltage drive':>22s}{'charge drive':>24s}{'ratio':>9s}")
    shown: dict[str, tuple[FloatArray, FloatArray]] = {}
    for name, graph in _stacks().items():
        for load, change in LOADS.items():
            by_volt, by_charge, curves = _compare(change(graph))
            if "C_nl" in graph.elements:
                shown.update({f"{load}: {k}": v for k, v in curves.items()})
            print(
                f"  {name + ', ' + load:44s}{_size(by_volt):>22s}{_size(by_charge):>24s}"
                f"{abs(by_volt.percent / by_charge.percent):9.0f}"
            )
    _force_cycle()
    _drift()
    _leak()
    if figure is not None:
        charge_figure(shown, figure)
    return 0


def _even(samples: int, step: float) -> FloatArray:
    return np.asarray(np.arange(samples) * step, float)


def _stacks() -> dict[str, BondGraph]:
    maxwell = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
    ang = Hysteretic(dipole_law(ANG, LENGTH, RATIO))
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


def _from_rest(graph: BondGraph, time: FloatArray, commands: Commands) -> Trajectory:
    """Simulate from all stores empty: a current has no state of rest of its own."""
    return simulate(graph, time, commands, x0=np.zeros(len(derive(graph).states)))


def _charge(graph: BondGraph) -> tuple[str, float]:
    """Return the signal that holds the charge of the stack, and its factor."""
    return ("q_H", 1.0) if "H" in graph.elements else ("q_C_nl", 1.0 / LENGTH)


def _compare(
    graph: BondGraph,
) -> tuple[HysteresisLoop, HysteresisLoop, dict[str, tuple[FloatArray, FloatArray]]]:
    """Loops with equal charge; the command of charge is a cosine too."""
    time = _even(3001, 0.5e-3)
    wave = 0.5 - 0.5 * np.cos(4 * np.pi * time)
    none = np.zeros(time.size)
    name, factor = _charge(graph)
    last = slice(2000, 3000)
    volt = simulate(graph, time, {"V_in": 100 * wave, "F_e": none}, observed=(name,))
    top = float(volt[name].max()) * factor
    current = current_for(time, top * wave)
    driven = _from_rest(current_driven(graph), time, {"i_in": current, "F_e": none})
    q = charge_of(time, current)
    curves = {
        "voltage": (100 * wave[last], volt["x"][last]),
        "charge": (q[last], driven["x"][last]),
    }
    return loop_of(*curves["voltage"]), loop_of(*curves["charge"]), curves


def _force_cycle() -> None:
    """Hold the command while an external force goes 0 .. -500 N and back at 2 Hz."""
    time = _even(4001, 0.5e-3)
    ramp = np.minimum(time / 0.5, 1.0)
    force = np.where(time < 0.5, 0.0, -250 + 250 * np.cos(4 * np.pi * (time - 0.5)))
    last = slice(3000, 4000)
    print("Command held at mid stroke, force cycle 0 .. -500 N: loop of x over the force")
    for name, graph in _stacks().items():
        volt = simulate(
            graph, time, {"V_in": 50 * ramp, "F_e": force}, observed=(_charge(graph)[0],)
        )
        held = 70e-6 * ramp**2 * (3 - 2 * ramp)
        current = current_for(time, held)
        driven = _from_rest(current_driven(graph), time, {"i_in": current, "F_e": force})
        loops = [loop_of(force[last], run["x"][last]) for run in (volt, driven)]
        stiff = [500.0 / loop.stroke / 1e6 for loop in loops]
        print(
            f"  {name:44s}{_size(loops[0]):>22s}{_size(loops[1]):>24s}   stiffness "
            f"{stiff[0]:.1f} and {stiff[1]:.1f} N/um"
        )


def _drift() -> None:
    """Integrate an offset current of 1 uA for 10 s."""
    print("Offset current of 1 uA for 10 s, from 0 V")
    time = _even(1001, 1e-2)
    for name, graph in _stacks().items():
        p = {n: v.value for n, v in graph.parameters.items()}
        t, k = p["T"], p["k"]
        per_charge = t if "C_nl" in graph.elements else t / (k * p["C"] + t**2)
        run = _from_rest(
            current_driven(graph), time, {"i_in": np.full(1001, 1e-6), "F_e": np.zeros(1001)}
        )
        rate = float(run["x"][-1] - run["x"][500]) / 5.0
        print(f"  {name:44s}{1e6 * rate:8.4f} um/s, (x/q) i_0 = {1e6 * per_charge * 1e-6:.4f} um/s")


def _leak() -> None:
    """Loop and corner with a leakage resistance; the gain at the corner from a simulation."""
    print("Leakage across the stack (lumped): corner, gain there (0.7071 if linear), 2 Hz loop")
    maxwell = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
    p = {n: v.value for n, v in stack_lumped().parameters.items()}
    free = p["C"] + p["T"] ** 2 / p["k"]
    for leak in (1e6, 10e6, 100e6):
        corner = corner_frequency(leak, free)
        gains = [
            _gain(graph, leak, corner, free) for graph in (stack_lumped(), stack_lumped(maxwell))
        ]
        time = _even(3001, 0.5e-3)
        current = current_for(time, 140e-6 * (0.5 - 0.5 * np.cos(4 * np.pi * time)))
        run = _from_rest(current_driven(stack_lumped(maxwell), leak=leak), time, {"i_in": current})
        loop = loop_of(charge_of(time, current)[2000:3000], run["x"][2000:3000])
        print(
            f"  {leak / 1e6:5.0f} Mohm: {1e3 * corner:7.3f} mHz, gain {gains[0]:.4f} linear, "
            f"{gains[1]:.4f} with Maxwell elements, 2 Hz loop {_size(loop)}, "
            f"1 uA offset settles at {leak * 1e-6:g} V"
        )


def _gain(graph: BondGraph, leak: float, frequency: float, free: float) -> float:
    """Displacement of the eighth period over that without leakage, amplitude 50 V."""
    time = _even(4001, 8.0 / 4000 / frequency)
    charge = 50.0 * free * np.sin(2 * np.pi * frequency * time)
    commands = {"i_in": current_for(time, charge)}
    x, ideal = (
        _from_rest(current_driven(graph, leak=r), time, commands)["x"][3500:] for r in (leak, None)
    )
    return float(np.ptp(x) / np.ptp(ideal))
