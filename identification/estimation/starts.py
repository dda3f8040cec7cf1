"""Many starts: the same fit from points spread over the bounds, on whatever joblib runs on."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from joblib import delayed

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.parallel import ending, results
from bondgraph.support.spelled import spelled
from identification.estimation.estimate import Progress, estimate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.methods import METHODS, FitOptions, FitTask
from identification.estimation.result import Estimation
from identification.estimation.threads import calm
from identification.statistics.sobol import sobol
from identification.study.joint import JointPoint, JointProblem
from identification.study.study import Study

WIDE = float(np.log(10.0))
"""Reach of a logarithmic parameter without bounds: a decade either way."""
WIDE_SCALES = 2.0
SAME = 1e-3


@dataclass(frozen=True, eq=False)
class Arrival:
    """One start and where it led.

    Attributes
    ----------
    index : int
        Number of the start; 0 is the declared one.
    start, theta : ndarray, shape (n,)
        Scaled unknowns at the start and at the end.
    states : tuple of ndarray
    cost : float
        Mean square of the weighted residuals; infinite if it could not be simulated.
    """

    index: int
    start: Array
    theta: Array
    states: tuple[Array, ...]
    cost: float
    status: FitStatus


@dataclass(frozen=True, eq=False)
class Starts:
    """All arrivals, best first, and the best one fitted to the end.

    Attributes
    ----------
    arrivals : tuple of Arrival
    best : Estimation
    wanted : int
        Starts asked for; more than `arrivals` only if it was cancelled.
    names : tuple of str
        Labels of the unknowns.

    Examples
    --------
    >>> starts = many_starts(study, 4, jobs=1)
    >>> len(starts.arrivals)
    4
    """

    arrivals: tuple[Arrival, ...]
    best: Estimation
    wanted: int
    names: tuple[str, ...]
    seconds: float = 0.0

    @property
    def costs(self) -> Array:
        """Cost of each arrival, rising: the waterfall."""
        return np.array([a.cost for a in self.arrivals])

    @property
    def agreeing(self) -> int:
        """How many starts ended within a thousandth of the best cost."""
        costs = self.costs
        return int(np.sum(costs <= costs[0] * (1 + SAME))) if costs.size else 0

    def __str__(self) -> str:
        """Short text."""
        done = len(self.arrivals)
        failed = int(np.sum(~np.isfinite(self.costs)))
        cut = f" (cancelled after {done} of {self.wanted})" if done < self.wanted else ""
        lost = f", {failed} could not be simulated" if failed else ""
        return (
            f"{self.agreeing} of {done} starts reached the best cost {self.costs[0]:.6g}"
            f"{lost}{cut}; {self.seconds:.1f} s"
        )


@spelled
def many_starts(
    study: Study,
    count: int = 32,
    *,
    method: str = "single_shooting",
    seed: int = 0,
    jobs: int = -1,
    max_iterations: int = 40,
    progress: Progress | None = None,
) -> Starts:
    """Fit from `count` points of a scrambled Sobol sequence over the bounds.

    Parameters without bounds are spread over a decade either way (positive ones) or two scales.
    The first start is the declared one. Runs on the joblib backend in force, so that loky, dask
    or ray carry it: ``with joblib.parallel_config(backend="dask"): many_starts(study)``. Results
    carry their number: none is lost or counted twice when a worker dies and its task runs again.

    Parameters
    ----------
    seed : int
        Of the sequence; the result does not depend on the workers.
    jobs : int
        Processes; -1 for all cores.

    Raises
    ------
    UnusableInput
        If no start can be simulated, or `count` is not positive.

    Examples
    --------
    >>> starts = many_starts(study, 4, jobs=1)
    >>> round(starts.best.values["m"], 2)
    0.54
    """
    begin = time.perf_counter()
    if count < 1:
        raise UnusableInput(f"many_starts: {count} starts; give at least 1")
    if jobs == 0 or seed < 0:
        raise UnusableInput(
            f"many_starts: jobs = {jobs}, seed = {seed}; give jobs=-1 for all cores or a number of "
            "processes, and a seed of at least 0"
        )
    require_known("method", "many_starts", METHODS, method)
    METHODS[method].check(study)
    stack = study.stack()
    points = _spread(stack, count, seed)
    say = progress or (lambda text, fraction: None)
    found: dict[int, Arrival] = {}
    tasks = (delayed(_one)(study, method, i, p, max_iterations) for i, p in enumerate(points))
    try:
        with ending():
            for arrival in results(tasks, jobs):
                found[arrival.index] = arrival
                least = min(a.cost for a in found.values())
                say(f"start {len(found)} of {count}, best {least:.6g}", 0.9 * len(found) / count)
    except KeyboardInterrupt:
        if not found:
            raise
    ranked = tuple(sorted(found.values(), key=lambda a: (a.cost, a.index)))
    if not ranked or not np.isfinite(ranked[0].cost):
        raise UnusableInput(
            f"{study.graph.name}: none of {len(ranked)} starts gives a finite simulation; give "
            "bounds that keep the model stable, or method='multiple_shooting'"
        )
    # the best goes on from where it arrived, its initial states, offsets and lags included
    first = JointPoint(ranked[0].theta, ranked[0].states)
    best = estimate(study, method, start=first, progress=progress)
    return Starts(ranked, best, count, stack.names, time.perf_counter() - begin)


def _spread(stack: JointProblem, count: int, seed: int) -> Array:
    """Points in theta, shape (count, n); nuisances stay at zero."""
    begin = stack.start().theta
    lower, upper = stack.bounds
    free = np.zeros(stack.n, bool)
    reach = np.full(stack.n, WIDE_SCALES)
    free[list(stack.of_model)] = True
    reach[[i for i, f in stack.free.items() if f.log]] = WIDE
    low = np.maximum(lower, begin - reach)
    high = np.minimum(upper, begin + reach)
    bounded = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 20.0)
    low, high = np.where(bounded, lower, low), np.where(bounded, upper, high)
    unit = sobol(count, int(free.sum()), seed) if free.any() else np.zeros((count, 0))
    points = np.tile(begin, (count, 1))
    points[:, free] = low[free] + unit * (high - low)[free]
    points[0] = begin
    return points


def _one(study: Study, method: str, index: int, theta: Array, max_iterations: int) -> Arrival:
    with calm():
        stack = study.stack()
        begin = JointPoint(theta, stack.start().states)
        options = FitOptions(max_iterations=max_iterations, tolerance=1e-6)
        made = METHODS[method].solve(FitTask(study, study.first_setting, stack, begin, options))
        found = stack.evaluate(made.point, derivatives=False)
        cost = stack.cost(found, made.point)
    return Arrival(
        index, theta, made.point.theta, made.point.states,
        cost if np.isfinite(cost) else np.inf, made.status,
    )  # fmt: skip
