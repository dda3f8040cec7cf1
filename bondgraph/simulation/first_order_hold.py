"""Exact discretisation of the linear part, with exact derivatives (Frechet) by parameters.

Inputs and law deviations run linearly between the ends of a step (first-order hold):
``x+ = Phi x + G0 v0 + G1 v1`` with ``v = [u; w]``. The matrix exponential is stable for any
stiffness, so no step size has to be chosen to survive (Van Loan, IEEE TAC 23 (1978) 395).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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
    tangents : list of Blocks
        Derivatives by the wanted parameters.
    finite : bool
        Whether all are numbers that can be computed with.
    """

    compiled: Compiled
    parts: Blocks
    tangents: list[Blocks]
    finite: bool


def continuous(compiled: Compiled, p: Array, wanted: Array | None = None) -> Continuous:
    """Evaluate the matrices at parameters `p` (SI, shape (n_p,)).

    Parameters
    ----------
    wanted : ndarray of int, optional
        Positions of the parameters whose derivatives are needed; the other columns are left out.
    """
    wanted = np.arange(0) if wanted is None else wanted
    block = np.asarray(compiled.matrices(p).full(), float)
    jac = np.zeros((block.size, 0))
    if wanted.size:
        jac = np.asarray(compiled.matrices_jacobian(p).full(), float)[:, wanted]
    finite = bool(np.isfinite(block).all() and np.isfinite(jac).all())
    columns = (jac[:, i].reshape(block.shape, order="F") for i in range(wanted.size))
    tangents = [blocks(compiled, column) for column in columns]
    return Continuous(compiled, blocks(compiled, block), tangents, finite)


def discretise(model: Continuous, step: float) -> Discrete:
    """Discretise for a step (s)."""
    compiled, parts, tangents = model.compiled, model.parts, model.tangents
    if not model.finite:
        # values too large to compute with: the run is no number, and whoever fits steps back
        size = sum(rows * columns for rows, columns in layout(compiled, 0).pieces) + 1
        return Discrete(np.full(size, np.nan), np.full((size, len(tangents)), np.nan))
    held, dheld = _hold(parts, tangents, step)
    held = _at_the_end(compiled, held)
    dheld = [_at_the_end(compiled, t) for t in dheld]
    packed = np.append(_pack(parts, held, compiled), step)
    derivative = np.empty((packed.size, len(tangents)))
    for i, t in enumerate(tangents):
        derivative[:-1, i] = _pack_tangent(parts, t, held, dheld[i], compiled)
        derivative[-1, i] = 0.0
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
    packed[gain:end] = parts.ds[:, m:].ravel(order="F")
    for i, t in enumerate(model.tangents):
        derivative[gain:end, i] = t.ds[:, m:].ravel(order="F")
    packed[-1] = 0.0
    return Discrete(packed, derivative)


Held = tuple[Array, Array, Array]


def _hold(parts: Blocks, tangents: list[Blocks], h: float) -> tuple[Held, list[Held]]:
    n, m = parts.a.shape[0], parts.b.shape[1]
    zero = [np.zeros_like(parts.a), np.zeros((n, m)), np.zeros((n, m))]
    if h == 0.0:
        return (np.eye(n), zero[1], zero[2]), [tuple(zero) for _ in tangents]  # type: ignore[misc]
    if n == 0:
        return (zero[0], zero[1], zero[2]), [tuple(zero) for _ in tangents]  # type: ignore[misc]
    scale = _state_scale(parts.a)
    column = np.abs(parts.b / scale[:, None]).max(axis=0) * h
    for t in tangents:
        column = np.where(column > 0, column, np.abs(t.b / scale[:, None]).max(axis=0) * h)
    column = np.where(column > 0, column, 1.0)

    def augmented(a: Array, b: Array) -> Array:
        z = np.zeros((n + 2 * m, n + 2 * m))
        z[:n, :n] = a * h * scale[None, :] / scale[:, None]
        z[:n, n : n + m] = b * h / scale[:, None] / column[None, :]
        return z

    z = augmented(parts.a, parts.b)
    z[n : n + m, n + m :] = np.eye(m)

    def read(e: Array) -> Held:
        phi = e[:n, :n] * scale[:, None] / scale[None, :]
        whole = e[:n, n : n + m] * scale[:, None] * column[None, :]
        late = e[:n, n + m :] * scale[:, None] * column[None, :]
        return phi, whole - late, late

    # linear in their direction: unit directions keep the squaring phase in range
    moved = [augmented(t.a, t.b) for t in tangents]
    sizes = [float(np.abs(e).max()) for e in moved]
    units = [e / size for e, size in zip(moved, sizes, strict=True) if size > 0.0]
    whole, along = _exponential(z, units)
    steps = iter(along)
    found: list[Held] = []
    for size in sizes:
        phi, early, late = read(next(steps)) if size > 0.0 else zero
        found.append((phi * size, early * size, late * size))
    return read(whole), found


SMALL = 24
"""Rows up to which the exponential of a matrix of twice the size is the faster derivative."""


def _exponential(z: Array, directions: list[Array]) -> tuple[Array, Iterator[Array]]:
    """Return ``exp(z)`` and its derivatives in some directions.

    ``exp([[z, e], [0, z]])`` holds both (Mathias, SIAM J. Matrix Anal. Appl. 17 (1996) 610).
    """
    from scipy.linalg import expm, expm_frechet

    n = z.shape[0]
    if n > SMALL or not directions:
        return expm(z), (expm_frechet(z, e, compute_expm=False) for e in directions)
    both = np.zeros((len(directions), 2 * n, 2 * n))
    both[:, :n, :n] = both[:, n:, n:] = z
    both[:, :n, n:] = directions
    made = expm(both)
    return made[0, :n, :n], iter(made[:, :n, n:])


def _at_the_end(compiled: Compiled, held: Held) -> Held:
    """Let set-valued laws act with their end value: the force of sticking may jump, not ring."""
    phi, early, late = held[0], held[1].copy(), held[2].copy()
    for j, port in enumerate(compiled.laws, start=compiled.n_u):
        if port.law.set_valued:
            late[:, j] += early[:, j]
            early[:, j] = 0.0
    return phi, early, late


def _state_scale(a: Array) -> Array:
    """Diagonal scaling that balances rows and columns (charge and momentum differ by 1e11)."""
    from scipy.linalg import matrix_balance

    _, (scale, _) = matrix_balance(a, permute=False, separate=True)
    return np.asarray(scale, float)


def _pack(parts: Blocks, held: Held, compiled: Compiled) -> Array:
    gain = parts.cs @ held[2][:, compiled.n_u :] + parts.ds[:, compiled.n_u :]
    ds = parts.ds[:, : compiled.n_u]
    pieces = (*held, parts.cs, ds, gain, parts.cy, parts.dy)
    return np.concatenate([np.asarray(v).ravel(order="F") for v in pieces])


def _pack_tangent(parts: Blocks, t: Blocks, held: Held, dheld: Held, compiled: Compiled) -> Array:
    m = compiled.n_u
    dgain = t.cs @ held[2][:, m:] + parts.cs @ dheld[2][:, m:] + t.ds[:, m:]
    pieces = (*dheld, t.cs, t.ds[:, :m], dgain, t.cy, t.dy)
    return np.concatenate([np.asarray(v).ravel(order="F") for v in pieces])
