"""Energy held and lost inside every element along a motion.

Sizes: N samples, n memory states.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import sympy as sp

from bondgraph.energy.bond_values import SignalPath
from bondgraph.energy.law_energy import law_energy_record
from bondgraph.energy.stores import store_energy, stored_variables
from bondgraph.equations.casadi_printer import to_casadi
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, CField, Element, I, IField, R
from bondgraph.graph.parameter import symbol
from bondgraph.hysteresis import Operator
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.laws import Hysteretic, Sliding, StopSum
from bondgraph.laws.law import Law, split
from bondgraph.support.errors import BondsightError, GraphError
from bondgraph.support.ops import CASADI, NUMPY, FloatArray

CHUNK = 512

Memories = Mapping[str, Sequence[float]]
Loss = Callable[[Any, Sequence[Any]], tuple[Any, Any, Sequence[Any]]]


@dataclass(frozen=True)
class HeldEnergy:
    """What an element holds and has lost since the start.

    Attributes
    ----------
    stored : ndarray, shape (N,), J, or None
        None if its law has memory and no energy is known for it.
    lost : ndarray, shape (N,), J
        Lost inside a law with memory.
    note : str
    """

    stored: FloatArray | None
    lost: FloatArray
    note: str = ""


def held(graph: BondGraph, e: Element, run: SignalPath, memory: Memories) -> HeldEnergy | None:
    """Return the energy of a storage, or of a resistor whose law holds some; else None.

    A law with memory is taken through the samples, from `memory` or from its own initial one, so
    a turning point between two samples is missed. A sliding law holds energy where its operator is
    passive at the output alone: elsewhere what that stores is no share of this work.
    """
    if isinstance(e, CField | IField):
        return HeldEnergy(_closed(graph, e, run), _zeros(run))
    if isinstance(e, C | I):
        return _store(graph, e, run, memory)
    if isinstance(e, R) and isinstance(e.law, Sliding):
        if e.law.operator.passive_port != "output":
            return None
        flow = _argument(run, e.name)
        x = _slid(run.time, flow)
        start = memory.get(e.name)
        found = _walk(
            _operator_loss(e.law.operator),
            x,
            e.law.operator.initial_memory(0.0) if start is None else start[2:],
            run.time,
        )
        if found is None:
            return None
        r = graph.coefficient(e) if e.value != 0 else 0.0
        viscous = _number(run, sp.sympify(r)) * integral(run.time, flow**2)
        return HeldEnergy(found[0], found[1] + viscous)
    return None


def _store(graph: BondGraph, e: C | I, run: SignalPath, memory: Memories) -> HeldEnergy:
    if e.law is None:
        return HeldEnergy(_closed(graph, e, run), _zeros(run))
    (name,) = stored_variables(graph, e.name)
    s = run.signals[name]
    slope = graph.slope(e)
    linear = 0.5 * float(_number(run, slope)) * s**2
    p = [run.parameters[q.name] for q in e.law.parameters(e.name)]
    if not e.law.n_memory:
        return HeldEnergy(linear + law_energy_record(e.law, s, p), _zeros(run))
    loss = _loss(e.law, p)
    start = memory.get(e.name, e.law.initial_memory(float(s[0])))
    if loss is not None and isinstance(e.law, StopSum):
        # what was lost before the first sample is not of this run
        start = e.law.advance(NUMPY, s[0], start, p)
    found = None if loss is None else _walk(loss, s, start, run.time)
    if found is None:
        return HeldEnergy(None, _zeros(run), "no energy is known for its law: kept or lost is open")
    stored, lost = found
    return HeldEnergy(stored + (linear if isinstance(e.law, StopSum) else 0.0), lost)


def _closed(graph: BondGraph, e: Element, run: SignalPath) -> FloatArray:
    names = stored_variables(graph, e.name)
    columns = [ca.SX.sym(n) for n in names]
    table: dict[Any, Any] = dict(zip(map(symbol, names), columns, strict=True))
    table |= {q.symbol: run.parameters[n] for n, q in graph.parameters.items()}
    value = ca.SX(to_casadi(store_energy(graph, e.name), table))
    function = ca.Function("energy", [ca.vertcat(*columns)], [ca.densify(value)])
    found = function(np.vstack([run.signals[n] for n in names]))
    return np.asarray(found, float).ravel()


def _number(run: SignalPath, expression: Any) -> Any:
    table = {q.symbol: run.parameters[n] for n, q in run.model.parameters.items()}
    return to_casadi(expression, table)


def _loss(law: Law, p: Sequence[float]) -> Loss | None:
    if isinstance(law, StopSum):
        return _stop_loss(law, p) if law.sign == 1.0 and not law.rated else None
    if not isinstance(law, Hysteretic):
        return None
    try:
        operator = law.operator_at(p)
    except BadParameter:  # a fit may go where none is declared: nothing is known of energy there
        return None
    return _operator_loss(operator) if operator.passive_port == "output" else None


def _operator_loss(operator: Operator) -> Loss:
    def loss(s: Any, both: Sequence[Any]) -> tuple[Any, Any, Sequence[Any]]:
        step, m = both[0], tuple(both[1:])
        return (
            operator.stored_energy(CASADI, s, m, step),
            operator.dissipated_energy(CASADI, s, m, step),
            operator.advance(CASADI, s, m, step),
        )

    return loss


def _stop_loss(law: StopSum, heights: Sequence[float]) -> Loss:
    def loss(s: Any, both: Sequence[Any]) -> tuple[Any, Any, Sequence[Any]]:
        m = tuple(both[1:])
        new = law.advance(CASADI, s, m, heights)
        stored, lost = 0.0, 0.0
        for h, r, y, old in zip(heights, law.thresholds, new, m, strict=True):
            stored = stored + 0.5 * h * (s - y) ** 2
            # while it slips, a stop keeps its full stretch r and the play moves
            lost = lost + h * r * ca.fabs(y - old)
        return stored, lost, new

    return loss


def _walk(
    loss: Loss, s: FloatArray, start: Sequence[float], time: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return stored and lost energy at every sample, or None if none is known."""
    m, x, h = ca.SX.sym("m", len(start)), ca.SX.sym("x"), ca.SX.sym("h")
    try:
        stored, lost, new = loss(x, (h, *split(m)))
    except (BondsightError, GraphError):
        return None
    column = ca.densify(ca.vertcat(*new)) if len(start) else ca.SX(0, 1)
    step = ca.Function("step", [m, x, h], [column, ca.SX(stored), ca.SX(lost)])
    state, rows = ca.DM(list(map(float, start))), []
    steps = np.diff(time, prepend=time[0])
    for first in range(0, s.size, CHUNK):
        part = slice(first, min(first + CHUNK, s.size))
        n = part.stop - first
        chain, kept, gone = step.mapaccum(n)(state, ca.DM(s[part]).T, ca.DM(steps[part]).T)
        state = chain[:, -1]
        rows.append(np.vstack([kept.full(), gone.full()]))
    found = np.concatenate(rows, axis=1)
    found[1, 0] = 0.0
    return found[0], np.cumsum(found[1])


def _argument(run: SignalPath, element: str) -> FloatArray:
    (use,) = (u for u in run.model.laws if u.element == element and u.role == "resistor")
    return run.signals[use.argument]


def _slid(time: FloatArray, flow: FloatArray) -> FloatArray:
    """Trapezoidal, as the law slides."""
    parts = 0.5 * np.diff(time) * (flow[1:] + flow[:-1])
    return np.concatenate([[0.0], np.cumsum(parts)])


def integral(time: FloatArray, power: FloatArray) -> FloatArray:
    """Return the integral since the start by Simpson's rule, shape (N,)."""
    if time.size < 3:
        return np.array([0.0, 0.5 * float(time[1] - time[0]) * float(power.sum())])
    from scipy.integrate import cumulative_simpson

    return np.asarray(cumulative_simpson(power, x=time, initial=0.0))


def _zeros(run: SignalPath) -> FloatArray:
    return np.zeros_like(run.time)
