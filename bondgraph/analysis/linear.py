"""Linear systems from exact equations: linearisation, descriptor form, transfer functions, poles.

Sizes: n_x states, n_z algebraic unknowns, n_u inputs (input rates follow the inputs), n_y outputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

from bondgraph.equations.decimals import spaced
from bondgraph.equations.elimination import rational
from bondgraph.equations.system import System
from bondgraph.graph.parameter import symbol
from bondgraph.support.errors import UnusableInput, require_known

LAPLACE = sp.Symbol("s")


@dataclass(frozen=True)
class Linearised:
    """``dx = A x + B u``, ``y = C x + D u`` about an operating point, symbolic in parameters.

    `inputs` end with the input rates, if the equations need them; names are kept throughout.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    a: sp.Matrix
    b: sp.Matrix
    c: sp.Matrix
    d: sp.Matrix

    def numbers(self, values: Mapping[str, float]) -> tuple[np.ndarray, ...]:
        """Return A, B, C, D as arrays at parameter `values`.

        Raises
        ------
        UnusableInput
            A parameter has no value.
        """
        return tuple(_numeric(m, values) for m in (self.a, self.b, self.c, self.d))

    def _repr_latex_(self) -> str:
        """Return the matrices for notebooks."""
        pairs = zip("ABCD", (self.a, self.b, self.c, self.d), strict=True)
        return "$$" + r",\quad ".join(f"{n} = {spaced(m)}" for n, m in pairs) + "$$"


@dataclass(frozen=True)
class Descriptor:
    """``E dx/dt = A x + B u``, ``y = C x + D u`` with x states, then algebraic unknowns."""

    names: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    e: sp.Matrix
    a: sp.Matrix
    b: sp.Matrix
    c: sp.Matrix
    d: sp.Matrix


def descriptor(model: System, at: Mapping[str, float] | None = None) -> Descriptor:
    """Return the semi-explicit descriptor form, linearised at `at` (see `linearise`)."""
    names = (*model.states, *(a.name for a in model.algebraic))
    inputs = (*model.inputs, *model.input_rates)
    right = sp.Matrix([*model.rates, *model.residuals])
    out = sp.Matrix(list(model.outputs)) if model.outputs else sp.zeros(0, 1)
    x, u = [symbol(n) for n in names], [symbol(n) for n in inputs]
    put = _point(model, at, [*names, *inputs], (*right, *out), [*x, *u])
    n_x, n = model.order, len(names)
    e = sp.zeros(n, n)
    for i in range(n_x):
        e[i, i] = 1
    parts = [
        _jacobian(right, x, put),
        _jacobian(right, u, put),
        _jacobian(out, x, put),
        _jacobian(out, u, put),
    ]
    return Descriptor(names, inputs, model.output_names, e, *parts)


def linearise(model: System, at: Mapping[str, float] | None = None) -> Linearised:
    """Linearise about an operating point; the algebraic unknowns are eliminated.

    Parameters
    ----------
    model : System
    at : mapping of str to float, optional
        Values of states, algebraic unknowns and inputs, 0 where not given (irrelevant where the
        equations are linear). Parameters stay symbols.

    Raises
    ------
    UnknownName
        `at` names something that is no state, unknown or input.
    UnusableInput
        The equations have no derivative there.
    """
    form = descriptor(model, at)
    n, m = model.order, len(form.names)
    a, b, c, d = form.a, form.b, form.c, form.d
    if m == n:
        return Linearised(form.names, form.inputs, form.outputs, a, b, c, d)
    inner = a[n:, n:]
    if inner.det() == 0:
        raise UnusableInput(
            f"{model.name}: the algebraic loop cannot be solved at this operating point; give "
            "another one in at="
        )
    solved = inner.inv()
    z_x, z_u = -solved * a[n:, :n], -solved * b[n:, :]
    return Linearised(
        form.names[:n],
        form.inputs,
        form.outputs,
        a[:n, :n] + a[:n, n:] * z_x,
        b[:n, :] + a[:n, n:] * z_u,
        c[:, :n] + c[:, n:] * z_x,
        d + c[:, n:] * z_u,
    )


def _point(
    model: System,
    at: Mapping[str, float] | None,
    names: Sequence[str],
    expressions: Sequence[sp.Expr],
    variables: Sequence[sp.Symbol],
) -> dict[sp.Symbol, sp.Expr]:
    given = dict(at or {})
    require_known("state or input", model.name, names, *given)
    put = {symbol(n): sp.sympify(float(given.get(n, 0.0))) for n in names}
    for e in expressions:
        named = sorted(str(f.func) for f in sp.sympify(e).atoms(sp.core.function.AppliedUndef))
        if named:
            raise UnusableInput(
                f"{model.name}: {named[0].removesuffix('_deviation')} has memory or a jump, so "
                "there is no symbolic linearisation; linearise the graph without its law"
            )
    return {**put, symbol("time"): sp.S.Zero, symbol("one"): sp.S.One}


def _jacobian(
    column: sp.Matrix, by: Sequence[sp.Symbol], put: Mapping[sp.Symbol, sp.Expr]
) -> sp.Matrix:
    rows = []
    for f in column:
        free = f.free_symbols
        rows.append([_entry(f, v, put) if v in free else sp.S.Zero for v in by])
    return sp.Matrix(len(rows), len(by), [e for row in rows for e in row])


def _entry(f: sp.Expr, v: sp.Symbol, put: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    slope = f.diff(v)
    if slope.free_symbols & put.keys():
        slope = slope.xreplace(dict(put))
        if slope.has(sp.nan, sp.zoo, sp.oo):
            raise UnusableInput(
                f"the equations have no derivative by {v} at this operating point; give another "
                "one in at="
            )
    return slope


def transfer_function(model: System, source: str, signal: str) -> sp.Expr:
    """Return the transfer function from an input to a signal, a rational function of ``s``.

    The coefficients are exact in the parameters; input rates count as ``s`` times the input.

    Parameters
    ----------
    source : str
        An input of the model.
    signal : str
        A sensor or any signal (``e_name``, ``f_name``, ``q_name``, ``p_name``).
    """
    require_known("input", model.name, model.inputs, source)
    readings = {n: s for n, s, _ in model.readings}
    target = model.signal(readings.get(signal, signal))
    linear = linearise(model)
    x, u = [symbol(n) for n in linear.states], [symbol(n) for n in linear.inputs]
    if model.algebraic:
        raise UnusableInput(
            f"{model.name}: a nonlinear loop stays implicit; take linearise(at=..) and its matrices"
        )
    put = {symbol(n): sp.S.Zero for n in (*linear.states, *linear.inputs)}
    c = _jacobian(sp.Matrix([target]), x, put)
    d = _jacobian(sp.Matrix([target]), u, put)
    weight = sp.Matrix([_order_of(n, source) for n in linear.inputs])
    b = linear.b * weight
    direct = (d * weight)[0]
    if not x:
        return sp.cancel(sp.together(direct))
    # Cramer's rule on one polynomial matrix: exact and without a symbolic inverse
    n = len(x)
    from sympy.polys.matrices import DomainMatrix

    m = LAPLACE * sp.eye(n) - linear.a
    both = DomainMatrix.from_Matrix(m.row_join(b)).to_field()
    answer = both[:, :n].lu_solve(both[:, n:]).to_Matrix()
    return sp.cancel(sp.together((c * answer)[0] + direct))


def _order_of(name: str, source: str) -> sp.Expr:
    if name == source:
        return sp.S.One
    for order, prefix in enumerate(("d_", "d2_", "d3_"), start=1):
        if name == prefix + source:
            return LAPLACE**order
    return sp.S.Zero


def zeros(model: System, source: str, signal: str) -> sp.Poly:
    """Return the numerator of a transfer function as a polynomial in ``s``; its roots are zeros."""
    numerator, _ = sp.fraction(transfer_function(model, source, signal))
    return sp.Poly(numerator, LAPLACE)


def sensitivities(model: System, parameters: Sequence[str] | None = None) -> dict[str, sp.Matrix]:
    """Return ``d(dx/dt)/dp`` in closed form for parameters by name, each of shape (n_x, 1).

    States and inputs stay as they are; algebraic unknowns z follow their residuals g(z, p) = 0, so
    ``-(d rate/d z)(d g/d z)^-1 d g/d p`` is part of it. Unknowns stay in the expressions.

    Raises
    ------
    UnknownName
        There is no such parameter.
    UnusableInput
        The residuals never determine the unknowns.
    """
    names = tuple(model.parameters) if parameters is None else tuple(parameters)
    require_known("parameter", model.name, model.parameters, *names)
    rates = sp.Matrix(list(model.rates)) if model.order else sp.zeros(0, 1)
    found = {n: rates.diff(model.parameters[n].symbol) for n in names}
    if not (model.algebraic and model.order):
        return found
    unknowns = [symbol(a.name) for a in model.algebraic]
    residuals = sp.Matrix(list(model.residuals))
    inner = residuals.jacobian(unknowns)
    if inner.det() == 0:
        raise UnusableInput(
            f"{model.name}: the algebraic loop does not determine its unknowns, so rates have no "
            "slopes by parameters; check the loop"
        )
    by_residual = rates.jacobian(unknowns) * inner.inv()
    return {
        n: own - by_residual * residuals.diff(model.parameters[n].symbol)
        for n, own in found.items()
    }


def eigenvalues(
    model: System, values: Mapping[str, float] | None = None, at: Mapping[str, float] | None = None
) -> np.ndarray:
    """Return the eigenvalues at parameter `values` (nominal where not given), shape (n_x,)."""
    linear = linearise(model, at)
    numbers = {n: float(v) for n, v in model.values(values).items()}
    a = _numeric(linear.a, numbers)
    if not a.size:
        return np.zeros(0, complex)
    from scipy.linalg import matrix_balance

    # charges and momenta differ by many decades: balance before the QR iteration
    balanced, _ = matrix_balance(a)
    return np.sort_complex(np.linalg.eigvals(balanced))


def _numeric(m: sp.Matrix, values: Mapping[str, float]) -> np.ndarray:
    put = {}
    for s in m.free_symbols:
        if str(s) not in values:
            raise UnusableInput(f"parameter {s} has no value; give one")
        put[s] = sp.Float(values[str(s)])
    return np.array(m.xreplace(put).tolist(), float).reshape(m.shape)


def linear_rates(
    model: System, values: Mapping[str, float] | None = None
) -> tuple[dict[str, Fraction], ...]:
    """Return ``dx/dt`` of a linear system with numbers for parameters, exact and sparse.

    One dictionary a state: coefficient by state, input or input rate. The arithmetic is rational
    (every float is taken as the exact number it is), so nothing is left of what cancels, and one
    pass over the ordered relations is enough.

    Raises
    ------
    UnusableInput
        The system is not linear, or a parameter has no finite value.
    """
    numbers = model.values(values)
    if model.algebraic or model.laws:
        why = ", ".join(u.element for u in model.laws) or model.algebraic[0].reason
        raise UnusableInput(
            f"{model.name} is not linear ({why}); take System.rates or linearise(at=..)"
        )
    exact = _Exact(numbers)
    forms: dict[str, dict[str, Fraction]] = {}
    for r in model.relations:
        fixed = [s for s in r.reads if s not in exact.named]
        if fixed:
            raise UnusableInput(
                f"{model.name} is not linear: {r.reason} multiplies or transforms {fixed[0]}; take "
                "System.rates or linearise(at=..)"
            )
        if not r.terms and r.expression is not None:
            value = exact(r.expression)
            exact.named[r.target] = value
            forms[r.target] = {"one": value} if value else {}
            continue
        if len(r.terms) == 1 and r.terms[0][0] == 1 and r.expression is None:
            s = r.terms[0][1]
            known = forms.get(s)
            forms[r.target] = {s: Fraction(1)} if known is None else known
            continue
        total = {} if r.expression is None else {"one": exact(r.expression)}
        for c, s in r.terms:
            k = Fraction(c) if isinstance(c, int) else exact(c)
            form = forms.get(s)
            if form is None:
                total[s] = total.get(s, Fraction(0)) + k
                continue
            for leaf, part in form.items():
                total[leaf] = total.get(leaf, Fraction(0)) + k * part
        forms[r.target] = {leaf: v for leaf, v in total.items() if v}
    return tuple(dict(forms.get(s.rate, {s.rate: Fraction(1)})) for s in model.stored)


class _Exact:
    """Rational value of coefficients, each computed once."""

    def __init__(self, numbers: Mapping[str, float]) -> None:
        self.numbers = numbers
        self.named: dict[str, Fraction] = {}
        self.known: dict[Any, Fraction] = {}

    def __call__(self, c: sp.Expr) -> Fraction:
        if c not in self.known:
            self.known[c] = rational(c, self._symbol)
        return self.known[c]

    def _symbol(self, name: str) -> Fraction:
        if name in self.named:
            return self.named[name]
        try:
            return Fraction(self.numbers[name])
        except (KeyError, ValueError, OverflowError):
            raise UnusableInput(f"parameter {name} has no finite value; give one") from None
