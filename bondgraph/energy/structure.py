"""The power-conserving structure of a model: rates and ports, linear in efforts and flows.

Outputs of stores, variables of sources and outputs of nonlinear resistors are leaves here;
junctions and two-ports make everything else a linear combination of them, with coefficients that
may depend on the state (a modulated two-port).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import sympy as sp

from bondgraph.energy.definiteness import vanishes
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.equations.field_laws import field_laws
from bondgraph.equations.relation import Relation
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import RE, RS, C, CField, Element, Field, I, IField, R, RField, Source
from bondgraph.graph.modulation import port_variables
from bondgraph.graph.parameter import symbol
from bondgraph.support.errors import GraphError

Form = Mapping[str, sp.Expr]
"""Coefficients of leaves."""


@dataclass(frozen=True, slots=True)
class EnergyPort:
    """A port at which energy enters the structure.

    Attributes
    ----------
    element : str
    kind : {"store", "source", "law"}
        ``law``: a resistor, or a store with memory, whose relation is not linear.
    state : str
        Stored variable of a store, else empty.
    output : str
        Signal that the element imposes.
    other : str
        Its conjugate.
    sign : int
        Power into the structure is ``sign * output * other``.
    """

    element: str
    kind: str
    state: str
    output: str
    other: str
    sign: int = 1


@dataclass(frozen=True, slots=True)
class Resistance:
    """A linear resistor or R field: ``e = matrix f``."""

    element: str
    flows: tuple[str, ...]
    matrix: sp.Matrix


def ports(graph: BondGraph, model: System) -> tuple[EnergyPort, ...]:
    """Return stores (dependent ones too), sources and nonlinear resistors, port by port."""
    names = SignalNames(graph)
    strokes = model.causality.strokes
    found: list[EnergyPort] = []
    for e in graph.elements.values():
        here = [b for b in graph.bonds_of(e.name) if b in strokes]
        if isinstance(e, Source | R | C | I | Field | RE | RS) and not _is_linear_r(graph, e):
            for i, b in enumerate(here, start=1):
                gets_effort = strokes[b].effort_to == e.name
                found.append(_port(names, e, b, i, gets_effort))
    return tuple(found)


def resistances(graph: BondGraph) -> tuple[Resistance, ...]:
    """Return the linear resistors."""
    names = SignalNames(graph)
    found = []
    for e in graph.of_type(R, RField):
        if _is_linear_r(graph, e):
            flows = tuple(_flow_in(names, e, b) for b in graph.bonds_of(e.name))
            if isinstance(e, R):
                matrix = sp.Matrix([[graph.coefficient(e)]])
            else:
                local = port_variables("f", e.ports)
                matrix = sp.Matrix(field_laws(graph, e)).jacobian(local)
            found.append(Resistance(e.name, flows, matrix))
    return tuple(found)


def _is_linear_r(graph: BondGraph, e: Element) -> bool:
    if isinstance(e, R):
        return e.law is None
    if isinstance(e, RField):
        local = port_variables("f", e.ports)
        laws = field_laws(graph, e)
        constant = any(k.xreplace(dict.fromkeys(local, sp.S.Zero)) != 0 for k in laws)
        jacobian = sp.Matrix(laws).jacobian(local)
        return not constant and not jacobian.free_symbols & set(local)
    return False


def _flow_in(names: SignalNames, e: Element, b: Bond) -> str:
    one_port = not isinstance(e, Source | Field | RE | RS)
    return f"inward_{e.name}" if one_port and b.tail == e.name else names.flow(b)


def _port(names: SignalNames, e: Element, b: Bond, i: int, gets_effort: bool) -> EnergyPort:
    effort, flow = names.effort(b), _flow_in(names, e, b)
    if isinstance(e, Source):
        out, other = (flow, effort) if gets_effort else (effort, flow)
        return EnergyPort(e.name, "source", "", out, other, 1 if b.tail == e.name else -1)
    number = f"{e.name}{i}" if isinstance(e, Field) else e.name
    if isinstance(e, C | CField | I | IField):
        capacitive = isinstance(e, C | CField)
        state = f"{'q' if capacitive else 'p'}_{number}"
        out, other = (effort, flow) if capacitive else (flow, effort)
        remembers = isinstance(e, C | I) and e.law is not None and e.law.n_memory
        return EnergyPort(e.name, "law" if remembers else "store", state, out, other, -1)
    out, other = (flow, effort) if gets_effort else (effort, flow)
    # through an RE or RS, the half arrow of the second bond points out
    return EnergyPort(
        e.name, "law", "", out, other, 1 if b.tail == e.name and not isinstance(e, R) else -1
    )


class Forms:
    """Every signal as a linear combination of leaves, found in one pass.

    Raises
    ------
    GraphError
        When a signal is asked for that is not linear in the leaves.
    """

    def __init__(self, model: System, leaves: Iterable[str]) -> None:
        self._model = model
        self._leaves = set(leaves)
        self._torn = [a for a in model.algebraic if a.name not in self._leaves]
        self._form: dict[str, Form | str] = {n: {n: sp.S.One} for n in self._leaves}
        self._form |= {a.name: {a.name: sp.S.One} for a in self._torn}
        for r in model.relations:
            if r.target not in self._form:
                self._form[r.target] = self._of(r)
        if self._torn:
            self._solve_loops()

    def __call__(self, name: str) -> Form:
        """Return the coefficients of a signal."""
        form = self._form.get(name)
        if form is None or isinstance(form, str):
            why = form or f"{name} is read directly"
            raise GraphError(
                f"{self._model.name}: no port-Hamiltonian form, because {name} is not linear in "
                f"efforts and flows ({why})"
            )
        return form

    def row(self, name: str, order: Iterable[str]) -> list[sp.Expr]:
        """Return the coefficients of a signal in the order of leaves given."""
        form = self(name)
        return [form.get(n, sp.S.Zero) for n in order]

    def _of(self, r: Relation) -> Form | str:
        if r.expression is not None and not vanishes(r.expression):
            return r.reason
        if r.law is not None:
            return f"law of {self._model.laws[r.law].element}"
        reads = {symbol(s): self._model.signal(s) for s in r.reads}
        total: dict[str, sp.Expr] = {}
        for c, s in r.terms:
            form = self._form.get(s, f"{s} is read directly by {r.reason}")
            if isinstance(form, str):
                return form
            k = sp.sympify(c).xreplace(reads)
            for leaf, v in form.items():
                total[leaf] = total.get(leaf, sp.S.Zero) + k * v
        return total

    def _solve_loops(self) -> None:
        """Loops torn for nonlinear resistors are linear once those are leaves."""
        unknown = [symbol(a.name) for a in self._torn]
        equations = []
        for a in self._torn:
            form = self._of(
                Relation("", a.residual.terms, a.residual.reason, reads=a.residual.reads)
            )
            if a.residual.law is not None or a.residual.expression is not None:
                form = a.reason
            if isinstance(form, str):
                raise GraphError(
                    f"{self._model.name}: no port-Hamiltonian form, because {a.name} follows from "
                    f"a nonlinear equation ({form})"
                )
            equations.append(sp.Add(*(c * symbol(n) for n, c in form.items())))
        solution = sp.solve(equations, unknown, dict=True)
        if len(solution) != 1:
            raise GraphError(f"{self._model.name}: the loop of {unknown} is singular")
        for n, form in list(self._form.items()):
            if isinstance(form, str) or not any(a.name in form for a in self._torn):
                continue
            value = sp.expand(sp.Add(*(c * solution[0].get(symbol(k), symbol(k))
                                       for k, c in form.items())))  # fmt: skip
            self._form[n] = {
                k: c for k in self._leaves if (c := sp.cancel(value.coeff(symbol(k)))) != 0
            }
