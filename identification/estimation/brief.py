"""The beginning of a long record: where it tells enough, the rest need not be simulated."""

from __future__ import annotations

from dataclasses import replace

from bondgraph.support.arrays import Array
from identification.study.problem import Problem
from identification.study.residual import offset_scale, slots, windows

BRIEF = 5000
"""Samples that tell apart what is far apart; a record of less than twice as many is short."""


def brief(problem: Problem) -> Problem | None:
    """Return the problem on the first samples of its record; None where there is little to gain.

    None too for windows with states of their own, and where these samples are all of one part.
    """
    if problem.window is not None or problem.data.n < 2 * BRIEF:
        return None
    data = problem.data.begun(BRIEF)
    if not (data.mask("train").any() and data.mask("test").any()):
        return None
    correction = None if problem.correction is None else problem.correction[:BRIEF]
    shorter = replace(problem, data=data, correction=correction, built=problem.dynamics)
    count = len(windows(shorter))
    shorter = replace(shorter, known_states={n: v[:count] for n, v in problem.known_states.items()})
    if problem.known_offsets:
        ratio = offset_scale(problem) / offset_scale(shorter)
        known = tuple(float(v) for v in ratio * problem.known_offsets)
        shorter = replace(shorter, known_offsets=known)
    return shorter


def carried(theta: Array, given: Problem, to: Problem) -> Array:
    """Return unknowns of one problem as those of another with other samples: offsets are scaled.

    Parameters
    ----------
    theta : ndarray, shape (n_theta,)
        Of `given`.
    """
    found = theta.copy()
    found[slots(given).offsets] *= offset_scale(given) / offset_scale(to)
    return found
