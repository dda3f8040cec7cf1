"""IPOPT on the same residuals: exact gradient, Gauss-Newton Hessian, bounds inside the solver."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.levenberg_marquardt import Descent, FitStatus
from identification.estimation.methods.interior_point import ENDED, LARGE, ipopt_settings
from identification.estimation.methods.method import FitOptions
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation


def minimise_with_ipopt(stack: JointProblem, start: JointPoint, options: FitOptions) -> Descent:
    """Minimise the misfit of `stack`; unknowns are theta, initial states stay eliminated.

    Each call of the objective moves the initial states to their best values for its theta (one
    linear step from the last ones), which is variable projection inside IPOPT.
    """
    watch = _Watch(stack, start, options)
    if not np.isfinite(watch.cost):
        return Descent(watch.point, watch.found, FitStatus.BROKEN, np.inf, (np.inf,))
    n = stack.n
    column, row, scalar = ca.Sparsity.dense(n, 1), ca.Sparsity.dense(1, n), ca.Sparsity.dense(1, 1)

    def cost(_: Any) -> list[Any]:
        return [0.5 * stack.cost(watch.found, watch.point)]

    def slope(arguments: Any) -> list[Any]:
        return [*cost(arguments), watch.derivatives()[0][None, :]]

    def bend(arguments: Any) -> list[Any]:
        return [ca.triu(ca.DM(float(arguments[2]) * watch.derivatives()[1]))]

    # CasADi keeps no reference to what it calls back
    empty, upper_half = ca.Sparsity(0, 0), ca.Sparsity.upper(n)
    objective = _Called(watch, "objective", [column], [scalar], cost)
    gradient = _Called(watch, "gradient", [column, empty], [scalar, row], slope)
    hessian = _Called(
        watch, "hessian", [column, empty, scalar, ca.Sparsity(0, 1)], [upper_half], bend
    )
    x = ca.MX.sym("x", n)
    lower, upper = stack.bounds
    settings: dict[str, Any] = {
        **ipopt_settings(options.linear_solver),
        "ipopt.max_iter": options.max_iterations,
        "ipopt.tol": options.tolerance,
        "ipopt.acceptable_tol": 100 * options.tolerance,
        "grad_f": gradient,
        "no_nlp_grad": True,
        "hess_lag": hessian,
    }
    problem: dict[str, Any] = {"x": x, "f": objective(x)}
    solver, said = ca.nlpsol("fit", "ipopt", problem, settings), ""
    try:
        solver(x0=watch.point.theta, lbx=np.maximum(lower, -LARGE), ubx=np.minimum(upper, LARGE))
        said = solver.stats()["return_status"]
        if said == "User_Requested_Stop":  # CasADi hears Ctrl-C between the calls
            watch.interrupted = True
    except (KeyboardInterrupt, RuntimeError):
        if not watch.interrupted:
            raise
    ended = ENDED.get(said, FitStatus.NO_PROGRESS)
    status = FitStatus.CANCELLED if watch.interrupted else ended
    return Descent(watch.best, stack.evaluate(watch.best), status, watch.cost, tuple(watch.trace))


class _Watch:
    """Evaluations at theta, with the best point seen."""

    def __init__(self, stack: JointProblem, start: JointPoint, options: FitOptions) -> None:
        lower, upper = stack.bounds
        self.stack, self.options = stack, options
        self.point = JointPoint(np.clip(start.theta, lower, upper), start.states)
        self.found: tuple[ResidualEvaluation, ...] = stack.evaluate(self.point)
        self.cost = stack.cost(self.found, self.point)
        self.best, self.trace = self.point, [self.cost]
        self.count = max(stack.count(self.found), 1)
        self.interrupted = False

    def at(self, theta: Array) -> None:
        """Evaluate at theta, the states following linearly."""
        if np.array_equal(theta, self.point.theta):
            return
        try:
            system = self.stack.normal(self.found, self.point)
            states = self.stack.followed(system, self.point, theta - self.point.theta)
            self.point = JointPoint(theta.copy(), states)
            self.found = self.stack.evaluate(self.point)
            cost = self.stack.cost(self.found, self.point)
            if np.isfinite(cost) and cost < self.trace[-1]:
                self.cost, self.best = cost, self.point
                self.trace.append(cost)
                if self.options.report is not None:
                    self.options.report(len(self.trace) - 1, cost)
        except KeyboardInterrupt:
            self.interrupted = True
            raise

    def derivatives(self) -> tuple[Array, Array]:
        """Gradient and Gauss-Newton Hessian of half the sum of squares over the count."""
        system = self.stack.normal(self.found, self.point)
        factor, right = system.factor, system.right
        return -(factor.T @ right) / self.count, factor.T @ factor / self.count


class _Called(ca.Callback):
    """A function of theta, its first argument, that CasADi calls back."""

    def __init__(
        self,
        watch: _Watch,
        name: str,
        takes: Sequence[Any],
        gives: Sequence[Any],
        value: Callable[[Any], list[Any]],
    ) -> None:
        super().__init__()
        self.watch, self.takes, self.gives, self.value = watch, takes, gives, value
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self.takes)

    def get_n_out(self) -> int:
        return len(self.gives)

    def get_sparsity_in(self, i: int) -> Any:
        return self.takes[i]

    def get_sparsity_out(self, i: int) -> Any:
        return self.gives[i]

    def eval(self, arguments: Any) -> Any:
        self.watch.at(np.asarray(arguments[0]).ravel())
        return self.value(arguments)
