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
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.radau.recorder import Key
from bondgraph.simulation.radau.start import least_correction, rests
from bondgraph.support.arrays import Array, ComplexArray

__all__ = ["SmallSignal", "of_compiled", "of_program", "slopes_of_compiled", "slopes_of_program"]


@dataclass(frozen=True, slots=True)
class SmallSignal:
    """``dx/dt = A x + B u``, ``y = C x + D u``, all counted from a rest; or S of them.

    Attributes
    ----------
    a, b, c, d : ndarray, shapes (..., n_x, n_x), (..., n_x, n_u), (..., n_y, n_x), (..., n_y, n_u)
        NaN where the model has no slope at its rest.
    """

    a: Array
    b: Array
    c: Array
    d: Array

    @property
    def first(self) -> SmallSignal:
        """The first of S models."""
        return SmallSignal(self.a[0], self.b[0], self.c[0], self.d[0])

    def eigenvalues(self) -> ComplexArray:
        """Return those of one model, 1/s, shape (n_x,); none where there is no slope."""
        if not self.a.size or not np.isfinite(self.a).all():
            return np.zeros(0, complex)
        # charges and momenta differ by many decades
        return np.asarray(np.linalg.eigvals(matrix_balance(self.a)[0]), complex)

    def response(self, omega: Array, drive: ComplexArray) -> ComplexArray:
        """Return ``(C (s - A)^-1 B + D) drive``, shape (..., F, n_y, n_m).

        Parameters
        ----------
        omega : ndarray, shape (F,), rad/s
        drive : ndarray, shape (F, n_u, n_m)
            The inputs for each of n_m commands of one, see `Engine.drive`.
        """
        x = self._states(omega, drive)
        return np.asarray(self.c[..., None, :, :] @ x + self.d[..., None, :, :] @ drive)

    def response_slopes(
        self, slopes: Sequence[SmallSignal], omega: Array, drive: ComplexArray
    ) -> ComplexArray:
        """Return the derivatives of the response of one model, shape (F, n_y, n_m, n).

        With ``X = (s - A)^-1 B``: ``dG = dC X + dD + C (s - A)^-1 (dA X + dB)``.
        """
        x = self._states(omega, drive)
        wide = np.broadcast_to(self.c.T.astype(complex), (omega.size, *self.c.T.shape))
        left = np.linalg.solve(self._resolvent(omega).transpose(0, 2, 1), wide).transpose(0, 2, 1)
        made = np.empty((omega.size, self.c.shape[0], drive.shape[2], len(slopes)), complex)
        for i, t in enumerate(slopes):
            made[..., i] = t.c @ x + t.d @ drive + left @ (t.a @ x + t.b @ drive)
        return made

    def _resolvent(self, omega: Array) -> ComplexArray:
        eye = np.eye(self.a.shape[-1])
        return np.asarray(1j * omega[:, None, None] * eye - self.a[..., None, :, :], complex)

    def _states(self, omega: Array, drive: ComplexArray) -> ComplexArray:
        resolvent, right = self._resolvent(omega), self.b[..., None, :, :] @ drive
        try:
            return np.asarray(np.linalg.solve(resolvent, right))
        except np.linalg.LinAlgError:  # one undamped model on a line: nudge all of them off it
            return np.asarray(np.linalg.solve(resolvent * (1.0 + 1e-9j), right))


def of_compiled(compiled: Compiled, p: Array) -> SmallSignal:
    """Return the linear rest of models at parameters (S, n_p); laws count with their slope."""
    rows = compiled.n_x + compiled.n_w + compiled.n_y
    f = compiled.matrices if p.shape[0] == 1 else compiled.matrices.map(p.shape[0])
    return _linear_rest(compiled, _stacked(f(p.T), rows, p.shape[0]))


def slopes_of_compiled(compiled: Compiled, p: Array, wanted: Sequence[int]) -> list[SmallSignal]:
    """Return the derivatives of the linear rest by some parameters, p of shape (n_p,)."""
    rows = compiled.n_x + compiled.n_w + compiled.n_y
    found = np.asarray(compiled.matrices_jacobian(p).full(), float)[:, wanted]
    return [_linear_rest(compiled, column.reshape(rows, -1, order="F")) for column in found.T]


def _linear_rest(compiled: Compiled, block: Array) -> SmallSignal:
    n, k = compiled.n_x, compiled.n_x + compiled.n_w
    m = n + compiled.n_u
    return SmallSignal(
        block[..., :n, :n], block[..., :n, n:m], block[..., k:, :n], block[..., k:, n:m]
    )


def of_program(program: Program, p: Array, u: Array) -> SmallSignal:
    """Return models at parameters (S, n_p) about their rests under inputs `u`, shape (n_u,).

    Where there is no rest, the states stay at the start of the program.
    """
    v, _ = _points(program, p, u)
    wide, by_unknowns, unknowns, inner = _quarters(program, _blocks(program, v, u, p))
    return _cut(program, wide - by_unknowns @ _inverse(inner) @ unknowns)


def slopes_of_program(
    program: Program, p: Array, u: Array, wanted: Sequence[int]
) -> list[SmallSignal]:
    """Return the derivatives of one model by some parameters, how its rest moves counted in.

    A rest that is not unique moves by the smallest correction.
    """
    (v,), (resting,) = _points(program, p[None], u)
    block = _blocks(program, v[None], u, p[None])[0]
    by_p, block_by_v, block_by_p = map(_numbers, _functions(Key(program))[1](v, u, p))
    held = 0 if resting else len(program.states)
    moved = np.zeros((v.size, len(wanted)))
    if v.size > held and np.isfinite(block).all():
        right = by_p[held:, list(wanted)].T
        jacobian = np.tile(block[held : v.size, held : v.size], (len(wanted), 1, 1))
        moved[held:] = -least_correction(right, jacobian)[0].T
    _, by_unknowns, unknowns, inner = _quarters(program, block)
    left, right = by_unknowns @ _inverse(inner), _inverse(inner) @ unknowns
    found = []
    for column in (block_by_p[:, list(wanted)] + block_by_v @ moved).T:
        d = _quarters(program, column.reshape(block.shape, order="F"))
        found.append(_cut(program, d[0] - d[1] @ right - left @ d[2] + left @ d[3] @ right))
    return found


def _points(program: Program, p: Array, u: Array) -> tuple[Array, Array]:
    """Return states and unknowns (S, n_x + n_z) to linearise about, and which of them rest (S,)."""
    v = rests(program, u, p)
    resting = np.isfinite(v).all(axis=1)
    if not resting.all():
        v[~resting] = rests(program, u, p[~resting], held=len(program.states))
    return v, resting


def _blocks(program: Program, v: Array, u: Array, p: Array) -> Array:
    """Return the slopes of rates, residuals and readings by states, unknowns and inputs."""
    f, many = _functions(Key(program))[0], p.shape[0]
    made = (f if many == 1 else f.map(many))(v.T, np.tile(u[:, None], (1, many)), p.T)
    return _stacked(made, v.shape[1] + len(program.outputs), many)


def _stacked(made: ca.DM, rows: int, many: int) -> Array:
    return _numbers(made).reshape(rows, many, -1).transpose(1, 0, 2)


def _numbers(made: ca.DM) -> Array:
    """Return an array; an endless slope is none, and nothing that is computed with it warns."""
    found = np.asarray(made.full(), float)
    return np.where(np.isfinite(found), found, np.nan)


def _quarters(program: Program, block: Array) -> tuple[Array, Array, Array, Array]:
    """Cut out the algebraic unknowns: (rest by rest, rest by them, them by rest, them by them)."""
    at = slice(len(program.states), len(program.states) + len(program.algebraic))
    rows = np.delete(block, at, axis=-2)
    return (
        np.delete(rows, at, axis=-1), rows[..., at],
        np.delete(block[..., at, :], at, axis=-1), block[..., at, at],
    )  # fmt: skip


def _inverse(inner: Array) -> Array:
    """Inverse; NaN where a loop has no slope."""
    try:
        return np.asarray(np.linalg.inv(inner))
    except np.linalg.LinAlgError:
        return np.full_like(inner, np.nan)


def _cut(program: Program, block: Array) -> SmallSignal:
    n = len(program.states)
    upper, lower = block[..., :n, :], block[..., n:, :]
    return SmallSignal(upper[..., :n], upper[..., n:], lower[..., :n], lower[..., n:])


@lru_cache(maxsize=64)
def _functions(key: Key) -> tuple[ca.Function, ca.Function]:
    """Return ``(v, u, p) -> M`` and ``(v, u, p) -> dF/dp, dM/dv, dM/dp``, M column-major."""
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
        ca.Function("slopes", [v, u, p], [ca.densify(d) for d in parts]),
    )
