"""The rest of a model that is linear up to scalar laws: of its linear part, then laws and all.

Sizes: n_x states, n_u inputs, n_w laws, n_m memory states of a law.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

import casadi as ca
import numpy as np

from bondgraph.equations.relation import LawUse
from bondgraph.laws.law import split
from bondgraph.laws.up_to_numbers import UpToNumbers
from bondgraph.simulation.radau.start import SOLVED, least_correction
from bondgraph.simulation.start import equilibrium
from bondgraph.support.arrays import Array
from bondgraph.support.ops import CASADI

if TYPE_CHECKING:
    from bondgraph.simulation.lure import Compiled

STEPS = 200
STILL = 1e-9
"""Share of what the states would make of an argument below which it is none: what sticks."""

Deviations: TypeAlias = Callable[[Array], tuple[Array, Array]]
"""``(x, s) -> w, dw/ds``, shapes (n_w,) and (n_w, n_w)."""


def law_rest(
    compiled: Compiled,
    p: Array,
    u: Array,
    memory: Mapping[str, Sequence[float]] | None = None,
    *,
    quiet: bool = False,
) -> Array:
    """Return the state at rest under constant inputs, shape (n_x,); integrators stay at zero.

    Newton's method from the rest of the linear part. Laws with memory are relaxed there, unless
    `memory` holds theirs; friction that sticks carries nothing, and what acts in time begins with
    the record. Where none is found the state is that of the linear part; a warning says so, unless
    nothing rests there either.

    Parameters
    ----------
    p : ndarray, shape (n_p,), SI
    u : ndarray, shape (n_u,)
    quiet : bool
        Whether not to warn.
    """
    from bondgraph.simulation.first_order_hold import blocks
    from bondgraph.simulation.lure import law_slices

    kept = memory or {}
    if not u.any() and not _pushed_at_rest(compiled, p, kept):
        return np.zeros(compiled.n_x)
    x = equilibrium(compiled, p, u)
    if not compiled.n_w or not x.size:
        return x
    if recorded := compiled.model.recorded:  # where nothing moves, nothing has a rate
        u = np.where([n in recorded for n in compiled.inputs], 0.0, u)
    parts, k, n = blocks(compiled, compiled.block(p)), compiled.n_u, x.size
    by_w = np.vstack([parts.b[:, k:], parts.ds[:, k:]])
    numbers = p[list(compiled.law_parameters)]
    acting = [
        (j, port, numbers[q])
        for j, (port, _, q) in enumerate(law_slices(compiled))
        if by_w[:, j].any() and not port.law.counts_time
    ]
    functions = {j: _function(UpToNumbers.of(port.law, q.size)) for j, port, q in acting}
    rounding = _rounding(parts.a, parts.cs)

    def arguments(v: Array) -> Array:
        """Arguments of the laws, zero where they are the rounding of the largest state."""
        largest = np.maximum(np.abs(x), np.abs(v[:n]))
        return np.where(np.abs(v[n:]) <= rounding(largest), 0.0, v[n:])

    s = parts.cs @ x + parts.ds[:, :k] @ u

    def deviation(j: int, port: LawUse, q: Array, s: Array) -> tuple[Array, ...]:
        m, moved = _memory(port, j, s, kept)
        return (*(a.full() for a in functions[j](s[j], m, q)), moved)

    begin = np.concatenate([x, s])
    if not any(deviation(j, port, q, arguments(begin))[0].any() for j, port, q in acting):
        return x
    # a row that neither a state nor a law which states move decides is an integral: it never rests
    held = parts.a.any(axis=1) | parts.b[:, k:][:, _moved(parts.cs, parts.ds[:, k:])].any(axis=1)
    rows = np.append(held, np.ones(s.size, bool))
    linear = np.block([[parts.a, np.zeros((n, s.size))], [parts.cs, -np.eye(s.size)]])[rows]
    constant = np.concatenate([parts.b[:, :k] @ u, parts.ds[:, :k] @ u])[rows]

    def deviations(v: Array) -> tuple[Array, Array]:
        s = arguments(v)
        w, by = np.zeros(s.size), np.zeros((s.size, s.size))
        for j, port, q in acting:
            found, by_s, by_m, moved = deviation(j, port, q, s)
            w[j] = found[0, 0]
            by[j] = (by_m @ moved)[0]
            by[j, j] += by_s[0, 0]
        return w, by

    v = _solved(linear, constant, by_w[rows], begin, deviations)
    if v is not None:
        return v[:n]
    left = np.abs(linear @ begin + constant).max()
    if not quiet and left <= STILL * np.abs(constant).max():
        warnings.warn(
            f"{compiled.model.name}: no rest with its laws is found under these inputs "
            f"({', '.join(port.element for _, port, _ in acting)}); it starts from that of the "
            "linear part; give x0 as numbers, or let it settle",
            stacklevel=4,
        )
    return x


def _pushed_at_rest(compiled: Compiled, p: Array, kept: Mapping[str, Sequence[float]]) -> bool:
    """Return whether a law deviates where all arguments are zero."""
    from bondgraph.simulation.lure import law_slices

    numbers, still = p[list(compiled.law_parameters)], np.zeros(compiled.n_w)
    for j, (port, _, q) in enumerate(law_slices(compiled)):
        if not port.law.counts_time:
            function = _function(UpToNumbers.of(port.law, numbers[q].size))
            w, *_ = function(0.0, _memory(port, j, still, kept)[0], numbers[q])
            if float(w):
                return True
    return False


def _solved(
    linear: Array, constant: Array, by_w: Array, v: Array, deviations: Deviations
) -> Array | None:
    """Return the root of ``linear v + constant + by_w w(v)``; None if it is not found.

    Where laws leave nothing that could carry the inputs (within a gap), the slope of the linear
    part leads on.
    """
    n_w = by_w.shape[1]
    n = v.size - n_w
    for _ in range(STEPS):
        w, slope = deviations(v)
        r, j = linear @ v + constant + by_w @ w, linear.copy()
        j[:, n:] += by_w @ slope
        if not (np.isfinite(r).all() and np.isfinite(j).all()):
            return None
        (step,), (rows,), (columns,) = least_correction(r[None], j[None])
        if np.abs((r - j @ step) / rows).max() > 0.5 * np.abs(r / rows).max():
            (step,), (rows,), (columns,) = least_correction(r[None], linear[None])
        v = v - step
        scale = np.abs(v * columns).max() + 1e-150
        arrived = np.abs(step * columns).max() <= SOLVED * scale
        if arrived:
            return v if np.abs(r / rows).max() <= STILL * max(scale, 1e-3) else None
    return None


def _rounding(a: Array, cs: Array) -> Callable[[Array], Array]:
    """Return how far rounding of states so large (n_x,) moves the arguments of laws, (n_w,)."""
    rows = np.abs(a).max(axis=1, keepdims=True)
    columns = np.abs(a / np.where(rows > 0.0, rows, 1.0)).max(axis=0)
    columns[columns == 0.0] = 1.0
    share = STILL * np.abs(cs) @ (1.0 / columns)
    return lambda largest: np.asarray(share * np.max(largest * columns))


def _moved(cs: Array, dsw: Array) -> Array:
    """Return which laws have arguments that states move, shape (n_w,)."""
    moved = cs.any(axis=1)
    for _ in range(moved.size):
        moved = moved | dsw[:, moved].any(axis=1)
    return np.asarray(moved)


def _memory(
    port: LawUse, j: int, s: Array, kept: Mapping[str, Sequence[float]]
) -> tuple[Array, Array]:
    """Return the memory of a law at rest, and its derivatives by all arguments, (n_m, n_w)."""
    law, by = port.law, np.zeros((port.law.n_memory, s.size))
    if port.element in kept:
        return np.array(law.checked_memory(kept[port.element])), by
    m = np.array(law.initial_memory(float(s[j])), float)
    if m.size:
        by[:, j] = law.memory_sensitivity(float(s[j]))
    if law.watched:  # its gauge, the next of the laws, follows it
        m[-2:], by[-2:], by[-2:, j + 1] = s[j + 1], 0.0, 1.0
    return m, by


@lru_cache(maxsize=64)
def _function(kind: UpToNumbers) -> ca.Function:
    """Return ``(s, m, q) -> w, dw/ds, dw/dm`` of a law, no time after its memory.

    Numbers that a fit has found need not be those that a law may be declared with.
    """
    law, s = kind.example, ca.SX.sym("s")
    m, q = ca.SX.sym("m", law.n_memory), ca.SX.sym("q", kind.count)
    arguments = (*split(q), 0.0) if law.timed else split(q)
    w = ca.SX(law.deviation(CASADI, s, split(m), arguments))
    return ca.Function("law", [s, m, q], [w, *(ca.densify(ca.jacobian(w, a)) for a in (s, m))])
