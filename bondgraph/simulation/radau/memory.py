"""Memory at the first sample: relaxed at the arguments that the laws have there."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np

from bondgraph.equations.codegen import law_arguments
from bondgraph.equations.program import Program
from bondgraph.simulation.radau.interpreted import Carried
from bondgraph.simulation.radau.recorder import Key, Order, consistent, functions_of
from bondgraph.support.arrays import Array


def relaxed_memory(program: Program, order: Order, begin: Carried) -> tuple[Array, Array]:
    """Return the memory of laws at rest at their arguments, as the exact step starts, and tangents.

    The arguments are those of the state and the inputs at the first sample, with the memory of
    `begin`.

    Returns
    -------
    memory : ndarray, shape (n_m,)
    tangent : ndarray, shape (n_m, n_d)
    """
    started = consistent(functions_of(program), order, begin) if program.algebraic else begin
    if started is None:
        return begin.m.copy(), begin.tm.copy()
    v, tv = started.v, started.tv
    found = arguments_of(program)(order.time, v, order.first, order.p, begin.m, 0.0)
    s, by_v, by_p, by_m = (np.asarray(a.full()) for a in found)
    ds = by_v @ tv + by_m @ begin.tm
    ds[:, : len(order.directions)] += by_p[:, list(order.directions)]
    return _at_arguments(program, s.ravel(), ds)


def relaxed_at(program: Program, v: Array, u: Array, p: Array, m: Array) -> tuple[Array, Array]:
    """Return the memory of laws at rest at states and unknowns `v`, and its derivatives by them.

    Arguments of laws behind other laws are those with the memory `m`.
    """
    s, by_v, *_ = (a.full() for a in arguments_of(program)(0.0, v, u, p, m, 0.0))
    return _at_arguments(program, s.ravel(), by_v)


def _at_arguments(program: Program, s: Array, ds: Array) -> tuple[Array, Array]:
    """Return memory at rest at arguments, and its derivatives, with theirs."""
    memory = np.zeros(len(program.memory))
    tangent = np.zeros((memory.size, ds.shape[1]))
    kept = [c for c in program.laws if c.law.n_memory]
    for call, at, slope in zip(kept, s, ds, strict=True):
        memory[call.memory] = call.law.initial_memory(float(at))
        tangent[call.memory] = np.outer(call.law.memory_sensitivity(float(at)), slope)
    return memory, tangent


def arguments_of(program: Program) -> ca.Function:
    """Return ``(t, v, u, p, m, h) -> (s, ds/dv, ds/dp, ds/dm)`` of the laws with memory, SX."""
    return _arguments(Key(program))


@lru_cache(maxsize=64)
def _arguments(key: Key) -> ca.Function:
    arguments = law_arguments(key.program)
    t, x, z, u, p, m, h = (ca.SX.sym(n, *arguments.size_in(n)) for n in arguments.name_in())
    v = ca.SX.sym("v", x.numel() + z.numel())
    s = arguments(t, v[: x.numel()], v[x.numel() :], u, p, m, h)
    results = [s, *(ca.densify(ca.jacobian(s, w)) for w in (v, p, m))]
    return ca.Function("arguments", [t, v, u, p, m, h], results)
