"""IPOPT on a programme of collocation: warm starts, the best point kept, Ctrl-C heard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.interrupts import Interrupts, interrupts
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.methods.method import FitOptions
from identification.estimation.methods.radau import STAGES
from identification.estimation.methods.transcription import Programme

LARGE = 1e19
ENDED = {
    "Solve_Succeeded": FitStatus.CONVERGED, "Solved_To_Acceptable_Level": FitStatus.CONVERGED,
    "Maximum_Iterations_Exceeded": FitStatus.ITERATIONS,
    "Maximum_WallTime_Exceeded": FitStatus.ITERATIONS,
}  # fmt: skip
"""What IPOPT says, in the words of a fit; all else is no progress."""
LONGEST = 600.0
"""Time of one run, s."""
FEASIBLE = 1e-6
"""Gap of the constraints below which the cost alone decides which point is best."""


def ipopt_settings(linear_solver: str) -> dict[str, Any]:
    """Return what every run of IPOPT here has: quiet, strict bounds, failures told by status."""
    return {
        "ipopt.linear_solver": linear_solver,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "print_time": False,
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.fixed_variable_treatment": "make_parameter",
        "error_on_fail": False,
    }


@dataclass(frozen=True, eq=False)
class Found:
    """Unknowns and multipliers where IPOPT ended, with the parameters of that programme."""

    w: Array
    p: Array
    multipliers: Array
    bounds: Array
    status: FitStatus
    cost: float

    @property
    def done(self) -> bool:
        """Whether IPOPT converged."""
        return self.status is FitStatus.CONVERGED


class Runner:
    """IPOPT for one programme."""

    def __init__(self, made: Programme, options: FitOptions, trace: list[float]) -> None:
        self.made, self.options, self.trace = made, options, trace
        self.problem = {"x": made.w, "p": made.p, "f": made.f, "g": made.g}
        self.watch = _Watch(self, made.w.numel(), made.g.numel(), made.p.numel())
        lower, upper = made.stack.bounds
        free = np.full(made.w.numel() - made.stack.n, LARGE)
        self.lower = np.concatenate([np.maximum(lower, -LARGE), -free])
        self.upper = np.concatenate([np.minimum(upper, LARGE), free])
        self.hold()
        settings: dict[str, Any] = {
            **ipopt_settings(options.linear_solver),
            "ipopt.max_iter": max(options.max_iterations, 1),
            "ipopt.max_wall_time": LONGEST,
            "ipopt.tol": min(options.tolerance, 1e-8),
            "iteration_callback": self.watch,
        }
        self.first = ca.nlpsol("collocation", "ipopt", self.problem, settings)
        settings["jac_g"] = self.first.get_function("nlp_jac_g")
        settings["hess_lag"] = self.first.get_function("nlp_hess_l")
        again = settings | {"ipopt.warm_start_init_point": "yes", "ipopt.mu_init": 1e-7}
        self.again = ca.nlpsol("collocation_again", "ipopt", self.problem, again)

    def hold(self) -> None:
        """Fix the known initial states by their bounds; `run` fills in the values."""
        at, self.known = self.made.stack.n, []
        for record in self.made.records:
            problem = record.problem
            if problem.initial != "rest":
                for i in range(record.step.n_x):
                    if record.order[i] not in problem.free_states:
                        self.known.append(at + i)
            at += record.size * (1 + STAGES * record.steps)

    def run(self, w: Array, allowed: list[Array], last: Found | None = None) -> Found:
        """Solve from `w`, warm after `last`, with defects (n_x, steps) allowed to the steps."""
        made = self.made
        p = made.parameters(allowed, w[: made.stack.n])
        self.lower[self.known] = self.upper[self.known] = w[self.known]
        self.watch.best, self.watch.interrupted = None, False
        solver, extra = self.first, {}
        if last is not None:
            solver, extra = self.again, {"lam_g0": last.multipliers, "lam_x0": last.bounds}
        limits: dict[str, Any] = {"lbx": self.lower, "ubx": self.upper, "lbg": 0.0, "ubg": 0.0}
        try:
            with interrupts() as self.watch.flag:
                out = solver(x0=w, p=p, **limits, **extra)
        except (KeyboardInterrupt, RuntimeError):
            if not self.watch.interrupted and self.watch.best is None:
                raise
            return self._kept(w, p, FitStatus.CANCELLED)
        said = solver.stats()["return_status"]
        found, multipliers = out["x"].full().ravel(), out["lam_g"].full().ravel()
        cost = 2.0 * float(out["f"])
        heard = self.watch.interrupted or self.watch.flag.heard
        if heard or said == "User_Requested_Stop":
            return self._kept(w, p, FitStatus.CANCELLED)
        status = ENDED.get(said, FitStatus.NO_PROGRESS)
        if status is not FitStatus.CONVERGED:
            return self._kept(found, p, status)
        return Found(found, p, multipliers, out["lam_x"].full().ravel(), status, cost)

    def _kept(self, w: Array, p: Array, status: FitStatus) -> Found:
        """Return the best point seen, or `w`."""
        best = w if self.watch.best is None else self.watch.best[1]
        cost = np.inf if self.watch.best is None else self.watch.best[0]
        return Found(best, p, np.zeros(0), np.zeros(0), status, cost)


class _Watch(ca.Callback):
    """Called after every iteration: keeps the best point, hears Ctrl-C."""

    def __init__(self, runner: Runner, n: int, n_g: int, n_p: int) -> None:
        super().__init__()
        self.runner, self.sizes = runner, (n, 1, n_g, n, n_g, n_p)
        self.best: tuple[float, Array, float] | None = None
        self.interrupted = False
        self.flag = Interrupts()
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> Any:
        return ca.Sparsity.dense(self.sizes[i], 1)

    def eval(self, arguments: Any) -> Any:
        try:
            cost = 2.0 * float(arguments[1])
            gap = float(np.abs(arguments[2].full()).max(initial=0.0))
            self._heard(cost, gap, arguments[0])
            return [int(self.flag.heard)]
        except KeyboardInterrupt:
            self.interrupted = True
            return [1]

    def _heard(self, cost: float, gap: float, w: Any) -> None:
        runner = self.runner
        worth = max(gap, FEASIBLE)
        if self.best is None or (worth, cost) <= (self.best[2], self.best[0]):
            self.best = (cost, w.full().ravel(), worth)
        if np.isfinite(cost):
            runner.trace.append(cost)
        if runner.options.report is not None:
            runner.options.report(len(runner.trace) - 1, cost)
