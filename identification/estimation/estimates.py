"""Fitted numbers with their 95 % intervals, from scaled unknowns and their covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.graph.parameter import Parameter
from bondgraph.support.arrays import Array
from identification.study.joint import JointPoint, JointProblem
from identification.study.problem import Problem
from identification.study.residual import offset_scale, slots
from identification.study.scaled import Free


@dataclass(frozen=True)
class Estimate:
    """A fitted number with its 95 % interval.

    Examples
    --------
    >>> fit.estimates[0].name, fit.estimates[0].unit
    ('m', 'kg')
    >>> low, high = fit.estimates[0].ci95
    >>> low < 0.54 < high
    True
    """

    name: str
    value: float
    unit: str
    ci95: tuple[float, float]
    at_bound: bool = False


def estimates_of(
    stack: JointProblem, point: JointPoint, covariance: Array
) -> tuple[tuple[Estimate, ...], tuple[Estimate, ...]]:
    """Return parameters and nuisances with their 95 % intervals.

    Parameters
    ----------
    covariance : ndarray, shape (n, n)
        Of theta.
    """
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    lower, upper = stack.bounds
    done: set[int] = set()
    found: list[Estimate] = []
    nuisances: list[Estimate] = []
    for r, p in enumerate(stack.problems):
        at, factor = stack.columns[r], stack.factors[r]
        of_parameters = (slots(p).free, slots(p).delays)
        for j, free in enumerate(meanings(p)):
            i = int(at[j])
            if i in done or not (j < len(p.free) or upper[i] > lower[i]):
                continue
            done.add(i)
            theta, by = float(point.theta[i]), float(factor[j])
            reach = _of_a_log(float(sd[i])) if free.log else 1.96 * by * float(sd[i])
            low, high = by * theta - reach, by * theta + reach
            if free.log:  # wide intervals stay within what a double holds
                low, high = max(low, -700.0), min(high, 700.0)
            ends = sorted((free.value(low), free.value(high)))
            hit = bool(theta <= lower[i] + 1e-9 or theta >= upper[i] - 1e-9)
            entry = Estimate(
                stack.names[i], free.value(by * theta), free.parameter.unit, (ends[0], ends[1]), hit
            )
            inside = any(s.start <= j < s.stop for s in of_parameters)
            of_model = inside and free.parameter.name not in p.added
            (found if of_model else nuisances).append(entry)
    return tuple(found), tuple(nuisances)


def _of_a_log(sd: float) -> float:
    """Return how far the logarithm of a value reaches: no farther than the value itself does.

    Beyond a factor of twenty either way its distribution is one of the value, or of its inverse.
    """
    return max(1.96 * min(sd, 3.0), float(np.log1p(1.96 * sd)) if np.isfinite(sd) else 700.0)


def meanings(p: Problem) -> list[Free]:
    """Return what each local unknown is, in the order of `slots`."""

    def plain(name: str, unit: str, size: float) -> Free:
        return Free(Parameter(name, 0.0, unit), 0.0, False, float(size))

    names, dt = p.data.names, p.data.dt
    found = [*p.free, *(plain(f"delay {n}", "s", dt) for n in names)]
    found += [plain(n, "1" if n in p.skews else "s", dt) for n in p.delays]
    for n, size in zip(names, offset_scale(p), strict=True):
        found.append(plain(f"offset {n}", getattr(p.graph[n], "unit", ""), size))
    return found + [plain(f"clock {n}", "1", p.clock) for n in names if p.clock]
