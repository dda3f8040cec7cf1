"""What a tool says about a case, in the names of the case, and points of its solutions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from tests.proof.conformance.case import Case
from tests.proof.conformance.numbers import evaluate, random_values

_STEPS = 60
_STARTS = (1.0, 2.5, 0.3)


class NoPoint(Exception):
    """The answer has no solution at the numbers drawn."""


@dataclass(frozen=True)
class Answer:
    """Equations of a tool: symbols are states, ``u_<input>``, ``du_<input>`` and parameters.

    Attributes
    ----------
    rates : dict of str to sympy.Expr
        Independent state (``q_c1``) -> its rate.
    dependent : dict of str to sympy.Expr
        State that follows from the others -> its value.
    implicit : dict of str to sympy.Expr
        Unknown that only a numerical solution gives -> residual, zero at the solution.
    order : int
        Number of independent states the tool reports.
    besides : tuple of sympy.Expr
        Further relations (zero) that the tool states.
    fixed : dict of str to float
        Numbers that the tool was given for parameters (others are still symbols).
    derivative : frozenset of str or None
        Elements in derivative causality; None if the tool shows no causality.
    alternatives : frozenset of frozenset of str or None
        All smallest such sets; None if not offered.
    loops : int or None
        Free causal choices; None if not shown.
    transfer : callable or None
        ``transfer(input, output)`` -> expression in ``s``; None if not offered.
    eigenvalues : callable or None
        ``eigenvalues(values)`` -> array; None if not offered.
    """

    rates: Mapping[str, sp.Expr]
    dependent: Mapping[str, sp.Expr]
    order: int
    implicit: Mapping[str, sp.Expr] = field(default_factory=dict)
    besides: tuple[sp.Expr, ...] = ()
    fixed: Mapping[str, float] = field(default_factory=dict)
    derivative: frozenset[str] | None = None
    alternatives: frozenset[frozenset[str]] | None = None
    loops: int | None = None
    transfer: Callable[[str, str], sp.Expr] | None = None
    eigenvalues: Callable[[Mapping[str, float]], NDArray[np.complex128]] | None = None

    def expressions(self) -> Iterable[sp.Expr]:
        """Every expression of the answer."""
        yield from self.rates.values()
        yield from self.dependent.values()
        yield from self.implicit.values()
        yield from self.besides

    def undefined(self, case: Case) -> tuple[str, ...]:
        """Names in the equations that are neither state, input, its rate nor parameter."""
        inputs = [f"{d}u_{n}" for n in case.inputs for d in ("", "d", "dd")]
        rates = (f"d{s}" for s in case.stores)
        known = {*self.rates, *self.implicit, *inputs, *case.parameters, *rates}
        found = {str(s) for e in self.expressions() for s in e.free_symbols}
        return tuple(sorted(found - known))

    def solution(self, case: Case, random: np.random.Generator) -> dict[str, float]:
        """Draw a point of a solution: all states and their rates, inputs, parameters.

        Raises
        ------
        NoPoint
            A value is not finite, or the implicit unknowns have no solution there.
        """
        names = [f"{d}u_{n}" for n in case.inputs for d in ("", "d", "dd")]
        point = random_values([*case.parameters, *names, *self.rates], random)
        point.update(self.fixed)
        point.update(self._solved(point))
        for name, e in self.dependent.items():
            point[name] = _real(e, point, name)
        for name, e in self.rates.items():
            point[f"d{name}"] = _real(e, point, f"the rate of {name}")
        point.update(self._following(point))
        return point

    def _solved(self, point: Mapping[str, float]) -> dict[str, float]:
        """Newton's method on the implicit unknowns, from a few starts."""
        names = list(self.implicit)
        slopes = self._slopes()
        for start in _STARTS if names else ():
            z = np.full(len(names), start)
            for _ in range(_STEPS):
                here = {**point, **dict(zip(names, z.tolist(), strict=True))}
                g = np.array([evaluate(e, here) for e in self.implicit.values()])
                jacobian = np.array([[evaluate(d, here) for d in row] for row in slopes])
                if not (np.isfinite(g).all() and np.isfinite(jacobian).all()):
                    break
                if np.max(np.abs(g.imag)) == 0.0 and np.max(np.abs(g)) < 1e-13:
                    return dict(zip(names, z.tolist(), strict=True))
                try:
                    step = np.linalg.solve(jacobian, g).real
                except np.linalg.LinAlgError:
                    break
                while np.any((z > 0) & (z - step <= 0)) and start > 0 and np.max(abs(step)) > 1e-9:
                    step = step / 2  # stay where logarithms exist
                z = z - step
                if np.max(np.abs(step)) < 1e-15 * np.max(np.abs(z)):
                    return dict(zip(names, z.tolist(), strict=True))
        if names:
            raise NoPoint(f"no solution for {', '.join(names)}")
        return {}

    def _slopes(self) -> list[list[sp.Expr]]:
        symbols = [sp.Symbol(n) for n in self.implicit]
        return [[e.diff(s) for s in symbols] for e in self.implicit.values()]

    def _following(self, point: dict[str, float]) -> dict[str, float]:
        """Rates of the dependent states, by the chain rule."""
        moving = dict(point)
        names = list(self.implicit)
        if names:
            right = [-_along(e, moving, exclude=names) for e in self.implicit.values()]
            slopes = [[evaluate(d, moving).real for d in row] for row in self._slopes()]
            rates = np.linalg.solve(np.array(slopes), np.array(right))
            moving.update({f"d{n}": float(v) for n, v in zip(names, rates, strict=True)})
        return {f"d{n}": _along(e, moving) for n, e in self.dependent.items()}


def _along(e: sp.Expr, point: Mapping[str, float], exclude: Iterable[str] = ()) -> float:
    """Differentiate an expression along the solution."""
    left_out = set(exclude)
    total = 0.0
    for s in e.free_symbols:
        if f"d{s}" in point and str(s) not in left_out:
            total += evaluate(e.diff(s), point).real * point[f"d{s}"]
    return total


def _real(e: sp.Expr, point: Mapping[str, float], what: str) -> float:
    value = evaluate(e, point)
    if not np.isfinite(value) or abs(value.imag) > 1e-9 * max(1.0, abs(value)):
        raise NoPoint(f"{what} is {value:.3g} at random numbers")
    return float(value.real)
