"""Fitted numbers with their 95 % intervals, from scaled unknowns and their covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
        for j, (value, unit, slope, free) in enumerate(_meanings(p, stack.local(point, r).theta)):
            i = int(at[j])
            if i in done:
                continue
            done.add(i)
            t, reach = float(point.theta[i]), 1.96 * float(sd[i])
            if free is not None:
                reach = _of_a_log(float(sd[i])) if free.log else reach
                low, high = t - reach, t + reach
                if free.log:  # wide intervals stay within what a double holds
                    low, high = max(low, -700.0), min(high, 700.0)
                ends = sorted((free.value(low), free.value(high)))
                nuisance = free.parameter.name in p.added
            elif upper[i] > lower[i]:
                half = reach * abs(slope * float(factor[j]))
                declared = range(slots(p).size)[slots(p).delays]
                ends, nuisance = [value - half, value + half], j not in declared
            else:
                continue
            hit = bool(t <= lower[i] + 1e-9 or t >= upper[i] - 1e-9)
            entry = Estimate(stack.names[i], value, unit, (ends[0], ends[1]), hit)
            (nuisances if nuisance else found).append(entry)
    return tuple(found), tuple(nuisances)


def _of_a_log(sd: float) -> float:
    """Return how far the logarithm of a value reaches: no farther than the value itself does.

    Beyond a factor of twenty either way its distribution is one of the value, or of its inverse.
    """
    return max(1.96 * min(sd, 3.0), float(np.log1p(1.96 * sd)) if np.isfinite(sd) else 700.0)


def _meanings(p: Problem, theta: Array) -> list[tuple[float, str, float, Free | None]]:
    """Value (SI), unit and slope of each local unknown, in the order of `slots`."""
    at, dt, scale = slots(p), p.data.dt, offset_scale(p)
    units = [getattr(p.graph[n], "unit", "") for n in p.data.names]
    found: list[tuple[float, str, float, Free | None]] = [
        (f.value(float(t)), f.parameter.unit, 1.0, f) for f, t in zip(p.free, theta, strict=False)
    ]
    found += [(float(t) * dt, "s", dt, None) for t in theta[at.lags]]
    found += [
        (float(t) * dt, "1" if n in p.skews else "s", dt, None)
        for n, t in zip(p.delays, theta[at.delays], strict=True)
    ]
    found += [
        (float(t) * s, u, float(s), None)
        for t, s, u in zip(theta[at.offsets], scale, units, strict=True)
    ]
    found += [(float(t) * p.clock, "1", p.clock, None) for t in theta[at.clocks]]
    return found
