"""BondGraph -> StateSpace: ordered causal assignments first, closed SymPy forms on demand.

Signals are ``e_<name>`` and ``f_<name>``: of the one-port for its own bond, of the junction where
all bonds share the variable. States are ``q_<name>`` (displacement) and ``p_<name>`` (momentum).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp

from bondgraph.causality.assignment import Causality, assign_causality
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.equations.ordering import components, tear
from bondgraph.equations.relation import Dependent, LawUse, Relation
from bondgraph.equations.relations import collect
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Dq, Parameter, Sensor, symbol
from bondgraph.laws.law import Law
from bondgraph.laws.watching import Gauge
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.support.errors import GraphError, unknown_name

ONE = symbol("one")
RAMP = symbol("ramp")
MOST_DEPENDENT = 3  # the closed forms of more grow beyond use


class DerivativeCausality(GraphError):
    """A storage depends on the others and this graph's form of it is not solved.

    Examples
    --------
    >>> issubclass(DerivativeCausality, BondsightError)
    True
    """


class NotLinearUpToLaws(GraphError):
    """A graph with modulated elements or nonlinear fields: only its general equations exist.

    Examples
    --------
    >>> from bondgraph import flow
    >>> def fan():
    ...     with BondGraph("fan") as g:
    ...         shaft = One("shaft")
    ...         Se("M", unit="N*m") >> shaft >> I("J", 1e-3, unit="kg*m2")
    ...         MSe("drag", -1e-4 * flow("shaft") ** 2, unit="N*m") >> shaft
    ...         shaft >> Df("w", unit="rad/s")
    ...     return g
    >>> try:
    ...     derive(fan())
    ... except NotLinearUpToLaws as error:
    ...     print(error)
    fan: MSe drag multiplies or transforms signals, so the model is not linear up to ...
    >>> system(fan()).rates
    (M - 0.0001*p_J**2/J**2,)
    """


class AlgebraicLoop(GraphError):
    """Signals depend on each other without a state between them.

    Examples
    --------
    >>> issubclass(AlgebraicLoop, BondsightError)
    True
    """


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
    recorded : tuple of str
        The inputs ``d_NAME`` that are rates of sources recorded by their integral NAME, see
        `bondgraph.signals.recorded_rates`.

    Examples
    --------
    >>> derive(graph).dxdt
    Matrix([
    [F - d*p_m/m - k*q_k],
    [              p_m/m]])
    """

    name: str
    states: tuple[State, ...]
    inputs: tuple[sp.Symbol, ...]
    outputs: tuple[tuple[str, sp.Expr, str], ...]
    assignments: tuple[Assignment, ...]
    laws: tuple[LawPort, ...]
    parameters: dict[str, Parameter]
    causality: Causality
    recorded: tuple[str, ...] = ()

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
    """Derive the state equations of `graph` for simulation and identification.

    Every relation must be linear up to scalar laws; `bondgraph.equations.derivation.system` takes
    any graph.

    Raises
    ------
    CausalConflict, DerivativeCausality, AlgebraicLoop, NotLinearUpToLaws
        The message names the elements and the bonds.

    Examples
    --------
    >>> print(derive(graph))
    e_F := F    (Se F)
    f_body := p_m/m    (I m stores p_m)
    e_d := d*f_body    (R d)
    e_k := k*q_k    (C k stores q_k)
    e_m := e_F - e_d - e_k    (sum of efforts at body)
    x_x := q_k    (displacement at x)
    y_x := x_x    (Dq x)
    dp_m/dt := e_m
    dq_k/dt := f_body
    x := y_x
    """
    graph = in_mode(graph)
    return _Derivation(graph).result()


def port_signals(graph: BondGraph) -> dict[str, tuple[str, str]]:
    """Names of the effort and the flow at every one-port element."""
    names = SignalNames(graph)
    found = {}
    for e in graph.elements.values():
        if e.n_ports == 1 and not isinstance(e, Sensor):
            (b,) = graph.bonds_of(e.name)
            found[e.name] = (names.effort(b), names.flow(b))
    return found


class _Derivation:
    """Takes over the relations of all elements, eliminates dependent stores, orders the rest."""

    def __init__(self, graph: BondGraph) -> None:
        self.graph = graph
        self.causality = assign_causality(graph)
        self.made = collect(graph, self.causality)
        self.found: dict[sp.Symbol, Assignment] = {}
        self.states = [State(symbol(s.name), symbol(s.rate), s.element, s.unit)
                       for s in self.made.states]  # fmt: skip
        self.inputs = [symbol(u) for u in (*self.made.inputs, *self.made.recorded)]
        self.outputs = [(n, symbol(y), unit) for n, y, unit in self.made.outputs]
        self.laws: list[LawPort] = []
        self.derivatives: dict[sp.Symbol, str] = {}

    # -- assembly ---------------------------------------------------------------------------
    def result(self) -> StateSpace:
        from bondgraph.equations.dependent_storage import drop_derivatives

        dependent = {d.stored for d in self.made.dependents}
        for r in self.made.found.values():
            if r.target not in dependent:
                self._take(r)
        _resolve_dependent_storages(self)
        for e in self.made.displacements:
            flow = symbol(SignalNames(self.graph).at("f", self.graph.neighbour(e.name)))
            value = self._displacement(e, flow)
            self.assign(symbol(f"x_{e.name}"), value, f"displacement at {e.name}")
        for d in self.made.rates:
            self.assign(symbol(d.rate), self._rate(d), f"rate read by {d.element}")
        drop_derivatives(self)
        ordered = _ordered(self.graph.name, self.found)
        self._require_watched()
        return StateSpace(
            self.graph.name,
            tuple(self.states),
            tuple(self.inputs),
            tuple(self.outputs),
            ordered,
            tuple(self.laws),
            self.graph.parameters,
            self.causality,
            tuple(self.made.recorded),
        )

    def _require_watched(self) -> None:
        """Refuse laws that watch a signal that there is not."""
        known = {str(s) for s in (*self.found, *self.inputs, *(x.symbol for x in self.states))}
        for port in self.laws:
            if port.law.watched and port.law.watched not in known:
                raise unknown_name("signal", port.law.watched, self.graph.name, sorted(known))

    def assign(
        self, target: sp.Symbol, expression: sp.Expr, reason: str, shown: sp.Expr | None = None
    ) -> None:
        if target == expression:
            return
        self.found[target] = Assignment(
            target, expression, expression if shown is None else shown, reason
        )

    def _take(self, r: Relation) -> None:
        """Take a relation over as an assignment; its law becomes a port."""
        use = None if r.law is None else self.made.laws[r.law]
        own = () if use is None else (use.argument,)
        plain = all(s in own for s in r.reads)
        if r.expression is not None and plain and not r.implicit:
            self._pseudo_input(ONE)
            constant = r.expression * ONE
        elif r.expression is not None or not plain:
            raise NotLinearUpToLaws(
                f"{self.graph.name}: {r.reason} multiplies or transforms signals, so the model is "
                "not linear up to scalar laws; system(graph) gives its equations, and simulate "
                "runs it"
            )
        else:
            constant = sp.S.Zero
        target = symbol(r.target)
        if use is None:
            self.assign(target, _sum(r.terms) + constant, r.reason)
            return
        w = self.law_port(use)
        if r.implicit:
            if use.slope == 0:
                raise AlgebraicLoop(
                    f"{self.graph.name}: the law of {use.element} gives effort from flow, and its "
                    "flow is wanted; give it a linear part, or a small inertia beside it"
                )
            (effort,) = (s for c, s in r.terms if c == -1)
            inverse = sp.Function(f"{use.element}_inverse")(symbol(effort))
            self.assign(target, (symbol(effort) - w) / use.slope, r.reason, inverse)
            return
        rest = [(c, s) for c, s in r.terms if s != use.argument]
        ending = {"drive": "_drive", "sensor": "_reading"}.get(use.role, "")
        shown = sp.Function(f"{use.element}{ending}")(symbol(use.argument)) + _sum(rest) + constant
        self.assign(target, _sum(r.terms) + w + constant, r.reason, shown)

    def _pseudo_input(self, s: sp.Symbol) -> None:
        if s not in self.inputs:
            self.inputs.append(s)

    def law_port(self, use: LawUse) -> sp.Symbol:
        w, argument = symbol(f"w_{use.element}"), symbol(use.argument)
        self.laws.append(LawPort(use.element, use.role, use.law, w, argument, use.parameters))
        for name in use.ports[1:]:
            # a law without output makes the signal known at the end of every step
            beside = symbol(use.law.watched)
            self.laws.append(LawPort(name, "gauge", Gauge(), symbol(f"w_{name}"), beside, ()))
        return w

    def _displacement(self, e: Dq, flow: sp.Symbol) -> sp.Expr:
        """Return stored displacements that already integrate this flow, or a new state."""
        from bondgraph.equations.dependent_storage import displacement_of_dependents

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

    def _rate(self, d: Dependent) -> sp.Expr:
        """Return the rate of a signal that states alone decide, linearly."""
        closed: dict[sp.Symbol, sp.Expr] = {}
        for a in _ordered(self.graph.name, self.found):
            closed[a.target] = a.expression.xreplace(closed)
        signal = symbol(d.stored)
        value = sp.expand(closed.get(signal, signal))
        rates = {s.symbol: s.rate for s in self.states}
        known = self.graph.parameters
        others = {v for v in value.free_symbols - rates.keys() if str(v) not in known}
        if others:
            raise NotLinearUpToLaws(
                f"{self.graph.name}: {d.element} reads the rate of a signal that "
                f"{', '.join(sorted(map(str, others)))} moves at once; system(graph) gives its "
                "equations, and simulate runs it"
            )
        return sum((value.coeff(s) * rate for s, rate in rates.items()), sp.S.Zero)


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


def _sum(terms: Iterable[tuple[Any, str]]) -> sp.Expr:
    return sp.Add(*(sp.Mul(c, symbol(s)) for c, s in terms))


def _ordered(name: str, found: Mapping[sp.Symbol, Assignment]) -> tuple[Assignment, ...]:
    """Order assignments; linear loops are solved in closed form."""
    by_name = {str(t): a for t, a in found.items()}
    reads = {
        n: sorted(str(s) for s in a.expression.free_symbols if s in found)
        for n, a in by_name.items()
    }
    ordered: list[Assignment] = []
    for part in components(by_name, reads.__getitem__):
        if len(part) == 1 and part[0] not in reads[part[0]]:
            ordered.append(by_name[part[0]])
        else:
            ordered.extend(_solved(name, [by_name[n] for n in part]))
    return tuple(ordered)


def _solved(name: str, loop: list[Assignment]) -> list[Assignment]:
    """Solve a linear algebraic loop: torn signals in closed form, then the rest as it was."""
    by_name = {str(a.target): a for a in loop}
    torn, order = tear(
        list(by_name),
        lambda n: sorted(str(s) for s in by_name[n].expression.free_symbols if str(s) in by_name),
        lambda n: 0 if by_name[n].reason.startswith("R ") else 1,
    )
    closed: dict[sp.Symbol, sp.Expr] = {}
    for n in order:
        closed[by_name[n].target] = sp.expand(by_name[n].expression.xreplace(closed))
    unknown = [by_name[t].target for t in torn]
    matrix = sp.eye(len(torn))
    right = sp.zeros(len(torn), 1)
    for i, t in enumerate(torn):
        value = sp.expand(by_name[t].expression.xreplace(closed))
        for j, u in enumerate(unknown):
            slope = value.coeff(u)
            matrix[i, j] -= slope
            value -= sp.expand(slope * u)
        right[i] = sp.expand(value)
    determinant = sp.cancel(matrix.det(method="berkowitz"))
    if determinant == 0:
        reasons = sorted({a.reason for a in loop if not a.reason.startswith("sum")})
        raise AlgebraicLoop(
            f"{name}: the algebraic loop through {', '.join(reasons) or 'junctions only'} is "
            "singular: its signals are not determined; put a resistance or a storage at one of "
            "its junctions, or remove a redundant bond"
        )
    solution = matrix.adjugate(method="berkowitz") * right / determinant
    solved = []
    for u, value, t in zip(unknown, solution, torn, strict=True):
        solved.append(Assignment(u, value, value, f"{by_name[t].reason}; algebraic loop solved"))
    return [*solved, *(by_name[n] for n in order)]


def _resolve_dependent_storages(d: _Derivation) -> None:
    """Solve one C in derivative causality by working with displacements instead of flows.

    Its flow ``f_D`` drives some stores; ``z = q - c q_D`` of those no longer contains ``f_D``.
    What is left is ``law_D(q_D) = a - beta q_D``, whose solution is the inverse of
    ``beta + law_D``: for an operator with memory ``q_D = (I + C H)^-1 [C a]``.
    """
    from bondgraph.equations.dependent_storage import eliminate

    if len(d.causality.derivative) > MOST_DEPENDENT:
        raise DerivativeCausality(
            f"{d.graph.name}: {', '.join(d.causality.derivative)} have derivative causality, and "
            f"more than {MOST_DEPENDENT} are not solved at once; put resistances in series with "
            "them (or merge them)"
        )
    for dependent in d.made.dependents:
        eliminate(d, dependent)
