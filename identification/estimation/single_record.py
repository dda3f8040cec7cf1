"""Fit of one record: values with intervals, nuisances, residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.covariance import inverse_information, sandwich
from identification.estimation.estimates import Estimate, estimates_of
from identification.estimation.levenberg_marquardt import FitStatus, minimise
from identification.estimation.threads import calm
from identification.study.joint import JointPoint, JointProblem, held_out_states, stack_of
from identification.study.problem import Problem
from identification.study.residual import Point, evaluate, start_point, values_at, windows


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit.

    Attributes
    ----------
    cost : float
        Mean square of the weighted training residuals (1 = at the noise floor).
    simulated : ndarray, shape (N, n_y), SI
        Readings of the fitted model on the whole record.
    """

    problem: Problem
    point: Point
    status: FitStatus
    cost: float
    iterations: int
    simulated: Array

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Fitted parameters with their intervals; most fits of a search are never asked."""
        return self._intervals[0]

    @property
    def nuisances(self) -> tuple[Estimate, ...]:
        """Lags and offsets of the readings, and offsets of the commands, with their intervals."""
        return self._intervals[1]

    @cached_property
    def _intervals(self) -> tuple[tuple[Estimate, ...], tuple[Estimate, ...]]:
        return ((), ()) if self.status is FitStatus.BROKEN else _intervals(self)

    def residuals(self, part: str) -> Array:
        """Measured less simulated on ``train`` or ``test``, shape (n, n_y), SI."""
        m = self.problem.data.mask(part)
        return np.asarray(self.problem.data.readings[m] - self.simulated[m])

    def rmse(self, part: str) -> dict[str, float]:
        """Root mean square error of each reading, SI."""
        r = self.residuals(part)
        return {
            n: float(np.sqrt(np.mean(r[:, c] ** 2))) for c, n in enumerate(self.problem.data.names)
        }

    def chi2(self, part: str) -> float:
        """Mean square residual over the noise floor, all readings."""
        return float(np.mean((self.residuals(part) / self.problem.data.floor) ** 2))

    @property
    def values(self) -> dict[str, float]:
        """All model parameters by name, declared delays (s) included."""
        return values_at(self.problem, self.point.theta)

    def __repr__(self) -> str:
        """Short text."""
        return f"Fit({self.problem.graph.name!r}, {self.status.value}, cost {self.cost:.4g})"


def fit(
    problem: Problem, *, max_iterations: int = 40, start: Point | None = None, judged: bool = True
) -> Fit:
    """Fit `problem` by output error.

    Priors keep what the data do not determine near its start value: a factor 20 on logarithmic
    parameters, ten scales on others; they weigh nothing where the data speak. Unless it is `judged`
    (or that is made up for), held-out windows have no readings, and begin where they did.
    """
    stack = stack_of((problem,))
    begin = stack.start() if start is None else stack.gathered([start])
    made = minimise(stack, begin, max_iterations=max_iterations, whole=not _parted(problem))
    point, e = stack.local(made.point, 0), made.evaluations[0]
    if made.status is FitStatus.BROKEN:
        return Fit(problem, point, made.status, np.inf, 0, e.y)
    if not np.isfinite(e.jacobian).all():
        raise np.linalg.LinAlgError("derivatives are not finite where the fit ended")
    found = Fit(problem, point, made.status, e.cost, made.iterations, e.y)
    return judge(found) if judged else found


def judge(made: Fit) -> Fit:
    """Return a fit with readings in held-out windows, each from the state that suits it best.

    A record in one piece begins where its training samples say.
    """
    problem = made.problem
    if not _parted(problem):
        return made
    train, test, spans = problem.data.mask("train"), problem.data.mask("test"), windows(problem)
    among = {i for i, w in enumerate(spans) if test[w].any() or not train[w].any()}
    point = held_out_states(problem, made.point)
    y, there = made.simulated.copy(), evaluate(problem, point, derivatives=False, among=among).y
    for i in among:
        y[spans[i]] = there[spans[i]]
    return replace(made, point=point, simulated=y)


def _parted(problem: Problem) -> bool:
    return problem.window is not None or bool(problem.data.breaks)


def start_cost(problem: Problem) -> float:
    """Misfit at the start values, for choosing among many; infinite when it cannot be simulated."""
    stack = stack_of((problem,))
    lower, upper = stack.bounds
    point = start_point(problem)
    point = replace(point, theta=np.clip(point.theta, lower, upper))
    e = evaluate(problem, point, derivatives=False, scored=True)
    r = e.residual - np.mean(e.residual) if e.residual.size else e.residual
    cost = float(np.mean(r**2)) if r.size else np.inf
    return cost if np.isfinite(cost) else np.inf


def _intervals(made: Fit) -> tuple[tuple[Estimate, ...], tuple[Estimate, ...]]:
    """Values with the larger of two intervals, information and block sandwich.

    A misfit that has not been explained yet may have any colour.
    """
    stack, point = alone(made)
    stack = stack.loose(point)
    with calm():
        now = stack.evaluate(point)
        try:
            inverse = inverse_information(stack, now, point)
            robust = sandwich(stack, now, point, inverse)
        except np.linalg.LinAlgError:  # a run that nearly overflowed tells its values alone
            return estimates_of(stack, point, np.diag(np.full(stack.n, np.inf)))
    return estimates_of(stack, point, np.diag(np.maximum(np.diag(inverse), np.diag(robust))))


def alone(made: Fit) -> tuple[JointProblem, JointPoint]:
    """Return a fit as a joint one of a single record, for what asks joint fits."""
    stack = stack_of((made.problem,))
    return stack, stack.gathered([made.point])


def best(fits: list[Fit]) -> Fit:
    """Fit with the lowest training cost."""
    return min(fits, key=lambda f: f.cost)
