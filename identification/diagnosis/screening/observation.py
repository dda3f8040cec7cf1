"""The past of every port along the fitted record: one simulation with all of them observed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

import numpy as np

from bondgraph.equations.bond_signals import SignalNames
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.domain_check import dimensions_of
from bondgraph.graph.elements import GY, TF, C, Element, I, One, R, Source, TwoPort, Zero
from bondgraph.graph.sensors import De, Df, Dq, Sensor
from bondgraph.signals.units import Dimension
from bondgraph.simulation.dynamics import Dynamics, dynamics_of
from bondgraph.simulation.exact_run import prepare, run_prepared
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput
from identification.diagnosis.screening.port_history import FittedModel, PortHistory, moved_by
from identification.estimation.single_record import Fit
from identification.study.problem import Problem
from identification.study.residual import by_step, parameters_at, time_memories, windows


def scene(nominal: Fit) -> FittedModel:
    """Simulate the fitted model once more with all port variables observed."""
    watched = watched_signals(nominal.problem.graph)
    return scene_of(nominal, watched, _observe(nominal, watched))


def scene_of(
    nominal: Fit, watched: Mapping[str, tuple[str, str]], traces: Mapping[str, Array]
) -> FittedModel:
    """Put together what is known of every port.

    Parameters
    ----------
    watched : mapping
        Names of the argument and the output of every port, by element.
    traces : mapping
        Signals by name, each of shape (N,).
    """
    problem = nominal.problem
    graph, data = problem.graph, problem.data
    past: dict[str, PortHistory] = {}
    for e, (a, b) in watched.items():
        if a not in traces or b not in traces:
            continue
        first, second = traces[a], traces[b]
        flow = second if isinstance(graph[e], TwoPort) else first
        moved = None
        if not isinstance(graph[e], C):
            moved = moved_by(flow, data.dt)
        past[e] = PortHistory(
            first, second, data.dt, moved, _primary_moves(graph, graph[e]),
            recorded=_recorded(nominal, graph[e]),
        )  # fmt: skip
    for s in graph.of_type(Source):
        if s.name in data.commands:
            given = behind_gain(nominal, s)
            past[s.name] = PortHistory(given, given, data.dt)
    simulated = filled(nominal.simulated)
    for i, n in enumerate(data.names):
        past[n] = PortHistory(simulated[:, i], simulated[:, i], data.dt)
    residual = np.where(np.isfinite(nominal.simulated), data.readings - nominal.simulated, 0.0)
    scored = data.mask("train") | data.mask("test")
    return FittedModel(graph, data, nominal, residual * scored[:, None], past)


def _recorded(made: Fit, element: Element) -> Array | None:
    """Return the displacement that a sensor at the junction of an element recorded, shape (N,).

    That of a displacement, or else of a flow, whose readings are added up; before its gain.
    """
    graph, data = made.problem.graph, made.problem.data
    if not isinstance(element, I | R) or not isinstance(at := _junction(graph, element), One):
        return None
    for kind in (Dq, Df):
        for s in graph.of_type(kind):
            gain = channel_number(made, s, "gain") if s.gain is not None else 1.0
            if gain and s.name in data.names and _junction(graph, s) is at:
                y = data.readings[:, data.names.index(s.name)] / gain
                return y if kind is Dq else moved_by(y, data.dt)
    return None


def _junction(graph: BondGraph, element: Element) -> Element:
    return graph[graph.neighbour(element.name)]


def behind_gain(made: Fit, s: Source) -> Array:
    """Return what the law of a drive is given: the command behind gain and offset, shape (N,)."""
    factor, offset = (channel_number(made, s, n) for n in s.channel)
    command = made.problem.data.commands[s.name]
    if s.given != "value":  # its rate or its integral stays what was recorded
        return command
    return (1.0 if factor is None else factor) * command + (offset or 0.0)


def channel_number(made: Fit, s: Source | Sensor, field: str) -> float | None:
    """Return gain or offset of a source or a sensor as fitted; None where it has none."""
    graph = made.problem.graph
    held = graph.channel_value(s, field)
    if held is None:
        return None
    known = {p.symbol: made.values.get(p.name, p.value) for p in graph.parameters.values()}
    return float(held.subs(known))


def _primary_moves(graph: BondGraph, element: Element) -> bool:
    """Whether the primary side of a two-port moves: of a gyrator if current flows in the other."""
    ends = _ends(graph, element) if isinstance(element, GY) else None
    if ends is None:
        return not isinstance(element, GY)
    flows = dimensions_of(graph)
    first, second = (flows[b][1] for b in ends)
    return _carries_current(second) and not _carries_current(first)


def _carries_current(flow: Dimension | None) -> bool:
    return flow is not None and flow[3] != 0


def watched_signals(graph: BondGraph) -> dict[str, tuple[str, str]]:
    """Names of the argument and the output of every port, by element."""
    names = SignalNames(graph)
    found: dict[str, tuple[str, str]] = {}
    for e in graph.elements.values():
        if isinstance(e, C | R | I):
            (b,) = graph.bonds_of(e.name)
            argument = f"q_{e.name}" if isinstance(e, C) else names.flow(b)
            found[e.name] = (argument, names.effort(b))
        elif isinstance(e, TF | GY):
            ends = _ends(graph, e)
            if ends is not None:
                first, second = ends
                far = names.effort(second) if isinstance(e, TF) else names.flow(second)
                found[e.name] = (far, names.flow(first))
    return found


def traced(made: Fit, element: str) -> tuple[Array, Array] | None:
    """Return argument and output of one port along a fit; None where it has none."""
    watched = watched_signals(made.problem.graph)
    if element not in watched:
        return None
    traces = _observe(made, {element: watched[element]})
    argument, output = (traces.get(n) for n in watched[element])
    return None if argument is None or output is None else (argument, output)


def _ends(graph: BondGraph, e: Element) -> tuple[Bond, Bond] | None:
    into = [b for b in graph.bonds_of(e.name) if b.head == e.name]
    out = [b for b in graph.bonds_of(e.name) if b.tail == e.name]
    return (into[0], out[0]) if len(into) == len(out) == 1 else None


def _observe(nominal: Fit, watched: dict[str, tuple[str, str]]) -> dict[str, Array]:
    problem = nominal.problem
    if problem.dynamics.lure is not None:
        return _observe_exact(nominal, sorted({n for pair in watched.values() for n in pair}))
    return _observe_with_sensors(nominal, watched)


def _observe_exact(nominal: Fit, wanted: list[str]) -> dict[str, Array]:
    problem = nominal.problem
    p = parameters_at(problem, nominal.point.theta)
    dynamics, states = problem.dynamics, nominal.point.states

    def fine(u: Array) -> Array:
        return dynamics.fine_inputs(u, problem.steps, problem.data.between)

    return observed(problem, dynamics, p, problem.inputs, states, wanted, fine)


def observed(
    problem: Problem,
    dynamics: Dynamics,
    p: Array,
    u: Array,
    states: Array,
    wanted: Collection[str],
    fine: Callable[[Array], Array],
) -> dict[str, Array]:
    """Run an exact model over a record with signals observed; those it does not have are left out.

    Parameters
    ----------
    dynamics : Dynamics
        The exact one of the problem's graph, or of one with further sources.
    p : ndarray
        Its parameters.
    u : ndarray, shape (N, n_u)
        Its inputs.
    states : ndarray, shape (W, n_x)
        Its states at the start of every window.
    fine : callable
        Inputs at both ends of each sub-step, from those at the samples of a window.

    Returns
    -------
    dict of str to ndarray, shape (N,)

    Raises
    ------
    UnusableInput
        The dynamics is not the exact one.
    """
    if dynamics.lure is None:
        raise UnusableInput(f"{problem.graph.name} is not linear up to scalar laws")
    model = dynamics.lure.model
    names = tuple(sorted(model.signals & set(wanted)))
    seen = replace(dynamics.lure, observed=names)
    ready = by_step(lambda h: prepare(seen, p, h, problem.steps))
    trace = np.full((problem.data.n, len(names)), np.nan)
    for w, x0 in zip(windows(problem), states, strict=True):
        memory = time_memories(problem, w.start)
        run = run_prepared(ready(problem.data.step(w)), u[w], x0, fine=fine(u[w]), memory=memory)
        trace[w] = run.y[:, seen.n_y :]
    trace = filled(trace)
    return {n: trace[:, i] for i, n in enumerate(names)}


def _observe_with_sensors(nominal: Fit, watched: dict[str, tuple[str, str]]) -> dict[str, Array]:
    """Attach sensors to every port: works for any model of the language."""
    problem = nominal.problem
    known = {n: v for n, v in nominal.values.items() if n in problem.with_chain.parameters}
    graph = problem.with_chain.with_values(known)
    sensed: dict[str, str] = {}
    for name, (argument, output) in watched.items():
        try:
            wider, added = _with_sensors(graph, graph[name], argument, output)
            dynamics_of(wider)
        except BondsightError:
            continue
        graph, sensed = wider, {**sensed, **added}
    dynamics = dynamics_of(graph)
    values = {n: v for n, v in nominal.values.items() if n in dynamics.parameters}
    p = dynamics.vector(values)
    ready = by_step(lambda h: dynamics.prepare(p, h, problem.n_sub, [], False))
    rows = nominal.point.states.shape[0]
    by_name = dict(zip(problem.dynamics.state_names, nominal.point.states.T, strict=True))
    x0 = np.zeros((rows, dynamics.n_x))
    for i, n in enumerate(dynamics.state_names):
        x0[:, i] = by_name.get(n, 0.0)
    sensors = [s.name for s in graph.of_type(Sensor)]
    trace = np.full((problem.data.n, len(sensors)), np.nan)
    u = dynamics.inputs(problem.data.commands, problem.data.time, problem.data.starts)
    for w, start in zip(windows(problem), x0, strict=True):
        fine = dynamics.fine_inputs(u[w], problem.n_sub, problem.data.between)
        memory = time_memories(problem, w.start)
        run = dynamics.run(ready(problem.data.step(w)), u[w], start, fine, memory=memory)
        trace[w] = run.y[:, : len(sensors)]
    trace = filled(trace)
    return {signal: trace[:, sensors.index(sensor)] for signal, sensor in sensed.items()}


def _with_sensors(
    graph: BondGraph, e: Element, argument: str, output: str
) -> tuple[BondGraph, dict[str, str]]:
    """Return the graph with sensors for the two variables of a port, and their names by signal.

    They are named after the element: elements of one junction share a signal.
    """
    names = {n: f"past_{e.name}_{n}" for n in (argument, output)}
    if isinstance(e, TwoPort):
        ends = _ends(graph, e)
        if ends is None:
            raise BondsightError(f"{e.name} has no two ends")
        graph = _measured(graph, ends[0], One, Df(names[output]))
        ends = _ends(graph, e)
        assert ends is not None
        node, sensor = (Zero, De) if isinstance(e, TF) else (One, Df)
        return _measured(graph, ends[1], node, sensor(names[argument])), names
    (bond,) = graph.bonds_of(e.name)
    first = (Dq if isinstance(e, C) else Df)(names[argument])
    graph = _measured(graph, bond, One, first)
    (bond,) = graph.bonds_of(e.name)
    return _measured(graph, bond, Zero, De(names[output])), names


def _measured(graph: BondGraph, bond: Bond, kind: type[One | Zero], sensor: Sensor) -> BondGraph:
    node = kind(f"at_{sensor.name}")
    return graph.with_inserted(bond, node).with_branch(node.name, [sensor])


def filled(trace: Array) -> Array:
    """Carry the nearest known value into samples that no window covers."""
    out = trace.copy()
    index = np.arange(trace.shape[0])
    for c in range(trace.shape[1]):
        good = np.isfinite(trace[:, c])
        if good.any() and not good.all():
            out[:, c] = np.interp(index, index[good], trace[good, c])
    return np.asarray(np.nan_to_num(out))
