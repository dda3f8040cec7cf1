"""The energy of every store, and whether a multiport can be passive at all.

A store has an energy only if its law is the gradient of one: the Jacobian of the law must be
symmetric (Maxwell's reciprocity). One that is not gives work on a closed cycle for ever.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from math import isfinite

import sympy as sp

from bondgraph.energy.definiteness import Sign, sign_of, vanishes
from bondgraph.energy.law_energy import law_energy
from bondgraph.equations.field_laws import field_laws
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, CField, Element, Field, I, IField, RField
from bondgraph.graph.modulation import port_variables
from bondgraph.graph.parameter import symbol
from bondgraph.support.errors import BondsightError, GraphError, require_known, unknown_name

_OUTPUT = {"q": "e", "p": "f", "f": "e"}


@dataclass(frozen=True, slots=True)
class Positivity:
    """Sign of the Hessian of a store, or of the symmetric part of a resistive field.

    Attributes
    ----------
    element : str
    matrix : sympy.Matrix
        In stored variables and parameters.
    sign : {"positive definite", "positive semidefinite", "indefinite"}
    exact : bool
        Proved for all positive parameters; otherwise exactly at the declared values.
    at : dict of str to float
        Stored variables at which a nonlinear one was judged; empty for a linear one.
    """

    element: str
    matrix: sp.Matrix
    sign: Sign
    exact: bool
    at: Mapping[str, float]


def store_names(graph: BondGraph) -> tuple[str, ...]:
    """Return the storages of a graph, in order of declaration."""
    return tuple(e.name for e in graph.of_type(C, I, CField, IField))


def stored_variables(graph: BondGraph, element: str) -> tuple[str, ...]:
    """Return the stored variables of a storage: ``q_C``, ``p_m``, of a field ``q_plate1``, ..

    Raises
    ------
    UnknownName
        It is no storage.
    """
    e = _store(graph, element)
    if isinstance(e, Field):
        return tuple(f"{e.letter}_{e.name}{i}" for i in range(1, e.ports + 1))
    return (f"{'q' if isinstance(e, C) else 'p'}_{e.name}",)


def store_energy(graph: BondGraph, element: str) -> sp.Expr:
    """Return the energy of a storage in its stored variables and parameters.

    Linear: ``k q^2 / 2``, ``p^2 / (2 I)``. A law without memory is integrated from 0 (an
    unevaluated integral where no closed form is known); the law of a field is integrated port by
    port.

    Raises
    ------
    UnknownName
        It is no storage.
    GraphError
        Its law has memory, so that the energy depends on the past (see `bondgraph.energy.ledger`),
        or is not reciprocal, so that there is none.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, Se
    >>> with BondGraph("rc") as g:
    ...     _ = Se("V") >> One("loop") >> C("C_1", 1e-6)
    >>> store_energy(g, "C_1")
    q_C_1**2/(2*C_1)
    """
    e = _store(graph, element)
    if isinstance(e, Field):
        return _field_energy(graph, e)
    assert isinstance(e, C | I)
    (variable,) = map(symbol, stored_variables(graph, element))
    slope = graph.slope(e)
    energy: sp.Expr = slope * variable**2 / 2
    if e.law is not None:
        if e.law.n_memory:
            raise GraphError(
                f"{graph.name}: the energy of {element} depends on its past (law with memory); "
                "ledger(graph, trajectory) gives it along a motion"
            )
        symbols = {p.name: p.symbol for p in graph.parameters.values()}
        parameters = tuple(symbols[p.name] for p in e.law.parameters(element))
        energy += law_energy(e.law, variable, parameters)
    return energy


def positivity(graph: BondGraph, element: str, at: Mapping[str, float] | None = None) -> Positivity:
    """Judge the Hessian of a store's energy, or the symmetric part of an `RField`.

    Parameters
    ----------
    at : dict of str to float, optional
        Operating point of a nonlinear law: stored variables (flows ``f1, f2, ..`` of an `RField`),
        0 where not given.

    Returns
    -------
    Positivity
        Linear laws are judged exactly: for all positive parameters if their minors show it, else
        at the declared values as rational numbers.

    Raises
    ------
    GraphError
        No energy, or no finite Hessian at that point.
    """
    e = graph[element]
    if isinstance(e, RField):
        names: tuple[str, ...] = tuple(map(str, port_variables("f", e.ports)))
        jacobian = sp.Matrix(field_laws(graph, e)).jacobian([symbol(n) for n in names])
        matrix = (jacobian + jacobian.T) / 2
    else:
        names = stored_variables(graph, element)
        matrix = sp.hessian(store_energy(graph, element), [symbol(n) for n in names])
    point = _point(graph, names, at or {})
    used = {n: float(v) for n, v in point.items() if symbol(n) in matrix.free_symbols}
    values = {symbol(n): v for n, v in point.items()}
    values |= _declared(graph)
    try:
        sign, exact = sign_of(matrix, values, may_vary=not used)
    except ValueError:
        raise GraphError(
            f"{graph.name}: {element} has no finite Hessian at {used}; give another point with at="
        ) from None
    return Positivity(element, matrix, sign, exact, used)


def energy_problems(graph: BondGraph) -> tuple[str, ...]:
    """Return one line for each multiport that must create energy.

    A C or I field whose law is not reciprocal; a linear one whose energy is not bounded below; an R
    field that gives power at small flows. A curved energy that is not convex is none: a plate
    capacitor and a buckled spring are physical.

    Examples
    --------
    The moving-plate capacitor with the force ``c0 x0 q^2 / (2 x^2)``, which its voltage
    ``q x / (c0 x0)`` contradicts:

    >>> import sympy as sp
    >>> from bondgraph import BondGraph, One, Se
    >>> from bondgraph.graph.modulation import port_variables
    >>> q, x = port_variables("q", 2)
    >>> with BondGraph("mtt") as g:
    ...     c0, x0 = g.parameter("c0", 1e-9), g.parameter("x0", 1e-3)
    ...     plate = CField("plate", law=(q * x / (c0 * x0), c0 * x0 * q**2 / (2 * x**2)))
    ...     _ = Se("V") >> One("loop") >> plate
    ...     _ = Se("F") >> One("body") >> plate
    >>> print(energy_problems(g)[0][:60])
    plate (CF): ports 1 and 2 are not reciprocal: de1/dq2 = q1/(
    """
    lines: list[str] = []
    for e in graph.of_type(Field):
        try:
            lines.extend(_field_problems(graph, e))
        except BondsightError as error:
            lines.append(str(error))
    return tuple(lines)


def _store(graph: BondGraph, element: str) -> Element:
    e = graph[element]
    if not isinstance(e, C | I | CField | IField):
        raise unknown_name("storage", element, graph.name, store_names(graph))
    return e


def _point(
    graph: BondGraph, names: tuple[str, ...], at: Mapping[str, float]
) -> dict[str, sp.Rational]:
    require_known("stored variable", graph.name, names, *at)
    return {n: sp.Rational(str(float(at.get(n, 0.0)))) for n in names}


def _declared(graph: BondGraph) -> dict[sp.Symbol, sp.Rational]:
    found = graph.parameters.values()
    return {p.symbol: sp.Rational(str(float(p.value))) for p in found if isfinite(p.value)}


def _field_energy(graph: BondGraph, e: Field) -> sp.Expr:
    local = port_variables(e.letter, e.ports)
    laws = field_laws(graph, e)
    if lines := _not_reciprocal(e, laws, local):
        raise GraphError(f"{graph.name}: {lines[0]}")
    given = getattr(e, "energy", None)
    if given is not None:
        energy = sp.sympify(graph.declared(given, e.name) if isinstance(given, str) else given)
    else:
        energy = _potential(laws, local)
    outside = map(symbol, stored_variables(graph, e.name))
    return energy.xreplace(dict(zip(local, outside, strict=True)))


def _potential(laws: tuple[sp.Expr, ...], local: tuple[sp.Symbol, ...]) -> sp.Expr:
    """Return a function whose gradient is the laws: one variable after the other."""
    total: sp.Expr = sp.S.Zero
    for law, v in zip(laws, local, strict=True):
        rest = sp.expand(law - total.diff(v))
        if not vanishes(rest):
            total = total + sp.integrate(rest, v)
    start = total.xreplace(dict.fromkeys(local, sp.S.Zero))
    return total - start if start.is_finite else total


def _not_reciprocal(e: Field, laws: tuple[sp.Expr, ...], local: tuple[sp.Symbol, ...]) -> list[str]:
    lines = []
    for i, j in combinations(range(len(local)), 2):
        ij, ji = laws[i].diff(local[j]), laws[j].diff(local[i])
        if not vanishes(ij - ji):
            o, v = _OUTPUT[e.letter], e.letter
            lines.append(
                f"{e.name} ({e.kind}): ports {i + 1} and {j + 1} are not reciprocal: "
                f"d{o}{i + 1}/d{v}{j + 1} = {sp.factor(ij)} but "
                f"d{o}{j + 1}/d{v}{i + 1} = {sp.factor(ji)}, so no energy exists and a cycle would "
                "create power; correct one law, or give energy="
            )
    return lines


def _field_problems(graph: BondGraph, e: Field) -> list[str]:
    laws = field_laws(graph, e)
    local = port_variables(e.letter, e.ports)
    if not isinstance(e, RField) and (lines := _not_reciprocal(e, laws, local)):
        return lines
    jacobian = sp.Matrix(laws).jacobian(local)
    matrix = (jacobian + jacobian.T) / 2
    linear = not matrix.free_symbols & set(local)
    rest = dict.fromkeys(local, sp.S.Zero)
    # a curved energy may be bounded although its Hessian is not positive
    if not linear and (not isinstance(e, RField) or any(k.xreplace(rest) != 0 for k in laws)):
        return []
    values = rest | _declared(graph)
    try:
        sign, _ = sign_of(matrix, values, may_vary=False)
    except ValueError:
        return []  # infinite, or not a number, without flow: nothing is proved
    if sign != "indefinite":
        return []
    what = "its symmetric part" if isinstance(e, RField) else "its matrix"
    does = "gives power" if isinstance(e, RField) else "has no lowest energy"
    return [
        f"{e.name} ({e.kind}): {what} is not positive semidefinite at the declared values, so it "
        f"{does}; check the signs and the size of the coupling"
    ]
