"""Maximum likelihood on the lines of periodic records; linear models need no simulation.

Residuals are ``(Y - G(theta) U - T(theta)) / sigma`` line by line (Pintelon and Schoukens, System
Identification, 2nd ed. (2012), chapter 9), with sigma from what changes between the periods.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.covariance import inverse_information
from identification.estimation.levenberg_marquardt import Descent, minimise
from identification.estimation.methods.line_response import line_evaluation
from identification.estimation.methods.method import FitTask, Method, MethodSolution
from identification.estimation.methods.periodic_lines import Lines, lines_of, mixes, require_lines
from identification.estimation.methods.steady_response import (
    Course,
    settled_course,
    steady_evaluation,
)
from identification.study.joint import JointPoint, JointProblem
from identification.study.problem import Problem
from identification.study.residual import ResidualEvaluation, offset_scale, slots
from identification.study.study import Study

PASSES = 10
"""Steps of initial states and offsets alone, once the lines are fitted; linear models need one."""


@final
class FrequencyDomain(Method):
    """For periodic records; a run-in is left out, or fitted where it must be (linear models).

    The commands count as exact; offsets of sensors and of integrating states carry no
    information and are found afterwards. Noise must be smooth in frequency, not white. Commands
    repeat until memory runs its closed course; only that period is compared.
    """

    name: ClassVar[str] = "frequency_domain"
    reads_after: ClassVar[bool] = True

    def check(self, study: Study) -> None:
        """Refuse laws, windows, clocks of their own and records that do not repeat."""
        setting = study.first_setting
        for r in range(len(study.recordings)):
            problem = study.problem(r, setting)
            require_lines(problem)
            lines_of(problem)

    def solve(self, task: FitTask) -> MethodSolution:
        """Descend on the lines, then find states and offsets of the free run."""
        stack, start = task.stack, task.start
        lines = tuple(lines_of(p) for p in stack.problems)
        problems = tuple(_with_transient(p, f) for p, f in zip(stack.problems, lines, strict=True))
        courses = tuple(
            settled_course(p, f, stack.local(start, r)) if mixes(p) else None
            for r, (p, f) in enumerate(zip(problems, lines, strict=True))
        )
        fit = _LineStack(
            problems, stack.names, stack.columns, stack.factors, lines=lines, courses=courses
        )
        # states count from the steady course here
        states = tuple(p.rest_state[None, :] for p in problems)
        made = task.descend(fit, JointPoint(start.theta, states), task.options.report)
        covariance, notes = _covariance(fit, made)
        point = _free_run(stack, JointPoint(made.point.theta, start.states))
        readings = None
        if all(p.exact for p in stack.problems):  # otherwise sub-steps are still to be refined
            readings = tuple(e.y for e in stack.evaluate(point, derivatives=False))
        words = tuple(dict.fromkeys(f.words for f in lines))
        return MethodSolution(
            point, made.status, made.trace, covariance, (*words, *notes), readings
        )


@final
@dataclass(frozen=True, eq=False)
class _LineStack(JointProblem):
    """A stack whose residuals are those of the lines."""

    lines: tuple[Lines, ...] = ()
    courses: tuple[Course | None, ...] = ()

    def evaluate(
        self,
        point: JointPoint,
        *,
        derivatives: bool = True,
        scored: bool = False,
        limit: float = np.inf,
    ) -> tuple[ResidualEvaluation, ...]:
        """Return the residuals of all lines of all records; every line is scored, without limit."""
        found = []
        for r, (p, f, c) in enumerate(zip(self.problems, self.lines, self.courses, strict=True)):
            local = self.local(point, r)
            if c is None:
                found.append(line_evaluation(p, f, local, derivatives=derivatives))
            else:
                found.append(steady_evaluation(p, f, c, local, derivatives=derivatives))
        return tuple(found)


def _with_transient(problem: Problem, lines: Lines) -> Problem:
    """Let the whole initial state vary where a transient is fitted, and nothing of it elsewhere."""
    wanted: str | tuple[str, ...] = "free" if lines.transient else ()
    if problem.initial == wanted:
        return problem
    # the derived model is the same: it need not be derived once more
    return replace(problem, initial=wanted, built=problem.dynamics)


def _covariance(fit: _LineStack, made: Descent) -> tuple[Array, tuple[str, ...]]:
    """Inverse information, larger where the misfit exceeds the noise; offsets from line 1."""
    from scipy import stats

    try:
        covariance = inverse_information(fit, made.evaluations, made.point)
    except np.linalg.LinAlgError:
        return np.full((fit.n, fit.n), np.nan), ()
    notes: tuple[str, ...] = ()
    freedom = max(fit.count(made.evaluations) - fit.n, 1)
    excess = sum(float(e.residual @ e.residual) for e in made.evaluations) / freedom
    if excess > stats.chi2.ppf(0.999, freedom) / freedom:
        covariance = covariance * excess
        notes = (
            f"the misfit is {np.sqrt(excess):.3g} times the noise between periods: the model "
            "lacks something; intervals are widened by it",
        )
    for r, (p, f) in enumerate(zip(fit.problems, fit.lines, strict=True)):
        if f.omega[0] == 0.0:
            continue
        at = fit.columns[r][slots(p).offsets]
        spread = np.sqrt(f.variance[0] / f.y.shape[0]) / f.period / offset_scale(p)
        covariance[at, :] = covariance[:, at] = 0.0
        covariance[at, at] = spread**2
    return covariance, notes


def _free_run(stack: JointProblem, point: JointPoint) -> JointPoint:
    """Fit initial states and, where they are free, offsets to the free run, all else held."""
    each = zip(stack.problems, stack.columns, strict=True)
    offsets = {int(i) for p, at in each for i in at[slots(p).offsets]}
    held = {i: float(t) for i, t in enumerate(point.theta) if i not in offsets}
    return minimise(replace(stack, held=held), point, max_iterations=PASSES, tolerance=1e-6).point
