"""Effort, flow and power of every bond along a motion.

Sizes: N samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.backend import FloatArray
from bondgraph.deriving import system
from bondgraph.elements import Sensor, Switched, symbol
from bondgraph.errors import UnusableInput, unknown_name
from bondgraph.graph import BondGraph
from bondgraph.modulation import TIME
from bondgraph.naming import Names
from bondgraph.printing import to_casadi
from bondgraph.programming import law_functions
from bondgraph.relations import Relation
from bondgraph.simulate import Trajectory
from bondgraph.system import System

__all__ = ["BondPower", "Motion", "in_its_mode", "motion", "observables", "power_bonds"]


@dataclass(frozen=True)
class BondPower:
    """A bond along a motion; power is positive along the half arrow.

    Attributes
    ----------
    tail, head : str
    effort, flow, power : ndarray, shape (N,), SI
    """

    tail: str
    head: str
    effort: FloatArray
    flow: FloatArray
    power: FloatArray

    @property
    def name(self) -> str:
        """Text such as ``loop>R_e``."""
        return f"{self.tail}>{self.head}"


@dataclass(frozen=True)
class Motion:
    """Every signal of a model along a trajectory.

    Attributes
    ----------
    model : System
    time : ndarray, shape (N,), s
    signals : dict of str to ndarray, shape (N,)
    parameters : dict of str to float
    bonds : tuple of BondPower
    """

    model: System
    time: FloatArray
    signals: Mapping[str, FloatArray]
    parameters: Mapping[str, float]
    bonds: tuple[BondPower, ...]


def in_its_mode(graph: BondGraph) -> BondGraph:
    """Return the graph with its switched junctions replaced, as `system` takes them."""
    if not graph.of_type(Switched):
        return graph
    from bondgraph.modes import in_mode

    return in_mode(graph)


def power_bonds(graph: BondGraph) -> tuple[Any, ...]:
    """Return the bonds that carry power: all but the taps of sensors."""
    return tuple(
        b
        for b in graph.bonds
        if not isinstance(graph[b.tail], Sensor) and not isinstance(graph[b.head], Sensor)
    )


def observables(graph: BondGraph) -> tuple[str, ...]:
    """Return what a trajectory must hold, so that every bond follows from it.

    States, algebraic unknowns and inputs: ``simulate(..., observed=observables(graph))``, or any
    `Trajectory` made of the states that an integrator of `Program` returns. Pseudo-inputs are
    known; rates of inputs are taken by central differences where they are not given.
    """
    return _needed(system(graph))


def _needed(model: System) -> tuple[str, ...]:
    inputs = tuple(u for u in model.inputs if u != "one" and not u.startswith("ramp"))
    return (*model.states, *(a.name for a in model.algebraic), *inputs)


def motion(
    graph: BondGraph, trajectory: Trajectory, parameters: Mapping[str, float] | None = None
) -> Motion:
    """Return all signals of `graph` along `trajectory`.

    Signals that the trajectory holds are taken from it, deviations of laws too; the others follow
    from the exact equations.

    Parameters
    ----------
    parameters : dict of str to float
        Values that differ from the declared ones, as given to the simulation.

    Raises
    ------
    UnusableInput
        A state or an input is missing, or the trajectory has no two samples.
    """
    model = system(graph)
    values = {n: p.value for n, p in model.parameters.items()}
    for n, v in (parameters or {}).items():
        if n not in values:
            raise unknown_name("parameter", n, graph.name, values)
        values[n] = float(v)
    time = np.asarray(trajectory.time, float)
    if time.ndim != 1 or time.size < 2:
        raise UnusableInput(f"{graph.name}: the trajectory needs at least two samples")
    signals = _given(model, trajectory, time)
    signals |= _followed(model, trajectory, signals, values)
    names = Names(graph := in_its_mode(graph))
    bonds = []
    for b in power_bonds(graph):
        e, f = signals[names.effort(b)], signals[names.flow(b)]
        bonds.append(BondPower(b.tail, b.head, e, f, e * f))
    return Motion(model, time, signals, values, tuple(bonds))


def _given(model: System, trajectory: Trajectory, time: FloatArray) -> dict[str, FloatArray]:
    known = {*model.index, *_needed(model), *model.input_rates}
    found = {n: np.asarray(v, float) for n, v in trajectory.outputs.items() if n in known}
    for n, v in found.items():
        if v.shape != time.shape:
            raise UnusableInput(f"{model.name}: {n} has shape {v.shape}, time has {time.shape}")
    found[str(TIME)] = time - time[0]
    found["one"] = np.ones_like(time)
    for u in model.inputs:
        if u.startswith("ramp"):
            found[u] = np.linspace(0.0, 1.0, time.size) ** int(u[4:] or 1)
    missing = [n for n in _needed(model) if n not in found]
    if missing:
        raise UnusableInput(
            f"{model.name}: the trajectory lacks {', '.join(missing)}; simulate with "
            "observed=observables(graph) of bondgraph.energy"
        )
    for n in model.input_rates:
        if n not in found:
            order, _, source = n.partition("_")
            rate = found[source]
            for _ in range(int(order[1:] or 1)):
                rate = np.gradient(rate, time, edge_order=min(2, time.size - 1))
            found[n] = rate
    return found


def _followed(
    model: System,
    trajectory: Trajectory,
    given: Mapping[str, FloatArray],
    parameters: Mapping[str, float],
) -> dict[str, FloatArray]:
    """Evaluate all relations whose target is not given, in one compiled call."""
    order = list(given)
    columns = {n: ca.SX.sym(n) for n in order}
    value: dict[str, Any] = dict(columns)
    table = {p.symbol: parameters[n] for n, p in model.parameters.items()}
    rows = [given[n] for n in order]
    inputs = [columns[n] for n in order]

    def law(position: int) -> Any:
        use = model.laws[position]
        if use.element in trajectory.laws:
            w = ca.SX.sym(f"w_{use.element}")
            inputs.append(w)
            rows.append(np.asarray(trajectory.laws[use.element][1], float))
            return w
        if use.law.n_memory or use.law.timed:
            raise UnusableInput(
                f"{model.name}: the law of {use.element} has memory and the trajectory does not "
                f"hold its values; give Trajectory.laws[{use.element!r}] = (argument, deviation)"
            )
        q = ca.DM([parameters[n] for n in use.parameters])
        return law_functions(use.law, q.numel())[0](value[use.argument], ca.SX(0, 1), q, 0.0)

    def of(r: Relation) -> Any:
        reads = {symbol(s): value[s] for s in r.reads}
        total: Any = ca.SX(0.0)
        for c, s in r.terms:
            k = c if isinstance(c, int) else to_casadi(c, {**table, **reads})
            total = total + k * value[s]
        if r.expression is not None:
            total = total + to_casadi(r.expression, {**table, **reads})
        return total if r.law is None else total + law(r.law)

    new = []
    for r in model.relations:
        if r.target not in value:
            value[r.target] = of(r)
            new.append(r.target)
    column = ca.densify(ca.vertcat(*[ca.SX(value[n]) for n in new])) if new else ca.SX(0, 1)
    function = ca.Function("signals", [ca.vertcat(*inputs)], [column])
    found = np.asarray(function(np.vstack(rows)), float)
    if not np.isfinite(found).all():
        bad = new[int(np.argmin(np.isfinite(found).all(axis=1)))]
        raise UnusableInput(f"{model.name}: {bad} is not finite along the trajectory")
    return dict(zip(new, found, strict=True))
