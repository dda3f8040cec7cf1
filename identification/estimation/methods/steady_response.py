"""Residuals of spectral lines of models with laws: the commands repeat until the readings do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from identification.estimation.methods.line_response import line_rows
from identification.estimation.methods.periodic_lines import Lines
from identification.study.problem import Problem
from identification.study.residual import (
    Point,
    ResidualEvaluation,
    offset_scale,
    output_delays,
    parameters_at,
    slots,
)

Array = NDArray[np.float64]
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
        Their values between the samples, as the engine takes them.
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
    return Course(u, problem.engine.fine_inputs(u, problem.n_sub, problem.data.hold))


def _run(
    problem: Problem, course: Course, point: Point, *, derivatives: bool
) -> tuple[Array, Array]:
    """Return readings (R N, n_y) and their derivatives by the free parameters, from rest."""
    engine, n_y = problem.engine, len(problem.data.names)
    names = engine.parameter_names
    wanted = [names.index(f.parameter.name) for f in problem.free] if derivatives else []
    p = parameters_at(problem, point.theta)
    ready = engine.prepare(p, problem.data.dt, problem.n_sub, wanted, False)
    run = engine.run(ready, course.u, engine.rest(p, course.u[0]), course.fine)
    # the sample that closes a period is where the next one begins
    return run.y[1:, :n_y], run.dy[1:, :n_y]


def steady_evaluation(
    problem: Problem, lines: Lines, course: Course, point: Point, *, derivatives: bool = True
) -> ResidualEvaluation:
    """Return the residuals of the lines at `point`, as `line_evaluation` does for linear models."""
    at, n, n_y = slots(problem), lines.period, len(problem.data.names)
    y, dy = _run(problem, course, point, derivatives=derivatives)
    bins = np.round(lines.omega * n / (2.0 * np.pi)).astype(int)
    # the last period runs from its second sample to the first of the next one
    turn = np.exp(-1j * lines.omega[:, None] * (1.0 + output_delays(problem, point.theta)))
    shown = np.fft.rfft(y[-n:], axis=0)[bins] * turn
    scale = offset_scale(problem)
    mean = lines.omega == 0.0
    offsets = point.theta[at.offsets] * scale * n
    residual = line_rows(lines, lines.y - (shown + mean[:, None] * offsets)[None])
    if not derivatives:
        return ResidualEvaluation(np.zeros((0, n_y)), residual, np.zeros((residual.size, 0)), [])
    slopes = np.array([f.slope(float(t)) for f, t in zip(problem.free, point.theta, strict=False)])
    block = np.zeros((1, bins.size, n_y, at.size), complex)
    tangent = np.fft.rfft(dy[-n:], axis=0)[bins]
    block[0, :, :, at.free] = tangent * turn[:, :, None] * slopes
    by_lag = -1j * lines.omega[:, None] * shown
    for c in range(n_y):
        block[0, :, c, at.lags.start + c] = by_lag[:, c]
        block[0, mean, c, at.offsets.start + c] = scale[c] * n
    for j, outputs in enumerate(problem.delays.values()):
        for c in outputs:
            block[0, :, c, at.delays.start + j] = by_lag[:, c]
    states = np.zeros((residual.size, 0))
    return ResidualEvaluation(
        np.zeros((0, n_y)), residual, line_rows(lines, block), [(slice(0, residual.size), states)]
    )
