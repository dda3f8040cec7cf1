"""A law alone along a record: what it adds to a straight line at every sample."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.laws.law import Law, split
from bondgraph.laws.up_to_numbers import UpToNumbers
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import CASADI, NUMPY

if TYPE_CHECKING:
    from bondgraph.hysteresis.compiled import RecordLoops


def along(law: Law, s: FloatArray, dt: float, p: Sequence[float]) -> FloatArray:
    """Return the deviation of a law along a record, at rest at the first sample, shape (N,).

    Without memory it is one evaluation; with memory a compiled loop, shared by laws of equal
    `structure`.

    Parameters
    ----------
    s : ndarray, shape (N,)
        Argument of the law, SI.
    dt : float
        Time between samples, s.
    p : sequence of float
        Its parameters, in the order of `Law.parameters`.

    Raises
    ------
    UnusableInput
        If the law reads another signal beside its argument.

    Examples
    --------
    >>> from bondgraph.laws import SlewLimit
    >>> u = np.array([0.0, 1.0, 1.0])
    >>> (u + along(SlewLimit(), u, 0.1, [0.25])).tolist()
    [0.0, 0.4, 0.8]
    """
    if law.watched:
        raise UnusableInput(
            f"{law.name} reads {law.watched} beside its argument; along one argument it has no "
            "course, run a graph that holds it"
        )
    if law.counts_time and law.n_memory == 1:
        return _wide(law.deviation(NUMPY, s, (dt * np.arange(s.size),), (*p, 0.0)), s.size)
    if law.n_memory or law.timed:
        return _step_by_step(law, s, dt, p)
    return _wide(law.deviation(NUMPY, s, (), tuple(p)), s.size)


def _wide(value: FloatArray, n: int) -> FloatArray:
    return np.asarray(np.broadcast_to(value, n), float)


def _step_by_step(law: Law, s: FloatArray, dt: float, p: Sequence[float]) -> FloatArray:
    """Run a law with memory; the first step takes no time."""
    x, known = np.ascontiguousarray(s, float), (*p, *([0.0] if law.timed else []))
    rest = law.initial_memory(float(x[0]))
    first = float(law.deviation(NUMPY, x[0], rest, known))
    begun = np.array(law.advance(NUMPY, x[0], rest, known), float)
    loops = _loops(UpToNumbers.of(law, len(p)))
    return np.concatenate([[first], loops.forwards(x[1:], begun, dt, np.array(p, float))[0]])


@lru_cache(maxsize=64)
def _loops(kind: UpToNumbers) -> RecordLoops:
    import casadi as ca  # late: most of the time to import bondgraph

    from bondgraph.hysteresis.compiled import loops_of

    law = kind.example
    u, h = ca.SX.sym("u"), ca.SX.sym("h")
    m, p = ca.SX.sym("m", law.n_memory), ca.SX.sym("p", kind.count)
    memory, known = split(m), (*split(p), *([h] if law.timed else []))
    value = ca.densify(ca.SX(law.deviation(CASADI, u, memory, known)))
    after = ca.densify(ca.vertcat(*law.advance(CASADI, u, memory, known)))
    return loops_of(ca.Function("operator_step", [u, m, h, p], [value, after], {"cse": True}))
