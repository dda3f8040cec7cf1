"""One redundancy relation: a polynomial in ``s = d/dt`` for every input and reading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from bondgraph.analysis.exact_algebra import Row
from bondgraph.analysis.linear import LAPLACE
from bondgraph.analysis.residual_space import ResidualSpace
from bondgraph.equations.decimals import spaced
from bondgraph.graph.parameter import symbol
from bondgraph.support.errors import UnusableInput, require_known


@dataclass(frozen=True)
class RedundancyRelation:
    """``0 = sum(coefficient(s) * known) - sum(coefficient(s) * deviation of a law)``.

    Attributes
    ----------
    name : str
        Sensor whose residual it is.
    known : dict of str to sympy.Expr
        Inputs and readings with their coefficients, polynomials in ``s``.
    deviations : dict of str to sympy.Expr
        Elements with a nonlinear law, and how its deviation enters.
    touched : frozenset of str
        Elements, sources and sensors whose faults break the relation.
    parameters : tuple of str
        Parameters whose change breaks it.
    """

    name: str
    known: Mapping[str, sp.Expr]
    deviations: Mapping[str, sp.Expr]
    touched: frozenset[str]
    parameters: tuple[str, ...]

    @property
    def order(self) -> int:
        """The highest derivative of an input or a reading."""
        return max((_degree(c) for c in self.known.values()), default=0)

    @property
    def orders(self) -> dict[str, int]:
        """The highest derivative of each input and reading."""
        return {n: _degree(c) for n, c in self.known.items()}

    @property
    def expression(self) -> sp.Expr:
        """The residual in Laplace transforms; the symbols bear the names of the signals."""
        parts = [c * symbol(n) for n, c in self.known.items()]
        parts += [-c * symbol(f"{n}_deviation") for n, c in self.deviations.items()]
        return sp.Add(*parts)

    def laplace(
        self, at: complex, known: Mapping[str, complex], values: Mapping[str, float]
    ) -> Any:
        """Return the residual at one complex frequency.

        Parameters
        ----------
        at : complex
            ``s``, rad/s.
        known : mapping of str to complex
            Transforms of inputs and readings.
        values : mapping of str to float
            Parameters.
        """
        total = 0j
        for n, c in self.known.items():
            total += complex(_number(c, {**_put(c, values), LAPLACE: at})) * _of(known, n, self)
        return total

    def residual(
        self, derivatives: Mapping[str, Sequence[np.ndarray]], values: Mapping[str, float]
    ) -> np.ndarray:
        """Return the residual along a motion, shape (N,).

        Parameters
        ----------
        derivatives : mapping of str to sequence of ndarray, each of shape (N,)
            For every input and reading its value, first derivative, and so on; for an element with
            a nonlinear law ``NAME_deviation`` likewise (0 where not given).
        values : mapping of str to float
            Parameters.

        Raises
        ------
        UnusableInput
            A derivative that the relation needs is missing.
        """
        total = np.zeros(1)
        parts = [(n, c) for n, c in self.known.items()]
        parts += [
            (f"{n}_deviation", -c)
            for n, c in self.deviations.items()
            if f"{n}_deviation" in derivatives
        ]
        for n, c in parts:
            given = _of(derivatives, n, self)
            for order, k in _powers(c):
                if order >= len(given):
                    raise UnusableInput(
                        f"relation {self.name} needs derivative {order} of {n}, {len(given) - 1} "
                        "given; differentiate the record further"
                    )
                total = total + float(_number(k, _put(k, values))) * np.asarray(given[order])
        return total

    def __str__(self) -> str:
        """Text with ``d_y`` for a derivative and ``d2_y`` for a second one."""
        parts = [(n, c) for n, c in self.known.items()]
        parts += [(f"{n}_deviation", -c) for n, c in self.deviations.items()]
        terms = [
            k * symbol(n if not order else f"d_{n}" if order == 1 else f"d{order}_{n}")
            for n, c in parts
            for order, k in _powers(c)
        ]
        return f"0 = {sp.Add(*terms)}"

    def _repr_latex_(self) -> str:
        """Return the relation for notebooks."""
        return f"$0 = {spaced(self.expression)}$"


def relation(space: ResidualSpace, multiplier: Row, name: str) -> RedundancyRelation:
    """Return a combination of equations as a relation, denominators cleared."""
    whole = _cleared(multiplier)
    q = space.diagnostic.equations
    known = {n: _expression(v) for n, v in space.known(whole).items()}
    if "one" in known:  # a constant has no rate
        known["one"] = known["one"].xreplace({LAPLACE: sp.S.Zero})
    known = {n: c for n, c in known.items() if c != 0}
    order = [n for n in (*q.inputs, *q.sensors) if n in known]
    deviations = {}
    for i, m in whole.items():
        row = q.equations[i]
        if row.argument:
            deviations[row.element] = _expression(m * space.coefficient(row.lag))
    touched = frozenset(e for e in q.owners if any(i in whole for i in q.rows_of(e)))
    ordered = {n: known[n] for n in order}
    return RedundancyRelation(name, ordered, deviations, touched, _parameters(ordered, deviations))


def _parameters(known: Mapping[str, sp.Expr], deviations: Mapping[str, sp.Expr]) -> tuple[str, ...]:
    """Parameters that change the ratio of two coefficients, not only their common size."""
    values = [k for c in (*known.values(), *deviations.values()) for _, k in _powers(c)]
    found = set()
    for p in sorted({v for k in values for v in k.free_symbols}, key=str):
        slopes = [k.diff(p) for k in values]
        first = values[0]
        changes = (
            sp.cancel(d * first - slopes[0] * k) for d, k in zip(slopes, values, strict=True)
        )
        if any(c != 0 for c in changes):
            found.add(str(p))
    return tuple(sorted(found))


def _cleared(multiplier: Row) -> Row:
    """Multiply by the least polynomial in ``s`` that leaves no denominator with ``s``."""
    sample = next(iter(multiplier.values()))
    ring_field = getattr(sample, "field", None)
    if ring_field is None or LAPLACE not in ring_field.symbols:
        return multiplier
    ring = ring_field.ring
    at = list(ring.symbols).index(LAPLACE)
    under, over = ring.one, ring.zero
    for v in multiplier.values():
        part = v.denom.exquo(_content(v.denom, at))
        under = under.lcm(part)
    scaled = {i: v * ring_field.new(under) for i, v in multiplier.items()}
    for v in scaled.values():
        over = over.gcd(v.numer)
    common = over.exquo(_content(over, at))
    return {i: v / ring_field.new(common) for i, v in scaled.items()}


def _content(p: Any, at: int) -> Any:
    """Return the greatest common divisor of the coefficients of a polynomial in one generator."""
    total = p.ring.zero
    for v in _by_power(p, at).values():
        total = total.gcd(v)
    return total


def _by_power(p: Any, at: int) -> dict[int, Any]:
    """Return the coefficients of a polynomial in one generator."""
    found: dict[int, Any] = {}
    for monomial, c in p.terms():
        rest = list(monomial)
        power, rest[at] = rest[at], 0
        found[power] = found.get(power, p.ring.zero) + p.ring.term_new(tuple(rest), c)
    return found


def _expression(value: Any) -> sp.Expr:
    """Return a field element as a polynomial in ``s`` with cancelled coefficients."""
    ring_field = getattr(value, "field", None)
    if ring_field is None:
        return sp.sympify(value)
    if LAPLACE not in ring_field.symbols:
        return value.as_expr()
    at = list(ring_field.symbols).index(LAPLACE)
    powers = sorted(_by_power(value.numer, at).items())
    under = ring_field.new(value.denom)
    return sp.Add(*(LAPLACE**k * (ring_field.new(p) / under).as_expr() for k, p in powers))


def _powers(c: sp.Expr) -> list[tuple[int, sp.Expr]]:
    """Powers of ``s`` with their coefficients."""
    found = sp.collect(sp.expand(c), LAPLACE, evaluate=False)
    return sorted((_degree(power), sp.cancel(k)) for power, k in found.items())


def _degree(c: sp.Expr) -> int:
    return int(sp.degree(c, LAPLACE)) if c.has(LAPLACE) else 0


def _put(c: sp.Expr, values: Mapping[str, float]) -> dict[sp.Symbol, Any]:
    free = [v for v in c.free_symbols if v != LAPLACE]
    for v in free:
        if str(v) not in values:
            raise UnusableInput(f"parameter {v} has no value; give one")
    return {v: values[str(v)] for v in free}


def _number(c: sp.Expr, put: Mapping[sp.Symbol, Any]) -> Any:
    return c.xreplace({v: sp.sympify(x) for v, x in put.items()}).evalf()


def _of(given: Mapping[str, Any], name: str, inside: RedundancyRelation) -> Any:
    require_known("signal", f"what relation {inside.name} was given", given, name)
    return given[name]
