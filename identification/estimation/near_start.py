"""Where a fit begins: with nuisances and initial states fitted, if that is all that is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.levenberg_marquardt import foreseen, minimise
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation, slots

__all__ = ["FAR_OFF", "near_start"]

FAR_OFF = 10.0
"""Mean square over the noise from which a fit is far from it."""
PROMISING = 100.0
"""Mean square that a first step has to promise."""


def near_start(
    stack: JointProblem, most: int = 4
) -> tuple[JointPoint, tuple[ResidualEvaluation, ...] | None]:
    """Return the start values, their nuisances fitted where the values then explain the recordings.

    Beside them what was simulated at that point with its derivatives, if it was.

    Values that are right beside an offset or an initial state that is not would be bent by the
    first steps, and a law with kinks holds them in the valley where they get.

    Parameters
    ----------
    most : int
        Steps of the nuisances alone at most.
    """
    start, own = stack.start(), set(stack.of_model)
    for p, at in zip(stack.problems, stack.columns, strict=True):
        own |= set(map(int, at[slots(p).delays]))  # declared, and no nuisances
    if not (own and most) or (
        len(own) == stack.n and not any(p.free_states.size for p in stack.problems)
    ):
        return start, None
    found = stack.evaluate(start, scored=True)
    if not FAR_OFF < stack.cost(found, start) < np.inf:
        return start, found
    pinned = replace(stack, held={i: float(start.theta[i]) for i in own})
    promised = foreseen(pinned, pinned.normal(found, start), start) / pinned.count(found)
    if not promised < PROMISING:
        return start, found
    made = minimise(pinned, start, max_iterations=most, tolerance=1e-3)
    return (made.point, None) if made.cost < FAR_OFF else (start, found)
