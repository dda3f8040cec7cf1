"""The port-Hamiltonian form of a model: energy, interconnection, dissipation, ports.

``dx/dt = (J - R) dH/dx + (G - P) u``, ``y = (G + P)^T dH/dx + (N + S) u`` with J and N skew and
``[[R, P], [P^T, S]]`` positive semidefinite, so that ``dH/dt <= u^T y`` (van der Schaft and
Jeltsema, Foundations and Trends in Systems and Control 1 (2014) 173, ch. 4).

Sizes: n energy states, m ports.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import sympy as sp

from bondgraph.energy.definiteness import shortened, vanishes
from bondgraph.energy.passivity import Passivity, judge
from bondgraph.energy.stores import energy_problems, store_energy, store_names
from bondgraph.energy.structure import EnergyPort, Forms, ports, resistances
from bondgraph.equations.decimals import spaced
from bondgraph.equations.derivation import equations
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import RS, Source
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Da
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.support.errors import GraphError


@dataclass(frozen=True)
class PortHamiltonian:
    """A model as energy and structure; matrices depend on parameters, and on states if modulated.

    Attributes
    ----------
    name : str
    states : tuple of str, shape (n,)
        Stored variables of independent stores, as in `System`.
    energy : sympy.Expr
        ``H(x)``, J; dependent stores included.
    gradient : sympy.Matrix, shape (n, 1)
        ``dH/dx``.
    J, R : sympy.Matrix, shape (n, n)
        Skew and symmetric.
    G, P : sympy.Matrix, shape (n, m)
    N, S : sympy.Matrix, shape (m, m)
        Skew and symmetric feedthrough.
    inputs, outputs : tuple of str, shape (m,)
        Signals at the ports: what sources (then nonlinear resistors and stores with memory)
        impose, and the conjugates; ``u * y`` is power into the model.
    laws : tuple of str
        Elements behind the last ports: they take energy, ``u * y <= 0``, if their claim is true.
    outside : tuple of str
        States of `System` that hold no energy of this form: lags, integrals read by sensors,
        stored variables of laws with memory.
    passivity : Passivity
    """

    name: str
    states: tuple[str, ...]
    energy: sp.Expr
    gradient: sp.Matrix
    J: sp.Matrix
    R: sp.Matrix
    G: sp.Matrix
    P: sp.Matrix
    N: sp.Matrix
    S: sp.Matrix
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    laws: tuple[str, ...]
    outside: tuple[str, ...]
    passivity: Passivity
    _model: System = field(repr=False)
    _resistances: tuple[tuple[sp.Matrix, sp.Matrix], ...] = field(repr=False)
    _signs: tuple[int, ...] = field(repr=False)

    @property
    def Q(self) -> sp.Matrix | None:
        """Hessian of the energy if it is quadratic, ``dH/dx = Q x``; else None."""
        x = [symbol(n) for n in self.states]
        hessian = self.gradient.jacobian(x)
        still = dict.fromkeys(x, sp.S.Zero)
        if hessian.free_symbols & set(x) or any(
            not vanishes(g.xreplace(still)) for g in self.gradient
        ):
            return None
        return hessian

    @property
    def dissipation(self) -> sp.Matrix:
        """``[[R, P], [P^T, S]]``, shape (n + m, n + m)."""
        return sp.Matrix(sp.BlockMatrix([[self.R, self.P], [self.P.T, self.S]]).as_explicit())

    def rates(self) -> sp.Matrix:
        """``dx/dt`` of this form, with the closed form of every port variable, shape (n, 1)."""
        return (self.J - self.R) * self.gradient + (self.G - self.P) * self._u()

    def differences(self) -> tuple[sp.Expr, ...]:
        """Everything that must vanish, simplified: zeros if the form is right.

        Rates less those of `System`; outputs less the conjugate signals; gradient less the
        derivatives of the energy; ``[[R, P], [P^T, S]]`` less the sum of ``F^T r F`` over the
        resistors, with F from the form's variables to their flows.
        """
        model, n = self._model, len(self.states)
        rate = {s.name: s.rate for s in model.stored}
        y = (self.G + self.P).T * self.gradient + (self.N + self.S) * self._u()
        found = list(self.rates() - sp.Matrix(n, 1, [model.signal(rate[x]) for x in self.states]))
        for value, name, sign in zip(y, self.outputs, self._signs, strict=True):
            found.append(value - sign * model.signal(name))
        for g, x in zip(self.gradient, self.states, strict=True):
            found.append(g - self.energy.diff(symbol(x)))
        left = self.dissipation
        for flows, matrix in self._resistances:
            left = left - flows.T * (matrix + matrix.T) / 2 * flows
        found += list(left)
        return tuple(sp.S.Zero if vanishes(d) else d for d in found)

    def _u(self) -> sp.Matrix:
        return sp.Matrix(len(self.inputs), 1, [self._model.signal(u) for u in self.inputs])

    def __str__(self) -> str:
        """Energy, matrices and the verdict as text."""
        lines = [f"x = {', '.join(self.states)}", f"H = {self.energy}"]
        for name in "JRGPNS":
            m = getattr(self, name)
            if not m.is_zero_matrix:
                lines.append(f"{name} = {m.tolist()}")
        ends = zip(self.inputs, self.outputs, strict=True)
        lines.append("ports (u, y): " + ", ".join(f"({u}, {y})" for u, y in ends))
        return "\n".join([*lines, str(self.passivity)])

    def _repr_latex_(self) -> str:
        """Return energy and structure for notebooks."""
        x = sp.Matrix([symbol(n) for n in self.states])
        parts = [rf"x = {spaced(x)}", rf"H = {spaced(self.energy)}"]
        for name in "JRGPNS":
            m = getattr(self, name)
            if not m.is_zero_matrix:
                parts.append(rf"{name} = {spaced(m)}")
        return "$$" + r",\quad ".join(parts) + "$$"


def port_hamiltonian(graph: BondGraph) -> PortHamiltonian:
    """Return the port-Hamiltonian form of `graph` in the states of `System`.

    Dependent stores are taken into the energy: with ``x_d = g(x)`` and ``e_d = T e`` of the
    co-energies, ``dH/dx = M^T e`` and ``dx/dt = M^-1 (A e + B u)`` for ``M = I + T^T dg/dx``, so
    that ``M^-1 A M^-T`` is again a skew less a positive matrix. Linear loops are solved. Resistors
    with nonlinear laws and stores with memory stay as ports with the claim of their law.

    Raises
    ------
    GraphError
        A store has no energy; a dependent store follows an input, time or a nonlinear equation; an
        RS heats the pseudo thermal domain (no energy there).

    Examples
    --------
    >>> from bondgraph import BondGraph, C, I, One, R, Se
    >>> with BondGraph("rlc") as g:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("R_1", 2.0)
    ...     _ = loop >> I("L", 0.5)
    ...     _ = loop >> C("C_1", 0.1)
    >>> form = port_hamiltonian(g)
    >>> form.J, form.R, form.G
    (Matrix([
    [0, -1],
    [1,  0]]), Matrix([
    [R_1, 0],
    [  0, 0]]), Matrix([
    [1],
    [0]]))
    >>> print(form.passivity)
    passive for all positive parameters
    """
    model = equations(graph)
    graph = in_mode(graph)
    _refuse(graph, model)
    found = ports(graph, model)
    free = set(model.states)
    stores = [p for p in found if p.kind == "store" and p.state in free]
    dependent = [p for p in found if p.kind == "store" and p.state not in free]
    ends = [p for p in found if p.kind == "source"] + [p for p in found if p.kind == "law"]
    resisting = resistances(graph)
    e, u = [p.output for p in stores], [p.output for p in ends]
    forms = Forms(model, [*e, *u])
    rate = {s.name: s.rate for s in model.stored}

    def matrix(names: Sequence[str], order: Sequence[str]) -> sp.Matrix:
        return sp.Matrix(len(names), len(order), [k for x in names for k in forms.row(x, order)])

    rates = [rate[p.state] for p in stores]
    conjugate = [p.other for p in ends]
    signs = sp.diag(*(p.sign for p in ends)) if ends else sp.zeros(0, 0)
    ahead = _ahead(model, forms, stores, dependent, e, u)
    back = ahead.inv().applyfunc(shortened) if dependent else ahead
    a, b = matrix(rates, e) * back, matrix(rates, u)
    c, d = signs * matrix(conjugate, e) * back, signs * matrix(conjugate, u)
    names = tuple(p.state for p in stores)
    a, b, c, d = (k.applyfunc(shortened) for k in (a, b, c, d))
    outside = tuple(s for s in model.states if s not in names)
    return PortHamiltonian(
        name=graph.name,
        states=names,
        energy=_energy(graph, model),
        gradient=ahead * sp.Matrix(len(e), 1, [model.signal(s) for s in e]),
        J=((a - a.T) / 2).applyfunc(shortened),
        R=(-(a + a.T) / 2).applyfunc(shortened),
        G=((b + c.T) / 2).applyfunc(shortened),
        P=((c.T - b) / 2).applyfunc(shortened),
        N=((d - d.T) / 2).applyfunc(shortened),
        S=((d + d.T) / 2).applyfunc(shortened),
        inputs=tuple(u),
        outputs=tuple(conjugate),
        laws=tuple(p.element for p in ends if p.kind == "law"),
        outside=outside,
        passivity=judge(graph, resisting),
        _model=model,
        _resistances=tuple(
            (sp.Matrix.hstack(matrix(r.flows, e) * back, matrix(r.flows, u)), r.matrix)
            for r in resisting
        ),
        _signs=tuple(p.sign for p in ends),
    )


def _refuse(graph: BondGraph, model: System) -> None:
    if lines := [x for x in energy_problems(graph) if "not reciprocal" in x]:
        raise GraphError(f"{graph.name}: {lines[0]}")
    for e in graph.of_type(RS):
        if e.heat == "energy":
            raise GraphError(
                f"{graph.name}: no port-Hamiltonian form, because {e.name} (RS) heats the pseudo "
                "thermal domain, where effort times flow is no power; use heat='entropy'"
            )
    if model.input_rates:
        held, cure = list(model.held.values()), "put a resistance between source and store"
        if not held:
            held = [s.name for s in graph.of_type(Source) if s.given == "integral"]
            cure = "give what is recorded of it by its value or its rate"
        if not held:
            held, cure = [s.name for s in graph.of_type(Da)], "take it out"
        raise GraphError(
            f"{graph.name}: no port-Hamiltonian form, because {', '.join(held)} follow an input "
            f"({', '.join(model.input_rates)} in the equations); {cure}"
        )


def _ahead(
    model: System,
    forms: Forms,
    stores: list[EnergyPort],
    dependent: list[EnergyPort],
    e: list[str],
    u: list[str],
) -> sp.Matrix:
    """Return ``M^T``: from the efforts of free stores to the gradient of the whole energy."""
    n = len(stores)
    states = [symbol(p.state) for p in stores]
    total = sp.eye(n)
    unknown = {symbol(a.name) for a in model.algebraic}
    for p in dependent:
        held = model.signal(p.state)
        if held.free_symbols & unknown or symbol(p.state) in unknown:
            raise GraphError(
                f"{model.name}: no port-Hamiltonian form, because the dependent store {p.element} "
                "follows from a nonlinear equation; put a resistance beside it"
            )
        if any(not vanishes(k) for k in forms.row(p.output, u)) or symbol("time") in (
            held.free_symbols
        ):
            raise GraphError(
                f"{model.name}: no port-Hamiltonian form, because the dependent store {p.element} "
                "follows an input or time; put a resistance between source and store"
            )
        slope = sp.Matrix(n, 1, [held.diff(x) for x in states])
        total = total + slope * sp.Matrix(1, n, forms.row(p.output, e))
    return total


def _energy(graph: BondGraph, model: System) -> sp.Expr:
    total: sp.Expr = sp.S.Zero
    for name in store_names(graph):
        law = getattr(graph[name], "law", None)
        if not isinstance(law, tuple) and law is not None and law.n_memory:
            continue
        total = total + store_energy(graph, name)
    return total.xreplace({symbol(d): model.signal(d) for d in model.held})
