"""What an effect may look at before it is tried: the fitted model, the data, every port's past."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.compiled import Compiled
from bondgraph.elements import C, Element, R, Sensor, Source
from bondgraph.equations import port_signals
from bondgraph.graph import BondGraph
from bondgraph.simulate import prepare, run_prepared
from identification.fit import Fit
from identification.problem import Data
from identification.residual import parameters_at, windows

Array = np.ndarray


@dataclass(frozen=True)
class Past:
    """Argument and output of an element's law along the fitted record.

    Attributes
    ----------
    argument : ndarray, shape (N,), SI
        Displacement of a storage, flow of a resistor, command of a source, reading of a sensor.
    output : ndarray, shape (N,), SI
        Effort of storages and resistors; the argument itself elsewhere.
    """

    argument: Array
    output: Array

    @property
    def centre(self) -> float:
        """Middle of the argument's range."""
        return float(0.5 * (self.argument.max() + self.argument.min()))

    @property
    def half(self) -> float:
        """Half of the argument's range."""
        return float(0.5 * np.ptp(self.argument)) or 1.0

    @property
    def swing(self) -> float:
        """Half of the output's range."""
        return float(0.5 * np.ptp(self.output)) or 1.0

    @property
    def rms(self) -> float:
        """Root mean square of the argument."""
        return float(np.sqrt(np.mean(self.argument**2))) or 1.0


@dataclass(frozen=True)
class Scene:
    """Nominal fit and the past of every port whose variables the equations give."""

    # the declared graph: its values carry what is known about them, the fit has its own

    graph: BondGraph
    data: Data
    nominal: Fit
    past: dict[str, Past]

    @property
    def fitted(self) -> BondGraph:
        """The graph with the fitted values."""
        known = {n: v for n, v in self.nominal.values.items() if n in self.graph.parameters}
        return self.graph.with_values(known)

    def of(self, element: Element) -> Past:
        """Past of one element."""
        return self.past[element.name]


def scene(nominal: Fit) -> Scene:
    """Simulate the nominal fit once more with all port signals observed."""
    problem = nominal.problem
    graph, data = problem.graph, problem.data
    signals = port_signals(problem.with_offsets)
    observed: list[str] = []
    space = problem.compiled.space
    known = {str(s.symbol) for s in space.states} | {str(a.target) for a in space.assignments}
    ports = []
    for e in graph.of_type(C, R):
        effort, flow = signals[e.name]
        argument = f"q_{e.name}" if isinstance(e, C) else flow
        if argument in known and effort in known:
            ports.append(e)
            observed += [argument, effort]
    seen = Compiled(problem.compiled.space, tuple(observed))
    p = parameters_at(problem, nominal.point.theta)
    trace = np.full((data.n, len(data.names) + len(observed)), np.nan)
    ready = prepare(seen, p, data.dt, problem.n_sub)
    for w, x0 in zip(windows(problem), nominal.point.states, strict=True):
        trace[w] = run_prepared(ready, problem.inputs[w], x0, fine=problem.fine_inputs(w)).y
    inside = np.isfinite(trace).all(axis=1)
    scored = inside & (data.mask("train") | data.mask("test"))
    trace = trace[scored]
    past: dict[str, Past] = {}
    for i, e in enumerate(ports):
        k = len(data.names) + 2 * i
        past[e.name] = Past(trace[:, k], trace[:, k + 1])
    for s in graph.of_type(Source):
        past[s.name] = Past(data.commands[s.name][scored], data.commands[s.name][scored])
    for i, s in enumerate(graph.of_type(Sensor)):
        past[s.name] = Past(trace[:, i], trace[:, i])
    return Scene(graph, data, nominal, past)
