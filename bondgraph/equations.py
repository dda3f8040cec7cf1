"""BondGraph -> StateSpace: ordered causal assignments first, closed SymPy forms on demand.

Signals are ``e_<name>`` and ``f_<name>``: of the one-port for its own bond, of the junction where
all bonds share the variable. States are ``q_<name>`` (displacement) and ``p_<name>`` (momentum).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from bondgraph.causality import Causality, assign_causality
from bondgraph.elements import (
    GY,
    TF,
    C,
    De,
    Dq,
    Element,
    I,
    One,
    Parameter,
    R,
    Se,
    Sensor,
    Source,
    Zero,
    symbol,
)
from bondgraph.errors import GraphError, unknown_name
from bondgraph.graph import Bond, BondGraph
from bondgraph.laws.law import Law

ONE = symbol("one")
RAMP = symbol("ramp")
MOST_DEPENDENT = 3  # the closed forms of more grow beyond use


class DerivativeCausality(GraphError):
    """A storage depends on the others and this graph's form of it is not solved."""


class AlgebraicLoop(GraphError):
    """Signals depend on each other without a state between them."""


@dataclass(frozen=True, slots=True)
class Assignment:
    """``target := expression``, in an order that can be evaluated.

    `expression` is linear in signals, with the deviation of a nonlinear law as its own symbol
    ``w_<element>``; `shown` has the whole law as a named function instead.
    """

    target: sp.Symbol
    expression: sp.Expr
    shown: sp.Expr
    reason: str


@dataclass(frozen=True, slots=True)
class State:
    """A state, the signal that is its rate, and where it lives."""

    symbol: sp.Symbol
    rate: sp.Expr
    element: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class LawPort:
    """A nonlinear law seen from the linear rest: ``w = law.deviation(argument)``."""

    element: str
    role: str
    law: Law
    w: sp.Symbol
    argument: sp.Expr
    parameters: tuple[str, ...]


@dataclass(frozen=True)
class StateSpace:
    """``dx/dt = f(x, u, p)``, ``y = g(x, u, p)`` as ordered assignments.

    Attributes
    ----------
    states, inputs, outputs : tuple
        In order; inputs are the commands of the sources, outputs the readings of the sensors.
    assignments : tuple of Assignment
        Every signal, in the order in which it can be evaluated.
    laws : tuple of LawPort
        Nonlinear laws.
    parameters : dict of str to Parameter
        Nominal values.
    """

    name: str
    states: tuple[State, ...]
    inputs: tuple[sp.Symbol, ...]
    outputs: tuple[tuple[str, sp.Expr, str], ...]
    assignments: tuple[Assignment, ...]
    laws: tuple[LawPort, ...]
    parameters: dict[str, Parameter]
    causality: Causality

    @cached_property
    def signals(self) -> dict[sp.Symbol, sp.Expr]:
        """Closed form of every signal in states, inputs and parameters."""
        closed: dict[sp.Symbol, sp.Expr] = {}
        for a in self.assignments:
            closed[a.target] = a.shown.xreplace(closed)
        return closed

    def closed(self, expression: sp.Expr) -> sp.Expr:
        """`expression` of signals with the signals put in."""
        return expression.xreplace(self.signals)

    @property
    def x(self) -> sp.Matrix:
        """State symbols, shape (n_x, 1)."""
        return sp.Matrix([s.symbol for s in self.states])

    @property
    def dxdt(self) -> sp.Matrix:
        """Closed right-hand side ``f(x, u, p)``, shape (n_x, 1)."""
        return sp.Matrix([self.closed(s.rate) for s in self.states])

    @property
    def y(self) -> sp.Matrix:
        """Closed outputs ``g(x, u, p)``, shape (n_y, 1)."""
        return sp.Matrix([self.closed(shown) for _, shown, _ in self.outputs])

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the sensors."""
        return tuple(n for n, _, _ in self.outputs)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the sources whose command is an input."""
        return tuple(str(u) for u in self.inputs)

    def signal(self, name: str) -> sp.Expr:
        """Return the closed form of a signal by name."""
        s = symbol(name)
        if s not in self.signals:
            raise unknown_name("signal", name, self.name, [str(t) for t in self.signals])
        return self.signals[s]

    def __str__(self) -> str:
        """Ordered assignments, rates and outputs as text."""
        lines = [f"{a.target} := {a.shown}    ({a.reason})" for a in self.assignments]
        lines += [f"d{s.symbol}/dt := {s.rate}" for s in self.states]
        lines += [f"{n} := {shown}" for n, shown, _ in self.outputs]
        return "\n".join(lines)

    def _repr_latex_(self) -> str:
        """Return the closed equations for notebooks."""
        from bondgraph.export.latex import latex

        return "$$" + latex(self) + "$$"


def derive(graph: BondGraph) -> StateSpace:
    """Derive the state equations of `graph`.

    Raises
    ------
    CausalConflict, DerivativeCausality, AlgebraicLoop
        The message names the elements and the bonds.
    """
    return _Derivation(graph).result()


def port_signals(graph: BondGraph) -> dict[str, tuple[str, str]]:
    """Names of the effort and the flow at every one-port element."""
    d = _Derivation(graph)
    found = {}
    for e in graph.elements.values():
        if e.n_ports == 1 and not isinstance(e, Sensor):
            (b,) = graph.bonds_of(e.name)
            found[e.name] = (str(d.effort(b)), str(d.flow(b)))
    return found


class _Derivation:
    """Collects assignments element by element, then orders them."""

    def __init__(self, graph: BondGraph) -> None:
        self.graph = graph
        self.causality = assign_causality(graph)
        self.alias = _flow_aliases(graph)
        self.found: dict[sp.Symbol, Assignment] = {}
        self.states: list[State] = []
        self.inputs: list[sp.Symbol] = []
        self.outputs: list[tuple[str, sp.Expr, str]] = []
        self.laws: list[LawPort] = []
        self.derivatives: dict[sp.Symbol, str] = {}

    # -- names of signals -------------------------------------------------------------------
    def effort(self, b: Bond) -> sp.Symbol:
        for end in (b.tail, b.head):
            if isinstance(self.graph[end], Zero):
                return symbol(f"e_{self.alias.get(end, end)}")
        return symbol(f"e_{self._own(b)}")

    def flow(self, b: Bond) -> sp.Symbol:
        for end in (b.tail, b.head):
            if isinstance(self.graph[end], One):
                return symbol(f"f_{self.alias.get(end, end)}")
        return symbol(f"f_{self._own(b)}")

    def _own(self, b: Bond) -> str:
        for end in (b.head, b.tail):
            if self.graph[end].n_ports == 1:
                return end
        return f"{b.tail}_{b.head}"

    # -- assembly ---------------------------------------------------------------------------
    def result(self) -> StateSpace:
        from bondgraph.dependent import drop_derivatives

        for e in self.graph.elements.values():
            self._element(e)
        _resolve_dependent_storages(self)
        for s in self.graph.of_type(Sensor):
            self._sensor(s)
        drop_derivatives(self)
        ordered = _ordered(self.graph.name, self.found)
        return StateSpace(
            self.graph.name,
            tuple(self.states),
            tuple(self.inputs),
            tuple(self.outputs),
            ordered,
            tuple(self.laws),
            self.graph.parameters,
            self.causality,
        )

    def assign(
        self, target: sp.Symbol, expression: sp.Expr, reason: str, shown: sp.Expr | None = None
    ) -> None:
        if target == expression:
            return
        self.found[target] = Assignment(
            target, expression, expression if shown is None else shown, reason
        )

    def _element(self, e: Element) -> None:
        if isinstance(e, Sensor):
            return
        if isinstance(e, Zero | One):
            self._junction(e)
        elif isinstance(e, TF | GY):
            self._two_port(e)
        else:
            (b,) = self.graph.bonds_of(e.name)
            stroke = self.causality.strokes[b]
            ef, fl, gets_effort = self.effort(b), self.flow(b), stroke.effort_to == e.name
            if isinstance(e, Source):
                self._source(e, ef if isinstance(e, Se) else fl)
            elif isinstance(e, R):
                self._resistor(e, ef, fl, gets_effort)
            elif isinstance(e, C):
                self._storage(e, "q", ef, fl, integral=not gets_effort)
            elif isinstance(e, I):
                self._storage(e, "p", fl, ef, integral=gets_effort)

    def _junction(self, e: Element) -> None:
        zero = isinstance(e, Zero)
        bonds = [b for b in self.graph.bonds_of(e.name) if b in self.causality.strokes]
        (strong,) = (b for b in bonds if (self.causality.strokes[b].effort_to == e.name) == zero)
        variable = self.flow if zero else self.effort
        total = sp.S.Zero
        for b in bonds:
            if b != strong:
                total += variable(b) * (1 if b.head == e.name else -1)
        sign = -1 if strong.head == e.name else 1
        word = "flows" if zero else "efforts"
        self.assign(variable(strong), sign * total, f"sum of {word} at {e.name}")

    def _two_port(self, e: TF | GY) -> None:
        n = self.graph.coefficient(e)
        (into,) = (b for b in self.graph.bonds_of(e.name) if b.head == e.name)
        (out,) = (b for b in self.graph.bonds_of(e.name) if b.tail == e.name)
        e1, f1, e2, f2 = self.effort(into), self.flow(into), self.effort(out), self.flow(out)
        given = self.causality.strokes[into].effort_to == e.name
        why = f"{e.kind} {e.name}"
        if isinstance(e, TF):
            if given:
                self.assign(e2, e1 / n, why)
                self.assign(f1, f2 / n, why)
            else:
                self.assign(e1, n * e2, why)
                self.assign(f2, n * f1, why)
        elif given:
            self.assign(f2, e1 / n, why)
            self.assign(f1, e2 / n, why)
        else:
            self.assign(e1, n * f2, why)
            self.assign(e2, n * f1, why)

    def _source(self, e: Source, target: sp.Symbol) -> None:
        u = symbol(e.name)
        self.inputs.append(u)
        value: sp.Expr = u
        shown: sp.Expr = u
        if e.offset:
            offset = symbol(e.offset)
            self._pseudo_input(ONE)
            value, shown = value + offset * ONE, shown + offset
        if e.drive and e.drive.law:
            w = self.law_port(e, "drive", e.drive.law, value)
            value, shown = value + w, sp.Function(f"{e.name}_drive")(shown)
        if e.drive and e.drive.lag:
            lagged = symbol(f"z_{e.name}")
            tau = symbol(e.drive.lag, positive=True)
            command = symbol(f"c_{e.name}")
            self.assign(command, value, f"command of {e.name}", shown)
            self.states.append(State(lagged, (command - lagged) / tau, e.name, e.unit))
            value = shown = lagged
        self.assign(target, value, f"{e.kind} {e.name}", shown)

    def _pseudo_input(self, s: sp.Symbol) -> None:
        if s not in self.inputs:
            self.inputs.append(s)

    def law_port(self, e: Element, role: str, law: Law, argument: sp.Expr) -> sp.Symbol:
        w = symbol(f"w_{e.name}")
        names = tuple(p.name for p in law.parameters(e.name))
        self.laws.append(LawPort(e.name, role, law, w, argument, names))
        return w

    def _resistor(self, e: R, ef: sp.Symbol, fl: sp.Symbol, gets_effort: bool) -> None:
        r = self.graph.coefficient(e) if e.value != 0 else sp.S.Zero
        why = f"R {e.name}"
        if e.law is None:
            self.assign(fl, ef / r, why) if gets_effort else self.assign(ef, r * fl, why)
            return
        w = self.law_port(e, "resistor", e.law, fl)
        if gets_effort:
            self.assign(fl, (ef - w) / r, why, sp.Function(f"{e.name}_inverse")(ef))
        else:
            self.assign(ef, r * fl + w, why, sp.Function(e.name)(fl))

    def _storage(
        self, e: C | I, letter: str, output: sp.Symbol, rate: sp.Symbol, *, integral: bool
    ) -> None:
        state = symbol(f"{letter}_{e.name}")
        slope = self.graph.coefficient(e) if isinstance(e, C) else 1 / self.graph.coefficient(e)
        if not integral:
            return
        why = f"{e.kind} {e.name} stores {letter}_{e.name}"
        self.states.append(State(state, rate, e.name, _stored_unit(e)))
        if e.law is None:
            self.assign(output, slope * state, why)
        else:
            w = self.law_port(e, "storage", e.law, state)
            self.assign(output, slope * state + w, why, sp.Function(e.name)(state))

    def _sensor(self, e: Sensor) -> None:
        junction = self.graph.neighbour(e.name)
        if isinstance(e, De):
            value: sp.Expr = symbol(f"e_{self.alias.get(junction, junction)}")
        elif isinstance(e, Dq):
            value = self._displacement(e, symbol(f"f_{self.alias.get(junction, junction)}"))
        else:
            value = symbol(f"f_{self.alias.get(junction, junction)}")
        shown = value
        reading = symbol(f"r_{e.name}")
        if e.law is not None or e.lag is not None:
            self.assign(reading, value, f"true value at {e.name}", shown)
            value = shown = reading
        if e.lag is not None:
            lagged, tau = symbol(f"z_{e.name}"), symbol(e.lag, positive=True)
            self.states.append(State(lagged, (value - lagged) / tau, e.name, e.unit))
            value = shown = lagged
        if e.law is not None:
            w = self.law_port(e, "sensor", e.law, value)
            shown = sp.Function(f"{e.name}_reading")(shown)
            value = value + w
        target = symbol(f"y_{e.name}")
        for power, name in enumerate(e.drift, start=1):
            ramp = RAMP if power == 1 else symbol(f"ramp{power}")
            self._pseudo_input(ramp)
            value, shown = value + symbol(name) * ramp, shown + symbol(name) * ramp
        self.assign(target, value, f"{e.kind} {e.name}", shown)
        self.outputs.append((e.name, target, e.unit))

    def _displacement(self, e: Dq, flow: sp.Symbol) -> sp.Expr:
        """Return stored displacements that already integrate this flow, or a new state."""
        from bondgraph.dependent import displacement_of_dependents

        stored = [s for s in self.states if str(s.symbol).startswith("q_")]
        for s in stored:
            if s.rate == flow:
                return s.symbol
        dependent = displacement_of_dependents(self, flow)
        if dependent is not None:
            return dependent
        combination = _as_integral(flow, stored, self.found, set(self.graph.parameters))
        if combination is not None:
            return combination
        state = symbol(f"q_{e.name}")
        self.states.append(State(state, flow, e.name, e.unit))
        return state


def _as_integral(
    flow: sp.Symbol,
    stored: list[State],
    found: Mapping[sp.Symbol, Assignment],
    parameters: set[str],
) -> sp.Expr | None:
    """Return the combination of stored displacements whose rate is `flow` identically, if any."""
    if not 0 < len(stored) <= 6:
        return None
    closed: dict[sp.Symbol, sp.Expr] = {}
    for a in _ordered("", found):
        closed[a.target] = a.expression.xreplace(closed)
    unknowns = sp.symbols(f"c0:{len(stored)}")
    balance = flow.xreplace(closed)
    for c, s in zip(unknowns, stored, strict=True):
        balance -= c * s.rate.xreplace(closed)
    balance = sp.expand(balance)
    variables = [v for v in balance.free_symbols - set(unknowns) if str(v) not in parameters]
    equations = sp.Poly(balance, *variables).coeffs() if variables else [balance]
    solution = sp.solve(equations, unknowns, dict=True)
    if not solution or len(solution[0]) != len(unknowns):
        return None
    return sum(
        (sp.cancel(solution[0][c]) * s.symbol for c, s in zip(unknowns, stored, strict=True)),
        sp.S.Zero,
    )


def _stored_unit(e: C | I) -> str:
    return ""


def _flow_aliases(graph: BondGraph) -> dict[str, str]:
    """Junctions of one kind bonded to each other share their variable: one name for all."""
    import networkx as nx

    same: nx.Graph = nx.Graph()
    for b in graph.bonds:
        if type(graph[b.tail]) is type(graph[b.head]) and isinstance(graph[b.tail], Zero | One):
            same.add_edge(b.tail, b.head)
    order = list(graph.elements)
    alias = {}
    for part in nx.connected_components(same):
        first = min(part, key=order.index)
        alias.update({n: first for n in part})
    return alias


def _ordered(name: str, found: Mapping[sp.Symbol, Assignment]) -> tuple[Assignment, ...]:
    import networkx as nx

    g: nx.DiGraph = nx.DiGraph()
    g.add_nodes_from(found)
    for t, a in found.items():
        for s in a.expression.free_symbols:
            if s in found:
                g.add_edge(s, t)
    try:
        position = {t: i for i, t in enumerate(found)}
        return tuple(found[t] for t in nx.lexicographical_topological_sort(g, key=position.get))
    except nx.NetworkXUnfeasible:
        loop = max(nx.strongly_connected_components(g), key=len)
        signals = ", ".join(sorted(str(s) for s in loop))
        sources = sorted({found[t].reason for t in loop if not found[t].reason.startswith("sum")})
        raise AlgebraicLoop(
            f"{name}: algebraic loop through {', '.join(sources)} (signals {signals}); a small "
            "compliance or inertia at one of their junctions breaks it"
        ) from None


def _resolve_dependent_storages(d: _Derivation) -> None:
    """Solve one C in derivative causality by working with displacements instead of flows.

    Its flow ``f_D`` drives some stores; ``z = q - c q_D`` of those no longer contains ``f_D``.
    What is left is ``law_D(q_D) = a - beta q_D``, whose solution is the inverse of
    ``beta + law_D``: for an operator with memory ``q_D = (I + C H)^-1 [C a]``.
    """
    from bondgraph.dependent import eliminate

    if len(d.causality.derivative) > MOST_DEPENDENT:
        raise DerivativeCausality(
            f"{d.graph.name}: {', '.join(d.causality.derivative)} have derivative causality, and "
            f"more than {MOST_DEPENDENT} are not solved at once; put resistances in series with "
            "them (or merge them)"
        )
    for name in d.causality.derivative:
        eliminate(d, d.graph[name])
