"""Sizes of states in which a filter is well conditioned: a charge beside a voltage differ by 1e11.

Only the order of magnitude matters; the likelihood does not depend on it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.start import equilibrium
from bondgraph.support.arrays import Array
from identification.study.problem import Data

ESCAPED = 100.0
"""Simulated readings beyond this many measured spreads say that the simulation ran away."""


def state_scale(
    compiled: Compiled, p: Array, inputs: Sequence[Array], records: Sequence[Data], reading: Array
) -> Array:
    """Size of each state, shape (n_x,): its spread in a simulation, else by balancing.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (N, n_u)
        Inputs of each record at its samples.
    reading : ndarray, shape (n_y,)
        Size of each reading.
    """
    balanced = _balanced(compiled, p, inputs, records, reading)
    states = tuple(str(s.symbol) for s in compiled.space.states)
    seen = Compiled(compiled.space, states)
    spread = np.zeros(compiled.n_x)
    for u, r in zip(inputs, records, strict=True):
        run = run_record(seen, p, u, r.dt, equilibrium(compiled, p, u[0]), hold=r.hold)
        y = run.y[:, : compiled.n_y]
        if not np.isfinite(run.y).all() or (np.ptp(y, axis=0) > ESCAPED * reading).any():
            return balanced
        spread = np.maximum(spread, run.y[:, compiled.n_y :].std(axis=0))
    return np.where(spread > 1e-8 * balanced, spread, balanced)


def _balanced(
    compiled: Compiled, p: Array, inputs: Sequence[Array], records: Sequence[Data], reading: Array
) -> Array:
    """Units in which the way from the inputs through the states to the readings is balanced."""
    from scipy.linalg import matrix_balance

    n = compiled.n_x
    parts = blocks(compiled, np.asarray(compiled.matrices(p).full(), float))
    dt = min(r.dt for r in records)
    size = np.max([np.abs(u).max(axis=0) for u in inputs], axis=0)
    loop = np.zeros((n + 1, n + 1))
    loop[:n, :n] = np.abs(parts.a) * dt
    loop[:n, n] = (np.abs(parts.b[:, : compiled.n_u]) * size).sum(axis=1) * dt
    loop[n, :n] = (np.abs(parts.cy) / reading[:, None]).max(axis=0, initial=0.0)
    _, (scale, _) = matrix_balance(loop, permute=False, separate=True)
    found = scale[:n] / scale[n]
    return np.where(np.isfinite(found) & (found > 0), found, 1.0)
