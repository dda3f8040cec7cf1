"""Effort, flow, power and work of every bond along a motion.

Work is integrated with the rates of the powers at both ends of every step, which the equations
give: fourth order, although an input is linear between its samples and bends at each of them.

Sizes: N samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.energy.bond_values import BondPower, SignalPath, power_bonds
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.equations.casadi_printer import to_casadi
from bondgraph.equations.codegen import law_functions
from bondgraph.equations.derivation import equations
from bondgraph.equations.relation import Relation
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.modulation import TIME
from bondgraph.graph.parameter import symbol
from bondgraph.signals.recorded_rates import slopes
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.simulation.start import HOLDS, own_input
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.ops import FloatArray


def observables(graph: BondGraph) -> tuple[str, ...]:
    """Return what a trajectory must hold, so that every bond follows from it.

    States, algebraic unknowns and inputs: ``simulate(..., observed=observables(graph))``, or any
    `Trajectory` made of the states that an integrator of `Program` returns. A law with memory or a
    jump also needs its values in ``Trajectory.laws``, where `simulate` leaves them. Pseudo-inputs
    are known, and rates of inputs follow from the inputs.
    """
    return _needed(equations(graph))


def _needed(model: System) -> tuple[str, ...]:
    inputs = tuple(u for u in model.inputs if own_input(u, 1) is None)
    return (*model.states, *(a.name for a in model.algebraic), *inputs)


def motion(
    graph: BondGraph,
    trajectory: Trajectory,
    parameters: Mapping[str, float] | None = None,
    hold: str | None = None,
) -> SignalPath:
    """Return all signals and the work of all bonds of `graph` along `trajectory`.

    Parameters
    ----------
    parameters : dict of str to float
        Values that differ from the declared ones, as given to the simulation.
    hold : {"linear", "hold", "band-limited"}, optional
        What the inputs did between the samples, as `Trajectory.hold` says when not given; the
        last for any smooth input. A held one is given
        by what it was until the sample, as `simulate` observes it.

    Raises
    ------
    UnusableInput
        A state, an input or a law's values are missing, or the trajectory has no two samples.
    """
    hold = hold or trajectory.hold
    require_known("inter-sample behaviour", "ledger", HOLDS, hold)
    model = equations(graph)
    values = {n: float(v) for n, v in model.values(parameters).items()}
    time = np.asarray(trajectory.time, float)
    if time.ndim != 1 or time.size < 2 or not (np.diff(time) > 0).all():
        raise UnusableInput(
            f"{graph.name}: the trajectory needs two samples or more in rising time"
        )
    graph = in_mode(graph)
    return _Followed(graph, model, trajectory, time, values, hold).motion()


class _Followed:
    """All signals of a system as CasADi expressions of what a trajectory holds."""

    def __init__(
        self,
        graph: BondGraph,
        model: System,
        trajectory: Trajectory,
        time: FloatArray,
        parameters: Mapping[str, float],
        hold: str,
    ) -> None:
        self.graph, self.model, self.trajectory = graph, model, trajectory
        self.time, self.parameters, self.hold = time, parameters, hold
        self.rows = self._given()
        self.leaves = {n: ca.SX.sym(n) for n in self.rows}
        self.value: dict[str, Any] = dict(self.leaves)
        self.table = {p.symbol: parameters[n] for n, p in model.parameters.items()}
        for r in model.relations:
            self.value[r.target] = self._of(r)

    # -- what is given ------------------------------------------------------------------------
    def _given(self) -> dict[str, FloatArray]:
        model, time = self.model, self.time
        outputs = self.trajectory.outputs
        if missing := [n for n in _needed(model) if n not in outputs]:
            raise UnusableInput(
                f"{model.name}: the trajectory lacks {', '.join(missing)}; simulate with "
                "observed=observables(graph) of bondgraph.energy"
            )
        found = {n: np.asarray(outputs[n], float) for n in _needed(model)}
        found[str(TIME)] = time - time[0]
        for u in ("one", *model.inputs):
            if (own := own_input(u, time.size)) is not None:
                found[u] = own
        for n in model.input_rates:
            order, _, source = n.partition("_")
            found[n] = found[source]
            if n in model.recorded:
                found[n] = slopes(found[source], float(np.diff(time).mean()))
                continue
            for _ in range(int(order[1:] or 1)):
                found[n] = self._slope(found[n])
        for use in model.laws:
            if use.law.n_memory or use.law.timed or use.law.set_valued:
                if use.element not in self.trajectory.laws:
                    raise UnusableInput(
                        f"{model.name}: the law of {use.element} has memory or a jump, and the "
                        "trajectory does not hold its values; give them as "
                        f"Trajectory.laws[{use.element!r}] = (argument, deviation)"
                    )
                w = np.asarray(self.trajectory.laws[use.element][1], float)
                found[_law_leaf(use.element, use.role)] = w
        for n, v in found.items():
            if v.shape != time.shape or not np.isfinite(v).all():
                raise UnusableInput(
                    f"{model.name}: {n} has shape {v.shape} or is not finite; time has {time.shape}"
                )
        return found

    def _slope(self, v: FloatArray) -> FloatArray:
        return np.asarray(np.gradient(v, self.time, edge_order=2 if v.size > 2 else 1))

    # -- expressions --------------------------------------------------------------------------
    def _of(self, r: Relation) -> Any:
        reads = {symbol(s): self.value[s] for s in r.reads}
        total: Any = ca.SX(0.0)
        for c, s in r.terms:
            k = c if isinstance(c, int) else to_casadi(c, {**self.table, **reads})
            total = total + k * self.value[s]
        if r.expression is not None:
            total = total + to_casadi(r.expression, {**self.table, **reads})
        if r.law is None:
            return total
        use = self.model.laws[r.law]
        leaf = _law_leaf(use.element, use.role)
        if leaf in self.leaves:
            return total + self.leaves[leaf]
        q = ca.DM([self.parameters[n] for n in use.parameters])
        value, _ = law_functions(use.law, q.numel())
        return total + value(self.value[use.argument], ca.SX(0, 1), q, 0.0)

    def _evaluated(self, expression: Any, rows: FloatArray) -> FloatArray:
        column = ca.densify(ca.SX(expression))
        function = ca.Function("signals", [ca.vertcat(*self.leaves.values())], [column])
        found = np.asarray(function(rows), float)
        if not np.isfinite(found).all():
            raise UnusableInput(f"{self.model.name}: a signal is not finite along the trajectory")
        return found

    # -- results ------------------------------------------------------------------------------
    def motion(self) -> SignalPath:
        rows = np.vstack(list(self.rows.values()))
        names = list(self.value)
        values = self._evaluated(ca.vertcat(*(self.value[n] for n in names)), rows)
        signals = dict(zip(names, values, strict=True))
        of, bonds = SignalNames(self.graph), power_bonds(self.graph)
        powers = ca.vertcat(*(self.value[of.effort(b)] * self.value[of.flow(b)] for b in bonds))
        work, error = self._work(powers, rows)
        made = []
        for b, w, rough in zip(bonds, work, error, strict=True):
            e, f = signals[of.effort(b)], signals[of.flow(b)]
            made.append(BondPower(b.tail, b.head, e, f, e * f, w, float(rough)))
        return SignalPath(self.model, self.time, signals, self.parameters, tuple(made))

    def _work(self, powers: Any, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Integrate the cubic through powers and their rates at both ends of every step."""
        before, after = self._ends(rows)
        start, end = self._with_rates(powers, *before), self._with_rates(powers, *after)
        h = np.diff(self.time)
        p0, r0 = np.split(start, 2)
        p1, r1 = np.split(end, 2)
        parts = 0.5 * h * (p0 + p1) + h**2 / 12.0 * (r0 - r1)
        zero = np.zeros((parts.shape[0], 1))
        third = (12.0 * (p0 - p1) + 6.0 * h * (r0 + r1)) / h**3
        jumps = np.abs(np.diff(third, axis=1)) * h[1:] ** 4
        return np.hstack([zero, np.cumsum(parts, axis=1)]), jumps.sum(axis=1) / 24.0

    def _ends(self, rows: FloatArray) -> tuple[Any, Any]:
        """Values and rates of the leaves just after one sample and just before the next."""
        h = np.diff(self.time)
        rates = np.vstack([self._slope(v) for v in rows])
        first = (rows[:, :-1].copy(), rates[:, :-1].copy())
        last = (rows[:, 1:].copy(), rates[:, 1:].copy())
        if self.hold == "band-limited":
            return first, last
        places = {n: i for i, n in enumerate(self.rows)}
        for n in self.model.inputs:
            if own_input(n, 1) is not None:
                continue
            i = places[n]
            slope = np.diff(rows[i]) / h
            if self.hold == "hold":
                slope = np.zeros_like(h)
                first[0][i] = last[0][i]  # what was held until the sample
            for k, rate in ((f"d_{n}", slope), (f"d2_{n}", np.zeros_like(h))):
                if k in places and k not in self.model.recorded:
                    for values, change in (first, last):
                        values[places[k]], change[places[k]] = rate, 0.0
            first[1][i] = last[1][i] = slope
        return first, last

    def _with_rates(self, powers: Any, values: FloatArray, rates: FloatArray) -> FloatArray:
        """Powers and their rates; the equations give the rates of the states."""
        leaves = ca.vertcat(*self.leaves.values())
        change = {n: ca.SX.sym(f"rate_{n}") for n in self.leaves}
        given = ca.vertcat(*change.values())
        change |= {s.name: ca.SX(self.value[s.rate]) for s in self.model.stored}
        moved = ca.jtimes(powers, leaves, ca.vertcat(*(change[n] for n in self.leaves)))
        function = ca.Function("powers", [leaves, given], [ca.densify(ca.vertcat(powers, moved))])
        found = np.asarray(function(values, rates), float)
        if not np.isfinite(found).all():
            raise UnusableInput(f"{self.model.name}: the rate of a power is not finite")
        return found


def _law_leaf(element: str, role: str) -> str:
    return f"deviation of {role} {element}"
