"""Sizes of states in which a filter is well conditioned: a charge beside a voltage differ by 1e11.

Only the order of magnitude matters; the likelihood does not depend on it.
"""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array
from identification.study.problem import Problem

ESCAPED = 100.0
"""Simulated readings beyond this many measured spreads say that the simulation ran away."""


def state_scale(problem: Problem, reading: Array) -> Array:
    """Size of each state, shape (n_x,): its spread in a simulation, else by balancing.

    Parameters
    ----------
    reading : ndarray, shape (n_y,)
        Size of each reading.
    """
    dynamics, data, p = problem.dynamics, problem.data, problem.start_vector
    balanced = _balanced(problem, reading)
    whole = slice(0, data.n)
    with np.errstate(all="ignore"):
        ready = dynamics.prepare(p, data.dt, 1, [], False)
        fine = problem.fine_inputs(whole, 1)
        y = dynamics.run(ready, problem.inputs, problem.rest_state, fine).y[:, : reading.size]
        if not np.isfinite(y).all() or (np.ptp(y, axis=0) > ESCAPED * reading).any():
            return balanced
        spread = dynamics.spreads(p, problem.inputs, data.dt, problem.rest_state, 1, data.between)
    return np.where(spread > 1e-8 * balanced, spread, balanced)


def _balanced(problem: Problem, reading: Array) -> Array:
    """Units in which the way from the inputs through the states to the readings is balanced."""
    from scipy.linalg import matrix_balance

    n, dt, u = problem.dynamics.n_x, problem.data.dt, problem.inputs
    small = problem.dynamics.small_signal(problem.start_vector, u[0])
    loop = np.zeros((n + 1, n + 1))
    loop[:n, :n] = np.abs(small.a) * dt
    loop[:n, n] = (np.abs(small.b) * np.abs(u).max(axis=0)).sum(axis=1) * dt
    loop[n, :n] = (np.abs(small.c) / reading[:, None]).max(axis=0, initial=0.0)
    _, (scale, _) = matrix_balance(loop, permute=False, separate=True)
    found = scale[:n] / scale[n]
    return np.where(np.isfinite(found) & (found > 0), found, 1.0)
