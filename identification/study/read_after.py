"""Readings taken after the step of a held command: what jumps with it has jumped already.

A reading of a sample usually comes before the command changes there: it belongs to the interval
that ends. A discrete simulation ``y[k] = C x[k] + D u[k]`` and many a logger read after it: the
state is the same, what passes straight from a command to the reading differs by ``D (u+ - u-)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bondgraph.simulation.start import HOLDS
from bondgraph.support.arrays import Array

if TYPE_CHECKING:
    from identification.study.problem import Problem

READ_AFTER = "hold-after"
"""Held between samples, and read after the step."""
BEHAVIOURS = (*HOLDS, READ_AFTER)
"""What commands do between samples, and at which side of a step readings are taken."""
THROUGH = 1e-9
"""Part of a reading's size that passes straight from a command, to count."""


def between(behaviour: str) -> str:
    """Return what a command does between samples, one of `HOLDS`.

    Examples
    --------
    >>> between("hold-after"), between("linear")
    ('hold', 'linear')
    """
    return "hold" if behaviour == READ_AFTER else behaviour


def passing(problem: Problem) -> Array:
    """Which readings jump with a command that moves, shape (n_y,)."""
    direct = problem.dynamics.small_signal(problem.start_vector, problem.mean_inputs).d
    n_y = len(problem.data.names)
    moves = np.abs(np.diff(problem.inputs, axis=0)).max(axis=0, initial=0.0)
    with np.errstate(invalid="ignore"):
        jumps = np.abs(direct[:n_y]) @ moves
    return np.asarray(jumps > THROUGH * problem.data.spread)
