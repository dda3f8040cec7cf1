"""The integral of a law without memory: in closed form, or by quadrature over a record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from bondgraph.laws.law import Law
from bondgraph.laws.table import TableLaw
from bondgraph.support.errors import BondsightError
from bondgraph.support.ops import NUMPY, SYMPY, FloatArray

GRID = 4000
_ROUGH = (sp.Max, sp.Min, sp.Abs, sp.sign, sp.Piecewise, sp.Heaviside)


def law_energy(law: Law, s: sp.Symbol, parameters: Sequence[sp.Expr]) -> sp.Expr:
    """Return the integral of the deviation from 0 to `s`.

    Polynomials, elementary functions and straight-line tables give a closed form; anything else
    stays an `Integral`.
    """
    if isinstance(law, TableLaw) and law.join == "linear":
        return _straight(law, s, parameters)
    try:
        deviation = sp.sympify(law.deviation(SYMPY, s, (), tuple(parameters)))
    except (TypeError, AttributeError, BondsightError):
        deviation = sp.Function("deviation")(s)
    if not deviation.has(*_ROUGH, sp.core.function.AppliedUndef):
        numbers = {v: sp.Rational(repr(float(v))) for v in deviation.atoms(sp.Float)}
        deviation = deviation.xreplace(numbers)
        found = sp.integrate(sp.expand(deviation), s, manual=not deviation.is_polynomial(s))
        start = found.xreplace({s: sp.S.Zero})
        if not found.has(sp.Integral) and start.is_finite:
            return found - start
    t = sp.Dummy(str(s), real=True)
    return sp.Integral(deviation.xreplace({s: t}), (t, 0, s))


def _straight(law: TableLaw, s: sp.Symbol, parameters: Sequence[sp.Expr]) -> sp.Expr:
    """Integral of the clipped ramps a straight-line table is made of, less the reference."""
    values = tuple(parameters) if law.free else law.values
    x = law.knots

    def upto(v: Any) -> sp.Expr:
        total = values[0] * v
        for i in range(len(x) - 1):
            h, rise = x[i + 1] - x[i], values[i + 1] - values[i]
            above = [sp.Max(v - k, 0) ** 2 / 2 for k in (x[i], x[i + 1])]
            total += rise / h * (above[0] - above[1])
        if not law.flat:
            first = (values[1] - values[0]) / (x[1] - x[0])
            last = (values[-1] - values[-2]) / (x[-1] - x[-2])
            total += last * sp.Max(v - x[-1], 0) ** 2 / 2 + first * sp.Max(x[0] - v, 0) ** 2 / 2
        return total

    return upto(s) - upto(sp.S.Zero) - law.reference * s**2 / 2


def law_energy_record(law: Law, s: FloatArray, parameters: Sequence[float]) -> FloatArray:
    """Return the integral of the deviation from 0 to every sample of `s`, shape (N,).

    Simpson's rule on a grid over the range of `s` (knots of a table included), the cubic of Hermite
    between its points: fourth order where the law is smooth.

    Parameters
    ----------
    s : ndarray, shape (N,)
        Argument of the law.
    parameters : sequence of float
    """
    low, high = min(0.0, float(s.min())), max(0.0, float(s.max()))
    if low == high:
        return np.zeros_like(s)
    knots = np.array([k for k in getattr(law, "knots", ()) if low < k < high])
    nodes = np.unique(np.concatenate([np.linspace(low, high, GRID + 1), knots, [0.0]]))

    def at(v: FloatArray) -> FloatArray:
        return np.broadcast_to(law.deviation(NUMPY, v, (), tuple(parameters)), v.shape)

    w, middle = at(nodes), at(0.5 * (nodes[1:] + nodes[:-1]))
    h = np.diff(nodes)
    upto = np.concatenate([[0.0], np.cumsum(h * (w[:-1] + 4.0 * middle + w[1:]) / 6.0)])
    upto -= upto[np.searchsorted(nodes, 0.0)]
    i = np.clip(np.searchsorted(nodes, s, side="right") - 1, 0, h.size - 1)
    t, step = (s - nodes[i]) / h[i], h[i]
    rise = upto[i + 1] - upto[i]
    bend = step * (w[i] + w[i + 1]) - 2.0 * rise
    turn = 3.0 * rise - step * (2.0 * w[i] + w[i + 1])
    energy: FloatArray = upto[i] + t * (step * w[i] + t * (turn + t * bend))
    return energy
