"""Residuals of spectral lines of models with laws: the commands repeat until the readings do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from identification.estimation.methods.line_response import line_residuals
from identification.estimation.methods.periodic_lines import Lines
from identification.study.problem import Problem
from identification.study.residual import Point, ResidualEvaluation, output_delays, parameters_at

REPEATS = (2, 3, 5, 9, 17, 33)
SETTLED = 0.1
"""Largest change of a line from period to period, in its standard deviations (rms)."""


@dataclass(frozen=True, eq=False)
class Course:
    """Commands of so many periods that the last one is steady.

    Attributes
    ----------
    u : ndarray, shape (R N + 1, n_u)
    fine : ndarray
        Their values between the samples, as the dynamics takes them.
    """

    u: Array
    fine: Array


def settled_course(problem: Problem, lines: Lines, point: Point) -> Course:
    """Return as few periods as settle at `point`.

    Raises
    ------
    UnusableInput
        If the readings still change after the most periods.
    """
    at = np.round(lines.omega * lines.period / (2.0 * np.pi)).astype(int)
    for repeats in REPEATS:
        course = _course(problem, lines, repeats)
        run, _ = _run(problem, course, point, derivatives=False)
        last = np.fft.rfft(run[-lines.period :], axis=0)[at]
        before = np.fft.rfft(run[-2 * lines.period : -lines.period], axis=0)[at]
        moving = at > 0
        change = np.abs(last - before)[moving] ** 2 / lines.variance[moving]
        if np.mean(change) < SETTLED**2:
            return course
    raise UnusableInput(
        f"frequency_domain: {problem.graph.name} does not settle within {REPEATS[-1]} periods of "
        f"{problem.data.name} at its start values; use method='single_shooting', or guess(study)"
    )


def _course(problem: Problem, lines: Lines, repeats: int) -> Course:
    u = np.concatenate([np.tile(lines.drive, (repeats, 1)), lines.drive[:1]])
    return Course(u, problem.dynamics.fine_inputs(u, problem.n_sub, problem.data.between))


def _run(
    problem: Problem, course: Course, point: Point, *, derivatives: bool
) -> tuple[Array, Array]:
    """Return readings (R N, n_y) and their derivatives by the free parameters, from rest."""
    dynamics, n_y = problem.dynamics, len(problem.data.names)
    wanted = problem.directions if derivatives else []
    p = parameters_at(problem, point.theta)
    ready = dynamics.prepare(p, problem.data.dt, problem.n_sub, wanted, False)
    run = dynamics.run(
        ready, course.u, dynamics.rest(p, course.u[0]), course.fine, after=problem.data.reads_after
    )
    # the sample that closes a period is where the next one begins
    return run.y[1:, :n_y], run.dy[1:, :n_y]


def steady_evaluation(
    problem: Problem, lines: Lines, course: Course, point: Point, *, derivatives: bool = True
) -> ResidualEvaluation:
    """Return the residuals of the lines at `point`, as `line_evaluation` does for linear models."""
    n = lines.period
    y, dy = _run(problem, course, point, derivatives=derivatives)
    bins = np.round(lines.omega * n / (2.0 * np.pi)).astype(int)
    # the last period runs from its second sample to the first of the next one
    turn = np.exp(-1j * lines.omega[:, None] * (1.0 + output_delays(problem, point.theta)))
    shown = np.fft.rfft(y[-n:], axis=0)[bins] * turn
    by_free = np.fft.rfft(dy[-n:], axis=0)[bins] * turn[:, :, None]
    by_state = np.zeros((1, *shown.shape, 0), complex)
    return line_residuals(
        problem, lines, point, shown[None], by_free[None], by_state, derivatives=derivatives
    )
