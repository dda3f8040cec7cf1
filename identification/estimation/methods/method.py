"""What every way of fitting offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from bondgraph.support.arrays import Array
from identification.estimation.filtered import Filtered
from identification.estimation.levenberg_marquardt import Descent, FitStatus, Report, minimise
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation
from identification.study.study import SettledSetting, Study


@dataclass(frozen=True)
class FitOptions:
    """How far a fit goes.

    Attributes
    ----------
    optimiser : {"gauss_newton", "ipopt"}
    max_iterations : int
    tolerance : float
        Converged if an iteration lowers the cost by less, relatively.
    report : callable or None
        Called with the iteration and the cost.
    linear_solver : {"mumps", "spral"}
        Of IPOPT.
    """

    optimiser: str = "gauss_newton"
    max_iterations: int = 60
    tolerance: float = 1e-8
    report: Report | None = None
    linear_solver: str = "mumps"


@dataclass(frozen=True, eq=False)
class MethodSolution:
    """Where a method ended.

    Attributes
    ----------
    point : JointPoint
        Unknowns of `Study.stack` at the setting.
    covariance : ndarray, shape (n, n), or None
        Of theta, where the method has one of its own; otherwise that of the free run is taken.
    readings : tuple of ndarray, shape (N, n_y) each, or None
        Simulated readings, where they are not those of the free run.
    evaluations : tuple of ResidualEvaluation or None
        The free run at the point with its derivatives, if it is at hand.
    cost : float or None
        Mean square of the residuals over their noise, where the trace is of something else.
    filtered : Filtered or None
        What a filter saw, of a method that has one.
    run : str
        What `readings` are, in words, where they are no free run.
    """

    point: JointPoint
    status: FitStatus
    trace: tuple[float, ...]
    covariance: Array | None = None
    notes: tuple[str, ...] = ()
    readings: tuple[Array, ...] | None = None
    evaluations: tuple[ResidualEvaluation, ...] | None = None
    cost: float | None = None
    filtered: Filtered | None = None
    run: str = ""


@dataclass(frozen=True, eq=False)
class FitTask:
    """What a method is to fit: `stack` is ``study.stack(setting)``; from where and how far.

    `found` is what was simulated at the start already, with derivatives.
    """

    study: Study
    setting: SettledSetting
    stack: JointProblem
    start: JointPoint
    options: FitOptions
    found: tuple[ResidualEvaluation, ...] | None = None

    def descend(
        self, stack: JointProblem, start: JointPoint, report: Report | None = None
    ) -> Descent:
        """Minimise the misfit of a stack of the method's own; Ctrl-C keeps the best point."""
        return minimise(
            stack, start, max_iterations=self.options.max_iterations,
            tolerance=self.options.tolerance, report=report, keep_on_interrupt=True,
            found=self.found if start is self.start else None,
        )  # fmt: skip


class Method(ABC):
    """A way to fit a study; subclasses are final and stateless.

    `optimisers` names those it can use.
    """

    name: ClassVar[str]
    optimisers: ClassVar[tuple[str, ...]] = ("gauss_newton",)
    hears_noise: ClassVar[bool] = False
    """Whether the method estimates the noise itself, so that one pass is enough."""
    reads_after: ClassVar[bool] = False
    """Whether it can take readings after the steps of held commands."""

    @abstractmethod
    def check(self, study: Study) -> None:
        """Refuse what the method cannot do, in one line that names another method."""

    @abstractmethod
    def solve(self, task: FitTask) -> MethodSolution:
        """Fit from the start of the task."""
