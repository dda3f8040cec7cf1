"""BondGraph -> System: order the relations, solve what is linear, name what is not."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from typing import Any

import sympy as sp

from bondgraph.causality.assignment import (
    CausalConflict,
    Causality,
    assign_causality,
    storage_ports,
    with_dependent_storages,
)
from bondgraph.equations.cancelled_rates import without_cancelled_rates
from bondgraph.equations.closed_forms import Closing
from bondgraph.equations.dependent_storage import displaced
from bondgraph.equations.elimination import eliminate_named
from bondgraph.equations.ordering import components, tear
from bondgraph.equations.refusals import AlgebraicLoop, DerivativeCausality
from bondgraph.equations.relation import Dependent, Relation, Relations
from bondgraph.equations.relations import collect
from bondgraph.equations.stored_displacements import place_displacements
from bondgraph.equations.system import Algebraic, System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Multiport
from bondgraph.graph.parameter import symbol
from bondgraph.graph.sensors import Da
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.support.errors import GraphError, UnusableInput
from bondgraph.support.spelled import spelled

SHORT = 40
LONG = 40
MOST_TRIED = 4
"""Assignments with storages that yield of which one must have equations: so far the first had."""


@spelled
def equations(graph: BondGraph, causality: Causality | None = None) -> System:
    """Derive the exact equations of `graph`.

    Parameters
    ----------
    graph : BondGraph
        Switched junctions are taken in the mode their `on` says.
    causality : Causality, optional
        One of `bondgraph.causality.assignment.alternatives`; assigned here when not given, with
        storages whose law has memory served first.

    Raises
    ------
    CausalConflict
        Two elements impose one variable, whichever storages yield.
    AlgebraicLoop
        A loop is singular: its equations determine nothing, or contradict each other.
    DerivativeCausality
        A dependent storage cannot be solved (its law has memory, or its index is too high).
    UnusableInput
        If `causality` is none, such as values.

    Examples
    --------
    >>> equations(graph).rates
    (F - d*p_m/m - k*q_k, p_m/m)
    """
    if causality is not None and not isinstance(causality, Causality):
        raise UnusableInput(
            f"equations: {type(causality).__name__} is no causality; equations hold for any "
            "values, and graph.with_values({...}) is the graph with others"
        )
    graph = in_mode(graph)
    if causality is None:
        try:
            causality = assign_causality(graph, first=_with_memory(graph))
        except CausalConflict as conflict:
            return _with_dependent(graph, conflict)
    made = _collected(graph, causality)
    try:
        return _Solver(made).solve()
    except DerivativeCausality as error:
        if not made.dependents:
            raise
        with suppress(GraphError):
            return displaced_equations(graph)
        with suppress(GraphError):
            return _Solver(without_cancelled_rates(_collected(graph, causality))).solve()
        raise error from None


def _with_dependent(graph: BondGraph, conflict: CausalConflict) -> System:
    """Derive the equations of a graph in which storages that could be independent have to yield."""
    for causality in islice(with_dependent_storages(graph), MOST_TRIED):
        for changed in (replace, without_cancelled_rates):
            with suppress(GraphError):  # solving takes notes in what was collected
                return _Solver(changed(_collected(graph, causality))).solve()
    raise conflict


def displaced_equations(graph: BondGraph) -> System:
    """Derive the equations of `graph` in coordinates in which no storage is dependent.

    Raises
    ------
    DerivativeCausality, NotLinearUpToLaws
        See `bondgraph.equations.dependent_storage.displaced`.
    """
    graph = in_mode(graph)
    return _Solver(displaced(_collected(graph, assign_causality(graph)))).solve()


def _collected(graph: BondGraph, causality: Causality) -> Relations:
    made = collect(graph, causality)
    place_displacements(made)
    return made


def _with_memory(graph: BondGraph) -> tuple[str, ...]:
    """Storages that must not be dependent: their law cannot be differentiated."""
    return tuple(
        name
        for name, _, e in storage_ports(graph)
        if not isinstance(e, Multiport) and e.law is not None and e.law.n_memory  # type: ignore[attr-defined]
    )


class _Solver:
    """Turns collected relations into ordered assignments."""

    def __init__(self, made: Relations) -> None:
        self.made = made
        self.name = made.graph.name
        self.parameters = made.graph.parameters
        self.states = {s.name: s for s in made.states}
        self.dependents = {d.rate: d for d in made.dependents}
        self.stores = {d.stored: d.rate for d in made.dependents}
        self.unknown: dict[str, Relation] = {}
        self.wanted: dict[str, tuple[str, str]] = {}
        self.ordered: dict[str, Relation] = {}
        self.algebraic: list[Algebraic] = []
        self.loops: list[tuple[str, ...]] = []
        self.input_rates = list(made.recorded)
        self.closed = Closing(self.ordered, made.laws, self.parameters)
        self.torn = {c for c in made.causality.free_choices}
        self.rate_reads: dict[str, tuple[str, ...]] = {}

    def solve(self) -> System:
        self.dependents |= {d.rate: d for d in self.made.rates}
        for rate in self.dependents:
            self.rate_reads[rate] = self._reads_of_derivative(self.dependents[rate])
        # a state of which nothing reads the rate still needs it
        for part in components([*self.made.found, *self.dependents], self._reads):
            self._component(part)
        self._refuse_empty_residuals()
        made = self.made
        return System(
            self.name,
            made.graph,
            tuple(made.states),
            tuple(made.inputs),
            tuple(self.input_rates),
            tuple(made.outputs),
            tuple(self.ordered.values()),
            tuple(self.algebraic),
            tuple(made.laws),
            {d.stored: d.element for d in made.dependents},
            tuple(self.loops),
            self.parameters,
            made.causality,
            made.aliases,
            tuple(made.recorded),
        )

    def _refuse_empty_residuals(self) -> None:
        """Refuse unknowns that no residual determines: a matching of both must exist."""
        if not self.algebraic:
            return
        import networkx as nx

        graph: nx.Graph = nx.Graph()
        names = {a.name for a in self.algebraic}
        rows = [("residual", i) for i in range(len(self.algebraic))]
        graph.add_nodes_from(rows)
        graph.add_nodes_from(names)
        whole = replace(self.closed, whole=True)  # laws are not expanded
        for row, a in zip(rows, self.algebraic, strict=True):
            closed = sp.expand(whole.value(a.residual))
            held = {str(v) for v in closed.free_symbols}
            # without an unknown but with states it is a hidden constraint, which the integrator
            # keeps; with neither it says nothing
            graph.add_edges_from((row, n) for n in names if n in held or held & self.states.keys())
        if len(nx.bipartite.maximum_matching(graph, rows)) < 2 * len(rows):
            raise self._singular(sorted(names))

    # -- what depends on what -----------------------------------------------------------------
    def _reads(self, name: str) -> Iterable[str]:
        if name in self.rate_reads:
            return self.rate_reads[name]
        r = self.made.found.get(name)
        if r is None:
            return ()
        known, rates = self.made.found, self.dependents
        return [
            s for s in r.sources if (s in known or s in rates) and not (r.implicit and s == name)
        ]

    def _reads_of_derivative(self, d: Dependent) -> tuple[str, ...]:
        """Signals that the derivative of a dependent store needs: the rates of what it reads."""
        seen: set[str] = set()
        ahead = [d.stored]
        needed: list[str] = []
        found = self.made.found
        while ahead:
            name = ahead.pop()
            if name in seen:
                continue
            seen.add(name)
            if name in self.states:
                needed.append(self.states[name].rate)
            if name in self.dependents:
                ahead.append(self.dependents[name].stored)
            if name in found:
                ahead.extend(found[name].sources)
        stores = self.stores
        needed += [stores[n] for n in seen if n in stores and n != d.stored and found[n].implicit]
        # the law of the store itself is differentiated too
        return tuple(dict.fromkeys([d.stored, *found[d.stored].sources, *needed]))

    # -- components ---------------------------------------------------------------------------
    def _component(self, part: list[str]) -> None:
        found = {n: self._relation(n, part) for n in part}
        rows = {n: r for n, r in found.items() if r is not None}
        # rates of unknowns that a derivative needs are relations of their own
        while more := [n for n in self.wanted if n not in rows and n not in self.ordered]:
            for rate in more:
                name, element = self.wanted[rate]
                rows[rate] = self._implicit_rate(self.unknown[name], name, rate, element)

        def reads(n: str) -> list[str]:
            r = rows[n]
            return [s for s in r.sources if s in rows and not (r.implicit and s == n)]

        for piece in components(rows, reads) if len(rows) > len(found) else [list(rows)]:
            if len(piece) == 1 and piece[0] not in reads(piece[0]):
                (r,) = (rows[n] for n in piece)
                if r.implicit:
                    self._implicit([r], tuple(piece))
                else:
                    self.ordered[r.target] = r
            elif piece:
                self._loop(piece, {n: rows[n] for n in piece})

    def _loop(self, part: list[str], rows: Mapping[str, Relation]) -> None:
        self.loops.append(tuple(part))
        inside = set(part)
        if all(self._is_linear(r, inside) for r in rows.values()):
            self._solve_linear(part, rows)
        else:
            self._tear(part, rows)

    def _relation(self, name: str, part: list[str]) -> Relation | None:
        if name in self.dependents:
            return self._derivative(self.dependents[name], set(part))
        return self.made.found.get(name)

    def _is_linear(self, r: Relation, inside: set[str]) -> bool:
        return not (r.implicit or any(s in inside for s in r.reads))

    def _preferred(self, name: str) -> int:
        """Tear at a derivative or a free choice: the loop is then named after an element."""
        if name in self.dependents or name in self.wanted:
            return 0
        if name in self.stores:
            return 3
        reason = self.made.found[name].reason
        return 1 if reason.startswith("R ") else 2

    # -- derivatives of dependent stores ------------------------------------------------------
    def _derivative(self, d: Dependent, inside: set[str]) -> Relation:
        r = self.unknown.get(d.stored, self.made.found[d.stored])
        if d.stored in inside:
            raise self._too_deep(d, "its own rate decides what it stores")
        if r.implicit:
            return self._implicit_rate(r, d.stored, d.rate, d.element)
        terms = self._total(self.closed(d.stored), d.element, skip=None)
        why = f"rate of {d.element}, dependent"
        if d in self.made.rates:
            why = f"rate read by {d.element}"
        return Relation(d.rate, terms, why, reads=self._signals_in(terms))

    def _implicit_rate(self, r: Relation, name: str, rate: str, element: str) -> Relation:
        """Rate of an unknown by differentiating its residual."""
        residual = self.closed.value(r)
        own = residual.diff(symbol(name))
        if own == 0:
            raise self._too_deep(
                next(d for d in self.dependents.values() if d.element == element),
                f"{name} does not show in its own equation",
            )
        terms = tuple((-c / own, s) for c, s in self._total(residual, element, skip=name))
        why = f"rate of {name}, differentiated"
        return Relation(rate, terms, why, reads=self._signals_in(terms))

    def _total(
        self, expression: sp.Expr, element: str, skip: str | None
    ) -> tuple[tuple[Any, str], ...]:
        """Terms of the total time derivative of a closed expression."""
        expression = sp.sympify(expression)

        def too_deep(why: str) -> DerivativeCausality:
            return self._too_deep(next(d for d in made if d.element == element), why)

        made, stores = [*self.made.dependents, *self.made.rates], self.stores
        if any(f.func.__name__.endswith("_deviation") for f in expression.atoms(_applied())):
            raise too_deep("a law with memory or a jump decides what it stores")
        terms: list[tuple[Any, str]] = []
        for v in sorted(expression.free_symbols, key=str):
            name = str(v)
            if name in self.parameters or name == skip:
                continue
            slope = expression.diff(v)
            if slope == 0:
                continue
            if name in self.states:
                terms.append((slope, self.states[name].rate))
            elif name in stores:
                terms.append((slope, stores[name]))
            elif name in self.unknown:
                terms.append((slope, _unknown_rate(name)))
                self.wanted.setdefault(_unknown_rate(name), (name, element))
            elif name == "time":
                terms.append((slope, "one"))
                if "one" not in self.made.inputs:
                    self.made.inputs.append("one")
            elif name in self.made.inputs or name in self.input_rates:
                rate = _rate_name(name)
                if name == "one":
                    continue
                if rate not in self.input_rates:
                    self.input_rates.append(rate)
                terms.append((slope, rate))
            else:
                raise too_deep(f"{name} of a nonlinear loop decides what it stores")
        return tuple(terms)

    def _too_deep(self, d: Dependent, why: str) -> DerivativeCausality:
        if isinstance(self.made.graph[d.element], Da):
            return DerivativeCausality(
                f"{self.name}: {d.element} reads the rate of a signal that jumps ({why}); put an "
                "inertia (at a 0-junction a compliance) where it reads"
            )
        return DerivativeCausality(
            f"{self.name}: {d.element} has derivative causality and cannot be solved ({why}); put "
            f"a small resistance in series with a C (in parallel with an I) {d.element} so that "
            "it can store freely"
        )

    # -- loops --------------------------------------------------------------------------------
    def _solve_linear(self, part: list[str], rows: Mapping[str, Relation]) -> None:
        """Solve a linear loop: in closed form if one or two signals cut it, else by elimination."""
        if len(part) > LONG or not self._solve_torn(part, rows):
            self._eliminate(part, rows)

    def _solve_torn(self, part: list[str], rows: Mapping[str, Relation]) -> bool:
        torn, order = tear(part, self._inside_reads(rows), self._preferred)
        if len(torn) > 2:
            return False
        forms: dict[str, dict[str, Any]] = {t: {t: sp.S.One} for t in torn}

        def form(r: Relation) -> dict[str, Any]:
            total: dict[str, Any] = {}
            for c, s in r.terms:
                for t, k in forms.get(s, {}).items():
                    total[t] = total.get(t, 0) + c * k
            return total

        for n in order:
            forms[n] = form(rows[n])
        matrix = []
        for t in torn:
            back = form(rows[t])
            matrix.append([sp.S(int(t == o)) - back.get(o, 0) for o in torn])
        if len(torn) > 1 and sum(sp.count_ops(c) for row in matrix for c in row) > SHORT:
            return False
        inverse = self._inverse(matrix, torn, part)
        rest = self._without(torn, order, rows)
        needed = {s for t in torn for _, s in rest[t].terms}
        for n in reversed(order):
            if _free(n) in needed:
                needed |= {s for _, s in rest[n].terms}
        for n in (*order, *torn):
            if _free(n) in needed or n in torn:
                self.ordered[_free(n)] = rest[n]
        self._put_inverse(torn, rows, inverse)
        for n in order:
            self.ordered[n] = rows[n]
        return True

    def _put_inverse(self, torn: list[str], rows: Mapping[str, Relation], inverse: Any) -> None:
        """Assign the torn signals as closed combinations of the free parts."""
        for i, t in enumerate(torn):
            terms = [(inverse[i][j], _free(o)) for j, o in enumerate(torn) if inverse[i][j] != 0]
            why = f"{rows[t].reason}; algebraic loop solved"
            self.ordered[t] = Relation(t, tuple(terms), why, reads=self._signals_in(terms))

    def _eliminate(self, part: list[str], rows: Mapping[str, Relation]) -> None:
        """Assign all signals of a loop by sparse elimination with named coefficients.

        A closed inverse grows exponentially with the loop; named intermediate values do not.
        """
        position = {n: i for i, n in enumerate(part)}
        matrix = []
        for n in part:
            r = rows[n]
            entries: dict[int, Any] = {position[n]: sp.S.One}
            for c, s in r.terms:
                if s in position:
                    entries[position[s]] = entries.get(position[s], sp.S.Zero) - c
            matrix.append(entries)
            outside = tuple((c, s) for c, s in r.terms if s not in position)
            self.ordered[_free(n)] = replace(
                r, target=_free(n), terms=outside, reason=f"{r.reason}, with the loop cut"
            )
        made = eliminate_named(
            matrix,
            [_free(n) for n in part],
            part,
            prefix=f"loop{len(self.loops)}",
            nominal=self._nominal(
                v for n in part for c, _ in rows[n].terms for v in getattr(c, "free_symbols", ())
            ),
        )
        if made is None:
            raise self._singular(part)
        for r in made:
            reads = tuple(dict.fromkeys((*r.reads, *self._signals_in(r.terms, r.expression))))
            reason = rows[r.target].reason if r.target in rows else "algebraic loop"
            self.ordered[r.target] = replace(
                r, reason=f"{reason}; algebraic loop solved", reads=reads
            )

    def _nominal(self, symbols: Iterable[sp.Symbol]) -> dict[str, float]:
        """Return declared values of the parameters among `symbols`."""
        names = {str(v) for v in symbols}
        return {n: self.parameters[n].value for n in names if n in self.parameters}

    def _signals_in(self, terms: Iterable[tuple[Any, str]], *more: Any) -> tuple[str, ...]:
        found = {
            str(v)
            for c in (*(c for c, _ in terms), *more)
            if isinstance(c, sp.Expr)
            for v in c.free_symbols
        }
        return tuple(sorted(n for n in found if n not in self.parameters))

    def _without(
        self, torn: list[str], order: list[str], rows: Mapping[str, Relation]
    ) -> dict[str, Relation]:
        """Relations of the loop with the torn signals at zero, under names of their own."""
        inside = {*torn, *order}
        dropped = set(torn)
        changed: dict[str, Relation] = {}
        empty: set[str] = set()
        for n in (*order, *torn):
            r = rows[n]
            terms = tuple(
                (c, _free(s) if s in inside else s)
                for c, s in r.terms
                if s not in dropped and s not in empty
            )
            changed[n] = replace(
                r, target=_free(n), terms=terms, reason=f"{r.reason}, with the loop cut"
            )
            if not terms and r.expression is None and r.law is None and n in order:
                empty.add(n)
        return changed

    def _inside_reads(self, rows: Mapping[str, Relation]) -> Any:
        return lambda n: [
            s for s in rows[n].sources if s in rows and not (rows[n].implicit and s == n)
        ]

    def _inverse(self, matrix: list[list[Any]], torn: list[str], part: list[str]) -> Any:
        if len(matrix) == 1:
            value = sp.cancel(sp.together(matrix[0][0])) if matrix[0][0] != 1 else sp.S.One
            if value == 0:
                raise self._singular(part)
            self._judge(value, part)
            return [[1 / value]]
        from sympy.polys.matrices import DomainMatrix
        from sympy.polys.matrices.exceptions import DMNonInvertibleMatrixError

        try:
            m = DomainMatrix.from_Matrix(sp.Matrix(matrix)).to_field()
            inverse = m.inv().to_Matrix()
            self._judge(m.domain.to_sympy(m.det()), part)
        except (DMNonInvertibleMatrixError, ZeroDivisionError):
            raise self._singular(part) from None
        return [[inverse[i, j] for j in range(len(torn))] for i in range(len(torn))]

    def _judge(self, determinant: sp.Expr, part: list[str]) -> None:
        """Refuse a loop that is singular at the declared values."""
        values = {
            symbol(n, positive=self.parameters[n].positive): (
                sp.Rational(str(v)) if v == v else sp.nan
            )
            for n, v in self._nominal(determinant.free_symbols).items()
        }
        if determinant.free_symbols - values.keys():
            return
        if determinant.xreplace(values) == 0:
            raise self._singular(part)

    def _singular(self, part: list[str]) -> AlgebraicLoop:
        reasons = {
            self.made.found[n].reason
            for n in part
            if n in self.made.found and not self.made.found[n].reason.startswith("sum")
        }
        through = ", ".join(sorted(reasons)) or "junctions only"
        return AlgebraicLoop(
            f"{self.name}: the algebraic loop through {through} (signals "
            f"{', '.join(sorted(part))}) is singular: its signals are not determined; put a "
            "resistance or a storage at one of its junctions, or remove a redundant bond"
        )

    def _tear(self, part: list[str], rows: Mapping[str, Relation]) -> None:
        implicit = [n for n, r in rows.items() if r.implicit]
        inside = {n: r for n, r in rows.items() if n not in implicit}

        def reads(n: str) -> list[str]:
            return [s for s in inside[n].sources if s in inside]

        torn: list[str] = []
        order: list[str] = []
        for piece in components([n for n in part if n in inside], reads):
            if len(piece) == 1 and piece[0] not in reads(piece[0]):
                order += piece
            else:
                more, rest = tear(piece, reads, self._preferred)
                torn += more
                order += rest
        known = set(torn) | set(implicit)
        # what was torn in one piece is known in all others: order the rest once more
        left = [n for n in part if n not in known]
        order = [
            n
            for piece in components(left, lambda n: [s for s in rows[n].sources if s in set(left)])
            for n in piece
        ]
        for n in order:
            self.ordered[n] = rows[n]
        unknown = [rows[n] for n in implicit]
        unknown += [replace(rows[t], terms=(*rows[t].terms, (-1, t)), implicit=True) for t in torn]
        self._implicit(unknown, tuple(part))

    def _implicit(self, relations: list[Relation], part: tuple[str, ...]) -> None:
        reasons = sorted(
            {
                self.made.found[n].reason
                for n in part
                if n in self.made.found and not self.made.found[n].reason.startswith("sum")
            }
        )
        for r in relations:
            self.unknown[r.target] = r
            self.algebraic.append(Algebraic(r.target, r, "loop of " + ", ".join(reasons)))


def _free(name: str) -> str:
    return f"free_{name}"


def _unknown_rate(name: str) -> str:
    return f"rate_of_{name}"


def _rate_name(name: str) -> str:
    if name.startswith("d_"):
        return f"d2_{name[2:]}"
    if name.startswith("d2_"):
        return f"d3_{name[3:]}"
    return f"d_{name}"


def _applied() -> Any:
    from sympy.core.function import AppliedUndef

    return AppliedUndef
