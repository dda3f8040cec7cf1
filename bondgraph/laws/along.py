"""A law alone along a record: what it adds to a straight line at every sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws.law import Law, split
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import CASADI, NUMPY


def along(law: Law, s: FloatArray, dt: float, p: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Return the deviation of a law along a record and its memory, at rest at the first sample.

    Parameters
    ----------
    s : ndarray, shape (N,)
        Argument of the law, SI.
    dt : float
        Time between samples, s.
    p : sequence of float
        Its parameters, in the order of `Law.parameters`.

    Returns
    -------
    ndarray, shape (N,)
        The deviation.
    ndarray, shape (N, n_memory)
        The memory after each sample.

    Raises
    ------
    UnusableInput
        If the law reads another signal beside its argument.

    Examples
    --------
    >>> from bondgraph.laws import SlewLimit
    >>> u = np.array([0.0, 1.0, 1.0])
    >>> (u + along(SlewLimit(), u, 0.1, [0.25])[0]).tolist()
    [0.0, 0.4, 0.8]
    """
    if law.watched:
        raise UnusableInput(
            f"{law.name} reads {law.watched} beside its argument; along one argument it has no "
            "course, run a graph that holds it"
        )
    if law.counts_time and law.n_memory == 1:
        time = np.asarray(dt * np.arange(s.size), np.float64)
        return _wide(law.deviation(NUMPY, s, (time,), (*p, 0.0)), s.size), time[:, None]
    if law.n_memory or law.timed:
        return _step_by_step(law, s, dt, p)
    return _wide(law.deviation(NUMPY, s, (), tuple(p)), s.size), np.zeros((s.size, 0))


def _wide(value: FloatArray, n: int) -> FloatArray:
    return np.asarray(np.broadcast_to(value, n), float)


def _step_by_step(
    law: Law, s: FloatArray, dt: float, p: Sequence[float]
) -> tuple[FloatArray, FloatArray]:
    """Run a law with memory by CasADi; the first step takes no time."""
    import casadi as ca  # late: most of the time to import bondgraph

    sizes = {"memory": law.n_memory, "argument": 1, "step": 1, "parameters": len(p)}
    symbols = {name: ca.SX.sym(name, n) for name, n in sizes.items()}
    m, u, h, q = symbols.values()
    memory, known = split(m), (*split(q), *([h] if law.timed else []))
    after = ca.vertcat(*law.advance(CASADI, u, memory, known))
    step = ca.Function("step", [m, u, h, q], [after, law.deviation(CASADI, u, memory, known)])
    steps = np.full((1, s.size), dt)
    steps[0, 0] = 0.0
    start, numbers = np.reshape(law.initial_memory(float(s[0])), (-1, 1)), np.reshape(p, (-1, 1))
    memories, w = step.mapaccum(s.size)(start, s[None, :], steps, numbers)
    return w.full().ravel(), memories.full().T
