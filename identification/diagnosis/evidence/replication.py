"""Whether samples that no fit has seen contradict a law: the predictive test of Chow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.signals.split import stretches
from identification.estimation.single_record import Fit, fit

STEPS = 12
"""Of the fit to both parts: it begins where the other one ended."""


def added(trained: Fit) -> float:
    """Return what held-out samples add to the misfit if they are fitted too, over the floor.

    A mean square: about one for a law that is true, even where training left one of its numbers
    open, so that it predicts badly: a stop that was touched once. More for one that cannot be true
    of both parts (Chow, Econometrica 28 (1960) 591). The worst of the readings counts; the fit to
    both parts is thrown away. Infinite where there is no such fit.
    """
    problem, split = trained.problem, trained.problem.data.split
    test = problem.data.mask("test")
    if not test.any():
        return float("nan")
    both = replace(split, train=(*stretches(split.train), *stretches(split.test)), test=())
    whole = replace(problem, data=replace(problem.data, split=both), built=problem.dynamics)
    try:
        found = fit(whole, start=trained.point, max_iterations=STEPS)
    except np.linalg.LinAlgError:  # both parts together lead to where nothing is defined
        return float("inf")
    floor = problem.data.floor
    more = np.sum((found.residuals("train") / floor) ** 2, axis=0)
    less = np.sum((trained.residuals("train") / floor) ** 2, axis=0)
    return float(np.max((more - less) / int(np.count_nonzero(test))))


def scatter(trained: Fit) -> float:
    """Return the standard deviation of what white noise adds to one reading, see `added`."""
    count = int(np.count_nonzero(trained.problem.data.mask("test")))
    return float(np.sqrt(2.0 / max(count, 1)))
