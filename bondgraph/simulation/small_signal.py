"""Small motions of a model about a rest: matrices, their derivatives by parameters, responses.

The rest moves with the parameters, and the derivatives count that: with ``F(v, p) = 0`` at the
rest, ``dM/dp + dM/dv dv/dp`` with ``dv/dp = -F_v^-1 F_p``, exact by CasADi.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
from scipy.linalg import matrix_balance

from bondgraph.equations.program import Program
from bondgraph.simulation.radau.recorder import Key
from bondgraph.simulation.radau.start import evaluated, least_correction, rests
from bondgraph.support.arrays import Array, ComplexArray


@dataclass(frozen=True, slots=True)
class SmallSignal:
    """``dx/dt = A x + B u``, ``y = C x + D u``, all counted from a rest; or a stack of them.

    Attributes
    ----------
    a, b, c, d : ndarray, shapes (..., n_x, n_x), (..., n_x, n_u), (..., n_y, n_x), (..., n_y, n_u)
        NaN where the model has no slope at its rest.
    """

    a: Array
    b: Array
    c: Array
    d: Array

    def eigenvalues(self) -> ComplexArray:
        """Return those of one model, 1/s, shape (n_x,); none where there is no slope."""
        if not self.a.size or not np.isfinite(self.a).all():
            return np.zeros(0, complex)
        # charges and momenta differ by many decades
        return np.asarray(np.linalg.eigvals(matrix_balance(self.a)[0]), complex)

    def response(self, s: ComplexArray, drive: ComplexArray) -> ComplexArray:
        """Return ``(C (s - A)^-1 B + D) drive``, shape (..., F, n_y, n_m).

        Parameters
        ----------
        s : ndarray, shape (F,)
            ``j omega``, rad/s; ``exp(j omega dt)`` where the matrices are those of a step.
        drive : ndarray, shape (F, n_u, n_m)
            The inputs for each of n_m commands of one, see `Dynamics.drive`.
        """
        x = self._states(s, drive)
        return np.asarray(self.c[..., None, :, :] @ x + self.d[..., None, :, :] @ drive)

    def response_slopes(
        self, slopes: Sequence[SmallSignal], s: ComplexArray, drive: ComplexArray
    ) -> ComplexArray:
        """Return the derivatives of the response of one model, shape (F, n_y, n_m, n).

        With ``X = (s - A)^-1 B``: ``dG = dC X + dD + C (s - A)^-1 (dA X + dB)``.
        """
        x = self._states(s, drive)
        across = SmallSignal(self.a.T, self.c.T, self.c, self.d)
        left = across._states(s, np.eye(self.c.shape[0], dtype=complex)[None])
        made = np.empty((s.size, self.c.shape[0], drive.shape[2], len(slopes)), complex)
        for i, t in enumerate(slopes):
            inner = left.transpose(0, 2, 1) @ (t.a @ x + t.b @ drive)
            made[..., i] = t.c @ x + t.d @ drive + inner
        return made

    def _states(self, s: ComplexArray, drive: ComplexArray) -> ComplexArray:
        resolvent = s[:, None, None] * np.eye(self.a.shape[-1]) - self.a[..., None, :, :]
        right = self.b[..., None, :, :] @ drive
        try:
            return np.asarray(np.linalg.solve(resolvent, right))
        except np.linalg.LinAlgError:  # one undamped model on a line: nudge all of them off it
            return np.asarray(np.linalg.solve(resolvent * (1.0 + 1e-9j), right))


def of_program(program: Program, p: Array, u: Array) -> SmallSignal:
    """Return models at parameters (..., n_p) about their rests under inputs `u`, shape (n_u,).

    Where there is no rest, the states stay at the start of the program.
    """
    each = np.atleast_2d(p)
    v, _ = _points(program, each, u)
    (block,) = map(_numbers, evaluated(_functions(Key(program))[0], v, u, each))
    wide, by_unknowns, unknowns, inner = _quarters(program, block)
    made = wide - by_unknowns @ np.linalg.inv(inner) @ unknowns
    return _cut(program, made.reshape(*p.shape[:-1], *made.shape[1:]))


def slopes_of_program(
    program: Program, p: Array, u: Array, wanted: Sequence[int]
) -> list[SmallSignal]:
    """Return the derivatives of one model by some parameters, how its rest moves counted in.

    A rest that is not unique moves by the smallest correction.
    """
    v, (resting,) = _points(program, p[None], u)
    found = evaluated(_functions(Key(program))[1], v, u, p[None])
    block, by_p, block_by_v, block_by_p = (_numbers(a[0]) for a in found)
    n, held = v.shape[1], 0 if resting else len(program.states)
    moved = np.zeros((n, len(wanted)))
    if n > held and np.isfinite(block).all():
        jacobian = np.tile(block[held:n, held:n], (len(wanted), 1, 1))
        moved[held:] = -least_correction(by_p[held:, list(wanted)].T, jacobian)[0].T
    _, by_unknowns, unknowns, inner = _quarters(program, block)
    left, right = by_unknowns @ np.linalg.inv(inner), np.linalg.inv(inner) @ unknowns
    slopes = []
    for column in (block_by_p[:, list(wanted)] + block_by_v @ moved).T:
        d = _quarters(program, column.reshape(block.shape, order="F"))
        slopes.append(_cut(program, d[0] - d[1] @ right - left @ d[2] + left @ d[3] @ right))
    return slopes


def _points(program: Program, p: Array, u: Array) -> tuple[Array, Array]:
    """Return states and unknowns (S, n_x + n_z) to linearise about, and which of them rest (S,)."""
    v = rests(program, u, p)
    resting = np.isfinite(v).all(axis=1)
    if not resting.all():
        v[~resting] = rests(program, u, p[~resting], held=len(program.states))
    return v, resting


def _numbers(found: Array) -> Array:
    """Return an array in which an endless slope is none; nothing computed with it warns."""
    return np.where(np.isfinite(found), found, np.nan)


def _quarters(program: Program, block: Array) -> tuple[Array, Array, Array, Array]:
    """Cut out the algebraic unknowns: (rest by rest, rest by them, them by rest, them by them)."""
    at = slice(len(program.states), len(program.states) + len(program.algebraic))
    rows = np.delete(block, at, axis=-2)
    return (
        np.delete(rows, at, axis=-1), rows[..., at],
        np.delete(block[..., at, :], at, axis=-1), block[..., at, at],
    )  # fmt: skip


def _cut(program: Program, block: Array) -> SmallSignal:
    n = len(program.states)
    upper, lower = block[..., :n, :], block[..., n:, :]
    return SmallSignal(upper[..., :n], upper[..., n:], lower[..., :n], lower[..., n:])


@lru_cache(maxsize=64)
def _functions(key: Key) -> tuple[ca.Function, ca.Function]:
    """Return ``(v, u, p) -> M`` and ``(v, u, p) -> M, dF/dp, dM/dv, dM/dp``.

    M holds the slopes of rates, residuals and readings by states, unknowns and inputs; its
    derivatives are those of the column-major M.
    """
    q = key.program
    n_x, n_z = len(q.states), len(q.algebraic)
    v, u = ca.SX.sym("v", n_x + n_z), ca.SX.sym("u", len(q.inputs))
    p = ca.SX.sym("p", len(q.parameters))
    arguments = (0.0, v[:n_x], v[n_x:], u, p, np.array(q.virgin, float), 0.0)
    rates, readings = q.rhs(*arguments)
    balance = ca.vertcat(rates, q.residual(*arguments))
    block = ca.densify(ca.jacobian(ca.vertcat(balance, readings), ca.vertcat(v, u)))
    parts = (ca.jacobian(balance, p), *(ca.jacobian(ca.vec(block), w) for w in (v, p)))
    return (
        ca.Function("block", [v, u, p], [block]),
        ca.Function("slopes", [v, u, p], [block, *(ca.densify(d) for d in parts)]),
    )
