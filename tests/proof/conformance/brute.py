"""All equations of all bonds at once, as a judge that knows no causality and eliminates nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg as sla
import sympy as sp
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray as Floats
from bondgraph.support.errors import UnusableInput
from tests.proof.conformance.case import STORES, Case, Part
from tests.proof.conformance.numbers import evaluate

_STEPS = 50
_ENOUGH = 1e-13


def mismatch(case: Case, point: Mapping[str, float]) -> float:
    """Return how far a point is from satisfying every bond equation of the case.

    Parameters
    ----------
    case : Case
    point : dict of str to float
        States ``q_x, p_x``, their rates ``dq_x, dp_x``, inputs ``u_x`` and all parameters.

    Returns
    -------
    float
        Norm of the equations over the norm of the largest of their terms, at the efforts and flows
        that satisfy them best: near the rounding error if such efforts and flows exist.
    """
    rows = _rows(case, point)
    matrix, right = rows.linear(case, point)
    w: Floats = np.linalg.lstsq(matrix, right, rcond=None)[0].astype(np.float64)
    best = math.inf
    for _ in range(_STEPS):
        residual, jacobian, scale = matrix @ w - right, matrix, np.abs(matrix) @ np.abs(w)
        for r in rows.curved:
            value, slope, size = r.at(w, point)
            residual, jacobian = np.append(residual, value), np.vstack([jacobian, slope])
            scale = np.append(scale, size)
        scale = np.maximum(scale, np.append(np.abs(right), np.zeros(len(scale) - len(right))))
        error = float(np.linalg.norm(residual) / max(float(np.max(scale, initial=0.0)), 1e-9))
        if not math.isfinite(error):
            return math.inf
        best = min(best, error)
        if error < _ENOUGH or not rows.curved:
            break
        w = w - np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    return best


def transfer(case: Case, values: Mapping[str, float], source: str, output: str, s: complex) -> Any:
    """Return a transfer function at one complex frequency, from the bond equations as they stand.

    Parameters
    ----------
    case : Case
        Linear.
    values : dict
        All parameters.
    source, output : str
        Input element; ``e:<one-port>`` or ``f:<one-port>``.
    s : complex
        Frequency, 1/s.
    """
    mass, stiff, _, inputs = _pencil(case, values)
    right = -inputs[:, case.inputs.index(source)]
    z, *_ = np.linalg.lstsq(s * mass + stiff, right, rcond=None)
    kind, name = output.split(":")
    (b,) = case.bonds_of(name)
    return z[2 * b] if kind == "e" else case.arrow(name) * z[2 * b + 1]


def eigenvalues(case: Case, values: Mapping[str, float]) -> NDArray[np.complex128]:
    """Return the finite eigenvalues of the bond equations of a linear case."""
    mass, stiff, n, _ = _pencil(case, values)
    if mass.shape[0] != mass.shape[1] or not n:
        raise UnusableInput(f"{case.identity}: the bond equations are not a square pencil")
    a, b = sla.eigvals(-stiff, mass, homogeneous_eigvals=True)
    finite = np.abs(b) > 1e-9 * np.abs(a)
    return np.asarray(a[finite] / b[finite], dtype=np.complex128)


@dataclass
class _Curved:
    """A nonlinear law of two bond variables: ``expression(argument..) - output = 0``."""

    expression: sp.Expr
    arguments: dict[str, tuple[int, float]]
    output: tuple[int, float]

    def at(self, w: Floats, point: Mapping[str, float]) -> tuple[float, Floats, float]:
        """Value, gradient and size of the terms at bond variables `w`."""
        here = dict(point) | {n: sign * float(w[i]) for n, (i, sign) in self.arguments.items()}
        i_out, s_out = self.output
        value = float(evaluate(self.expression, here).real)
        slope = np.zeros(len(w))
        for n, (i, sign) in self.arguments.items():
            slope[i] += sign * float(evaluate(self.expression.diff(sp.Symbol(n)), here).real)
        slope[i_out] -= s_out
        return value - s_out * float(w[i_out]), slope, abs(value)


@dataclass
class _Rows:
    """Linear rows ``sum coefficient w + sum named terms = 0`` and nonlinear laws."""

    bonds: int
    rows: list[tuple[dict[int, float], dict[str, float], float]] = field(default_factory=list)
    curved: list[_Curved] = field(default_factory=list)

    def add(
        self, w: dict[int, float], named: dict[str, float] | None = None, constant: float = 0.0
    ) -> None:
        self.rows.append((w, named or {}, constant))

    def linear(self, case: Case, point: Mapping[str, float]) -> tuple[Floats, Floats]:
        matrix, right = np.zeros((len(self.rows), 2 * self.bonds)), np.zeros(len(self.rows))
        for k, (w, named, constant) in enumerate(self.rows):
            for i, c in w.items():
                matrix[k, i] += c
            right[k] = -constant - sum(c * point[n] for n, c in named.items())
        return matrix, right


def _arrow(case: Case, name: str, b: int) -> float:
    """+1 if the half arrow of a store or resistor points into it, -1 if out of it."""
    return 1.0 if case.bonds[b][1] == name else -1.0


def _rows(case: Case, point: Mapping[str, float]) -> _Rows:
    rows = _Rows(len(case.bonds))
    for p in case.parts:
        if p.type in ("0", "1"):
            _junction(case, p, rows)
        elif p.type in ("TF", "GY", "RE"):
            _two_port(case, p, rows, point)
        elif p.type in STORES:
            _store(case, p, rows, point)
        else:
            _one_port(case, p, rows, point)
    return rows


def _junction(case: Case, p: Part, rows: _Rows) -> None:
    bonds = case.bonds_of(p.name)
    same, summed = (0, 1) if p.type == "0" else (1, 0)
    for b in bonds[1:]:
        rows.add({2 * bonds[0] + same: 1.0, 2 * b + same: -1.0})
    rows.add({2 * b + summed: 1.0 if case.bonds[b][1] == p.name else -1.0 for b in bonds})


def _two_port(case: Case, p: Part, rows: _Rows, point: Mapping[str, float]) -> None:
    (i,) = (b for b in case.bonds_of(p.name) if case.bonds[b][1] == p.name)
    (o,) = (b for b in case.bonds_of(p.name) if case.bonds[b][0] == p.name)
    n = float(evaluate(p.value, point).real)
    if p.type == "TF":
        rows.add({2 * i: 1.0, 2 * o: -n})
        rows.add({2 * o + 1: 1.0, 2 * i + 1: -n})
    elif p.type == "GY":
        rows.add({2 * i: 1.0, 2 * o + 1: -n})
        rows.add({2 * o: 1.0, 2 * i + 1: -n})
    else:
        rows.add({2 * i + 1: 1.0, 2 * o + 1: -1.0})
        a, b = sp.symbols("_a _b")
        law = p.value * (sp.exp(a) - sp.exp(b))
        arguments = {"_a": (2 * i, 1.0), "_b": (2 * o, 1.0)}
        rows.curved.append(_Curved(law, arguments, (2 * i + 1, 1.0)))


def _store(case: Case, p: Part, rows: _Rows, point: Mapping[str, float]) -> None:
    """Port flow = dq and effort = law (C, CF); effort = dp and port flow = p/I (I)."""
    states = [s for s, (name, _) in case.stores.items() if name == p.name]
    for port, (b, state) in enumerate(zip(case.bonds_of(p.name), states, strict=True)):
        arrow, linear = _arrow(case, p.name, b), p.law is None and p.energy is None
        output, rate = (2 * b, 2 * b + 1) if STORES[p.type] == "q" else (2 * b + 1, 2 * b)
        signs = {2 * b: 1.0, 2 * b + 1: arrow}
        rows.add({rate: signs[rate]}, {f"d{state}": -1.0})
        if linear:
            slope = 1.0 / float(evaluate(p.value, point).real)
            rows.add({output: signs[output]}, {state: -slope})
            continue
        if p.energy is not None:
            law = p.energy.diff(sp.Symbol(f"q{port + 1}"))
            own = {f"q{i + 1}": point.get(s, math.nan) for i, s in enumerate(states)}
        else:
            law, own = p.law, {"q": point.get(state, math.nan)}
        value = float(evaluate(law, {**point, **own}).real)
        rows.add({output: signs[output]}, None, -value)


def _one_port(case: Case, p: Part, rows: _Rows, point: Mapping[str, float]) -> None:
    (b,) = case.bonds_of(p.name)
    if p.type in ("Se", "Sf"):
        own = 2 * b if p.type == "Se" else 2 * b + 1
        if p.is_input:
            rows.add({own: 1.0}, {f"u_{p.name}": -1.0})
        else:
            rows.add({own: 1.0}, None, -float(evaluate(p.value, point).real))
    elif p.type == "MSe":
        gain = float(evaluate(p.value, point).real)
        rows.add({2 * b: 1.0, 2 * case.bond_between(p.of): -gain})
    elif p.law is None:
        r = float(evaluate(p.value, point).real)
        rows.add({2 * b: 1.0, 2 * b + 1: -r * _arrow(case, p.name, b)})
    else:
        argument = {"f": (2 * b + 1, _arrow(case, p.name, b))}
        rows.curved.append(_Curved(p.law, argument, (2 * b, 1.0)))


def _pencil(case: Case, values: Mapping[str, float]) -> tuple[Floats, Floats, int, Floats]:
    """``mass dz + stiff z + inputs u = 0`` in the bond variables and the states."""
    if any(p.law is not None or p.energy is not None or p.type == "RE" for p in case.parts):
        raise UnusableInput(f"{case.identity} is not linear; no transfer functions")
    rows = _rows(case, values)
    states, n = list(case.stores), 2 * rows.bonds
    mass = np.zeros((len(rows.rows), n + len(states)))
    stiff, inputs = np.zeros_like(mass), np.zeros((len(rows.rows), len(case.inputs)))
    for k, (w, named, _) in enumerate(rows.rows):
        for i, c in w.items():
            stiff[k, i] += c
        for name, c in named.items():
            if name.startswith("u_"):
                inputs[k, case.inputs.index(name[2:])] += c
            elif name in states:
                stiff[k, n + states.index(name)] += c
            else:
                mass[k, n + states.index(name[1:])] += c
    return mass, stiff, len(states), inputs
