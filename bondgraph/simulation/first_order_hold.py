"""Exact discretisation of the linear part, with exact derivatives (Frechet) by parameters.

Inputs and law deviations run linearly between the ends of a step (first-order hold):
``x+ = Phi x + G0 v0 + G1 v1`` with ``v = [u; w]``. The matrix exponential is stable for any
stiffness, so no step size has to be chosen to survive (Van Loan, IEEE TAC 23 (1978) 395).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.lure_layout import layout
from bondgraph.support.arrays import Array


@dataclass(frozen=True, slots=True)
class Discrete:
    """Numbers of one step size, packed as the kernel wants them.

    Attributes
    ----------
    packed : ndarray, shape (n_M,)
        ``Phi, G0, G1, Cs, Ds, gain, Cy, Dy, Dyw`` column-major, one after the other.
    derivative : ndarray, shape (n_M, n_p)
        Its derivative by every parameter.
    """

    packed: Array
    derivative: Array


@dataclass(frozen=True, slots=True)
class Blocks:
    """The continuous matrices at one parameter vector."""

    a: Array
    b: Array
    cs: Array
    ds: Array
    cy: Array
    dy: Array


def blocks(compiled: Compiled, block: Array) -> Blocks:
    """Cut a block ``[[A, B E], [Cs, Ds Dsw], [Cy, Dy Dyw]]``, or a stack of them, into parts."""
    n, k = compiled.n_x, compiled.n_x + compiled.n_w
    rows = (block[..., at, :] for at in (slice(n), slice(n, k), slice(k, None)))
    return Blocks(*(part for row in rows for part in (row[..., :n], row[..., n:])))


@dataclass(frozen=True, slots=True)
class Continuous:
    """The continuous matrices at one parameter vector, and how they change with parameters.

    Attributes
    ----------
    parts : Blocks
    moved : Blocks
        Their derivatives by the wanted parameters, one after the other along a first axis.
    finite : bool
        Whether all are numbers that can be computed with.
    """

    compiled: Compiled
    parts: Blocks
    moved: Blocks
    finite: bool

    @property
    def tangents(self) -> list[Blocks]:
        """Derivatives parameter by parameter."""
        each = (getattr(self.moved, f.name) for f in fields(Blocks))
        return [Blocks(*columns) for columns in zip(*each, strict=True)]


def continuous(compiled: Compiled, p: Array, wanted: Array | None = None) -> Continuous:
    """Evaluate the matrices at parameters `p` (SI, shape (n_p,)).

    Parameters
    ----------
    wanted : ndarray of int, optional
        Positions of the parameters whose derivatives are needed; the other columns are left out.
    """
    wanted = np.arange(0) if wanted is None else wanted
    block = compiled.block(p)
    moved = compiled.block_by_parameters(p)[wanted] if wanted.size else np.zeros((0, *block.shape))
    finite = bool(np.isfinite(block).all() and np.isfinite(moved).all())
    return Continuous(compiled, blocks(compiled, block), blocks(compiled, moved), finite)


def discretise(model: Continuous, step: float) -> Discrete:
    """Discretise for a step (s)."""
    compiled, parts, moved = model.compiled, model.parts, model.moved
    n_p = moved.a.shape[0]
    if not model.finite:
        # values too large to compute with: the run is no number, and whoever fits steps back
        size = sum(rows * columns for rows, columns in layout(compiled, 0).pieces) + 1
        return Discrete(np.full(size, np.nan), np.full((size, n_p), np.nan))
    held, dheld = _hold(parts, moved, step)
    _act_at_the_end(compiled, held)
    _act_at_the_end(compiled, dheld)
    m = compiled.n_u
    gain = parts.cs @ held[2][:, m:] + parts.ds[:, m:]
    dgain = moved.cs @ held[2][:, m:] + parts.cs @ dheld[2][..., m:] + moved.ds[..., m:]
    packed = np.append(_packed(parts, held, gain, m), step)
    derivative = np.zeros((packed.size, n_p))
    derivative[:-1] = _packed(moved, dheld, dgain, m).T
    return Discrete(packed, derivative)


def standing(model: Continuous, moving: Discrete) -> Discrete:
    """Discretise for a step of zero, from what was packed for another step."""
    if not model.finite:
        return moving
    parts, m = model.parts, model.compiled.n_u
    n, inputs = parts.b.shape
    packed, derivative = moving.packed.copy(), moving.derivative.copy()
    held = n * (n + 2 * inputs)
    packed[:held] = derivative[:held] = 0.0
    packed[: n * n : n + 1] = 1.0
    gain = held + parts.cs.size + parts.ds[:, :m].size
    end = gain + parts.ds[:, m:].size
    packed[gain:end] = _by_columns(parts.ds[:, m:])
    derivative[gain:end] = _by_columns(model.moved.ds[..., m:]).T
    packed[-1] = 0.0
    return Discrete(packed, derivative)


Held = tuple[Array, Array, Array]


def _hold(parts: Blocks, moved: Blocks, h: float) -> tuple[Held, Held]:
    """Return Phi, G0 and G1 and their derivatives, these along a first axis."""
    n, m = parts.a.shape[0], parts.b.shape[1]
    n_p = moved.a.shape[0]
    if h == 0.0 or n == 0:
        shapes = ((n, n), (n, m), (n, m))
        still = (np.eye(n), np.zeros((n, m)), np.zeros((n, m)))
        return still, tuple(np.zeros((n_p, *s)) for s in shapes)  # type: ignore[return-value]
    scale = _state_scale(parts.a)
    turn = h * scale / scale[:, None]
    driven = np.abs(np.concatenate([parts.b[None], moved.b]) / scale[:, None]).max(axis=1) * h
    column = np.ones(m)
    for row in driven[::-1]:  # the first that is not zero counts
        column = np.where(row > 0, row, column)
    unit = scale[:, None] * column

    def augmented(a: Array, b: Array) -> Array:
        z = np.zeros((*a.shape[:-2], n + 2 * m, n + 2 * m))
        z[..., :n, :n] = a * turn
        z[..., :n, n : n + m] = b * (h / unit)
        return z

    z = augmented(parts.a, parts.b)
    z[n : n + m, n + m :] = np.eye(m)

    def read(e: Array) -> Held:
        phi = e[..., :n, :n] * (scale[:, None] / scale)
        late = e[..., :n, n + m :] * unit
        return phi, e[..., :n, n : n + m] * unit - late, late

    # linear in their direction: unit directions keep the squaring phase in range
    directions = augmented(moved.a, moved.b)
    size = np.abs(directions).max(axis=(1, 2), keepdims=True, initial=0.0)
    whole, along = _exponential(z, directions / np.where(size > 0.0, size, 1.0))
    return read(whole), read(along * size)


SMALL = 24
"""Rows up to which the exponential of a matrix of twice the size is the faster derivative."""


def _exponential(z: Array, directions: Array) -> tuple[Array, Array]:
    """Return ``exp(z)`` and its derivatives in some directions, these along a first axis.

    ``exp([[z, e], [0, z]])`` holds both (Mathias, SIAM J. Matrix Anal. Appl. 17 (1996) 610).
    """
    from scipy.linalg import expm, expm_frechet

    n = z.shape[0]
    along = np.zeros_like(directions)
    shown = directions.any(axis=(1, 2))
    if n > SMALL or not shown.any():
        for i in np.flatnonzero(shown):
            along[i] = expm_frechet(z, directions[i], compute_expm=False)
        return expm(z), along
    both = np.zeros((int(shown.sum()), 2 * n, 2 * n))
    both[:, :n, :n] = both[:, n:, n:] = z
    both[:, :n, n:] = directions[shown]
    made = expm(both)
    along[shown] = made[:, :n, n:]
    return made[0, :n, :n], along


def _act_at_the_end(compiled: Compiled, held: Held) -> None:
    """Let set-valued laws act with their end value: the force of sticking may jump, not ring."""
    _, early, late = held
    for j, port in enumerate(compiled.laws, start=compiled.n_u):
        if port.law.set_valued:
            late[..., j] += early[..., j]
            early[..., j] = 0.0


def _state_scale(a: Array) -> Array:
    """Diagonal scaling that balances rows and columns (charge and momentum differ by 1e11)."""
    from scipy.linalg.lapack import dgebal

    return np.asarray(dgebal(a, scale=1, permute=0)[3], float)


def _packed(parts: Blocks, held: Held, gain: Array, m: int) -> Array:
    """Return the pieces as the kernel wants them, along the last axis; `m` inputs."""
    pieces = (*held, parts.cs, parts.ds[..., :m], gain, parts.cy, parts.dy)
    return np.concatenate([_by_columns(v) for v in pieces], axis=-1)


def _by_columns(v: Array) -> Array:
    """Lay out a matrix, or each of a stack, column by column."""
    return np.swapaxes(v, -1, -2).reshape(*v.shape[:-2], v.shape[-2] * v.shape[-1])
