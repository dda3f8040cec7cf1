"""What of the measuring chain a fit makes use of: offsets, lags, gains and clocks that matter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.estimates import Estimate
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, alone
from identification.report.numbers import interval, quantity
from identification.study.residual import evaluate

WORTH = 0.3
"""Times the noise of a reading that a nuisance changes it by, from which it is worth a word."""
LOUD = 1.0
"""The same for one that may be none: it hides in something else."""
SMALL = 0.5
"""The same for one of which a word is enough: without it the answer would be the same."""
AMBIENT = 5.0
"""Kelvin: an offset of a temperature beyond it is the scale's, no sensor is so far off."""
OPEN = 200.0
"""Width of an interval over the value from which that is told by nothing."""
LITTLE = ": little"
"""How one ends that is not leant on."""
ZERO = "where the model's zero lies on the scale of"
"""What such an offset is, in words: most models count temperatures from the ambient."""


def leaning_words(said: str) -> str:
    """Return the sentence of a leaning that was written as text."""
    return said if ZERO in said or LITTLE in said else f"the fit leans on {said}"


@dataclass(frozen=True, slots=True)
class Leaning:
    """A nuisance that changes a reading by more than a part of its noise.

    Attributes
    ----------
    over_noise : float
        Root mean square change of the reading that it changes most, over its noise.
    """

    estimate: Estimate
    reading: str
    over_noise: float

    @property
    def is_ambient(self) -> bool:
        """Whether it is the zero of a scale, such as the ambient: nothing that a fit leans on."""
        e = self.estimate
        return e.unit == "K" and e.name.startswith("offset ") and abs(e.value) > AMBIENT

    @property
    def does(self) -> str:
        """What it does to the reading."""
        if self.is_ambient:
            return f"{ZERO} {self.reading}: the ambient of an absolute reading"
        little = LITTLE if self.over_noise < SMALL else ""
        return f"moves {self.reading} by {self.over_noise:.2g} times its noise{little}"

    def __str__(self) -> str:
        """Name, number, interval and what it does to the reading."""
        e = self.estimate
        unit = "" if e.unit == "1" else e.unit
        ends = interval(*e.ci95, unit, e.value)
        which = "" if self.is_ambient else "which "
        return f"{e.name} = {quantity(e.value, unit)} (95 %: {ends}), {which}{self.does}"


def made_up_for(e: Estimate, none: float = 0.0) -> bool:
    """Whether others make up for a nuisance: it may be anything, and nothing leans on it."""
    return e.ci95[1] - e.ci95[0] > OPEN * abs(e.value - none)


def leanings(made: Fit) -> tuple[Leaning, ...]:
    """Return the nuisances that a fit makes use of, in their order.

    The offset of a sensor that holds a law of its own is part of that law.
    """
    if made.status is FitStatus.BROKEN:
        return ()
    problem, (stack, _) = made.problem, alone(made)
    mask, still = problem.data.mask("train"), evaluate(problem, made.point, derivatives=False).y
    found = []
    own = {f"offset {n}" for n in problem.data.names if getattr(problem.graph[n], "law", None)}
    for e in (e for e in made.nuisances if e.name not in own):
        at = list(stack.columns[0]).index(stack.names.index(e.name))
        theta = made.point.theta.copy()
        free = problem.free[at] if at < len(problem.free) else None
        none = 0.0 if free is None else free.parameter.value
        theta[at] = 0.0 if free is None else free.theta(none)
        sure = e.ci95[1] < none or none < e.ci95[0]
        y = evaluate(problem, replace(made.point, theta=theta), derivatives=False).y
        change = np.sqrt(np.mean((y - still)[mask] ** 2, axis=0)) / problem.data.floor
        c = int(np.argmax(change))
        if not made_up_for(e, none) and (WORTH if sure else LOUD) <= change[c] < np.inf:
            found.append(Leaning(e, problem.data.names[c], float(change[c])))
    return tuple(found)
