"""When commands are taken to behave otherwise between samples than they usually do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.covariance import information_root, sandwich
from identification.estimation.estimates import Estimate
from identification.report.numbers import quantity
from identification.report.words import listed
from identification.study.joint import JointPoint, JointProblem
from identification.study.problem import Problem
from identification.study.read_after import READ_AFTER
from identification.study.residual import ResidualEvaluation, slots

CLEARLY = 0.97
"""Part of the misfit (mean square) that another behaviour leaves at most: half a sample more or
less of a lag changes nearly as much."""
UNSURE = 4.0
"""Squared standard errors by which delays of one behaviour have to be less than of another."""


def possible(holds: Iterable[str], *problems: Problem) -> tuple[str, ...]:
    """Return behaviours that a model allows: an input that jumps has no rate.

    Before or after a step is the same to a reading that does not jump with it.

    Parameters
    ----------
    holds : iterable of str
        Of `identification.study.read_after.BEHAVIOURS`.
    """
    holds, none = tuple(holds), set[str]()
    if any(p.dynamics.input_rates for p in problems):
        none = {"hold", READ_AFTER}
    elif READ_AFTER in holds and not any(p.passing.any() for p in problems):
        none = {READ_AFTER}
    return tuple(h for h in holds if h not in none)


def tied(costs: Mapping[str, float]) -> tuple[str, ...]:
    """Return the behaviours that no other one speaks against.

    Examples
    --------
    >>> tied({"hold": 1.0, "linear": 0.99, "band-limited": 1.2})
    ('hold', 'linear')
    """
    least = min(costs.values())
    return tuple(h for h, cost in costs.items() if least >= CLEARLY * cost)


def chosen(costs: Mapping[str, float], usual: str, late: Mapping[str, float] | None = None) -> str:
    """Return the behaviour with the least misfit if that speaks against the usual one.

    Of those that fit equally well the one is right that needs no delay: half a sample more or less
    of every sensor is another behaviour.

    Parameters
    ----------
    costs : mapping of str to float
        Mean square misfit of a fit with each behaviour.
    usual : str
        Kept unless another is clearly better; linear is the next.
    late : mapping of str to float, optional
        `lateness` of these fits; none where it is left out.

    Examples
    --------
    >>> chosen({"hold": 1.0, "linear": 0.9}, "hold"), chosen({"hold": 1.0, "linear": 0.99}, "hold")
    ('linear', 'hold')
    >>> chosen({"hold": 1.0, "linear": 0.99}, "linear", {"hold": 0.5, "linear": 9.0})
    'hold'
    """
    needs = {h: (late or {}).get(h, 0.0) for h in tied(costs)}
    fair = [h for h, delay in needs.items() if delay <= min(needs.values()) + UNSURE]
    plain = [h for h in (usual, "linear") if h in fair]
    return plain[0] if plain else min(fair, key=lambda hold: costs[hold])


def lateness(stack: JointProblem, found: Sequence[ResidualEvaluation], point: JointPoint) -> float:
    """Return the squared standard errors of the delays that the sensors ask for, all together.

    They are those of a step that knows no bounds: a delay that is stopped asks for more than it
    has. The larger of two variances counts, as in intervals: what is left may have any colour.
    """
    lower, upper = stack.bounds
    lags = [c[slots(p).lags] for p, c in zip(stack.problems, stack.columns, strict=True)]
    at = np.unique(np.concatenate(lags)).astype(int)
    at = at[upper[at] > lower[at]]
    if not at.size:
        return 0.0
    try:
        system = stack.normal(found, point)
        root = information_root(stack, system.factor)
        asked = (point.theta + root @ system.right)[at]
        inverse = root @ root.T
        both = inverse, sandwich(stack, found, point, inverse)
        return min(_squared(asked, c[np.ix_(at, at)]) for c in both)
    except np.linalg.LinAlgError:
        return np.inf


def _squared(delays: Array, covariance: Array) -> float:
    return float(delays @ np.linalg.pinv(covariance, hermitian=True) @ delays)


def beyond(own: Iterable[Estimate], other: Iterable[Estimate]) -> str:
    """Return the values of another fit that lie beyond the intervals of this one, in words."""
    values = {e.name: e for e in other}
    found = [
        values[e.name] for e in own
        if e.name in values and not e.ci95[0] <= values[e.name].value <= e.ci95[1]
    ]  # fmt: skip
    said = listed([f"{e.name} = {quantity(e.value, e.unit)}" for e in found[:NAMED]])
    return f"{said}, beyond the 95 % interval" if found else ""


NAMED = 3
"""Values that are named."""


def usual(commands: Iterable[Array]) -> str:
    """Return how commands behave between samples where nothing else tells.

    A converter holds: what stays the same over many samples and then jumps was no ramp.

    Examples
    --------
    >>> usual([np.repeat([0.0, 1.0, 3.0], 20)]), usual([np.arange(60.0)])
    ('hold', 'linear')
    >>> usual([np.concatenate([np.zeros(900), np.linspace(0, 1, 50), np.ones(900)])])
    'linear'
    """
    steps = [np.flatnonzero(np.diff(u)) for u in commands]
    moving = [s for s in steps if s.size]
    stepped = all(s.size < 2 or np.median(np.diff(s)) >= HELD for s in moving)
    return "hold" if moving and stepped else "linear"


HELD = 4
"""Samples that a command usually stays the same, to be one that is held."""
