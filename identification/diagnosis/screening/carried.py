"""How far a fit of the model as it is was carried off by what the model lacks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bondgraph.graph.parameter import Parameter
from identification.estimation.single_record import Fit


def astray(nominal: Fit) -> bool:
    """Whether a fit misses most of what moves in a reading: its own course says little.

    So says that of a plant that ran away, see `carried_away`.
    """
    if carried_away(nominal):
        return True
    inside = nominal.problem.data.mask("train")
    moves = np.std(nominal.problem.data.readings[inside], axis=0)
    missed = np.sqrt(np.mean(nominal.residuals("train") ** 2, axis=0))
    clear = missed > CLEAR * nominal.problem.data.floor
    return bool((clear & (missed > LOST * moves)).any())


CLEAR = 5.0
"""Times the noise above which a misfit is no weak reading's noise."""
LOST = 0.5
"""Part of a reading's standard deviation that a fit misses which does not follow it."""
FAR = 10.0
"""Nominal misfit from which its parameter values mean little."""


def carried_away(nominal: Fit) -> bool:
    """Whether a plant that integrates is missed with values that nothing can have.

    What is missing moved it elsewhere, and nothing that holds near these values holds near others.
    """
    if not nominal.problem.source_offsets or nominal.chi2("train") <= FAR:
        return False
    return len(far_off(nominal, nominal.problem.graph.parameters)) >= SEVERAL


def bent(nominal: Fit) -> bool:
    """Whether a fit ended at a bound, or far from a value that is declared."""
    moved = ratios(nominal, nominal.problem.graph.parameters)
    far = any(r > 0.0 and not 1 / BENT < r < BENT for r in moved.values())
    return far or any(e.at_bound for e in nominal.estimates)


BENT = 3.0
"""Times a declared value from which a fitted one rather does the work of a law that is missing."""


def far_off(last: Fit, declared: Mapping[str, Parameter]) -> dict[str, float]:
    """Return the ratios of fitted to declared values that no data sheet is wrong by."""
    found = ratios(last, declared)
    return {n: r for n, r in found.items() if r > 0 and not 1 / MOVED < r < MOVED}


def ratios(last: Fit, declared: Mapping[str, Parameter]) -> dict[str, float]:
    """Return the ratio of every fitted value to the declared one, where that is not zero."""
    known = {n: p.value for n, p in declared.items() if p.value}
    return {e.name: e.value / known[e.name] for e in last.estimates if e.name in known}


MOVED = 30.0
"""Ratio of a fitted to a declared value that no data sheet is wrong by."""
SEVERAL = 3
"""Parameters moved so far that together they tell of a unit rather than of their values."""
