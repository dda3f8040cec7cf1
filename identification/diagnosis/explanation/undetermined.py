"""Numbers of a law that a recording says nothing of: their interval holds all that they may be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.diagnosis.catalogue.places import law_of
from identification.diagnosis.explanation.law_formula import variable_names
from identification.estimation.estimates import Estimate
from identification.uncertainty.tied import remark_on

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis

UNDETERMINED = "not determined by this recording"


def remark_of(e: Estimate, d: Diagnosis) -> str:
    """Return what stands beside a number instead of its interval; empty where it has one."""
    return remark_on(e.name, d.tied) or (UNDETERMINED if is_undetermined(e, d) else "")


def is_undetermined(e: Estimate, d: Diagnosis) -> bool:
    """Whether an interval holds all that a number may be.

    That is what its bounds leave, or for a place on the axis of a law the range that was visited:
    wherever it is there, the readings are the same.
    """
    low, high = e.ci95
    return not np.isfinite([low, high]).all() or high - low >= _range(e, d)


def weakness(e: Estimate) -> str:
    """Return what an interval says against a number in two or three words, else nothing."""
    if e.at_bound:
        return "at its bound"
    low, high = e.ci95
    if 0 < 100 * low < high:
        return "hardly determined"
    return "may be zero" if np.isfinite([low, high]).all() and low < 0 < high else ""


def _range(e: Estimate, d: Diagnosis) -> float:
    last = d.repaired or d.nominal
    graph = last.problem.graph if last is not None else d.graph
    p = graph.parameters.get(e.name)
    if p is not None and p.lower is not None and p.upper is not None:
        return p.upper - p.lower
    for held in graph.elements.values():
        law = law_of(held)
        if law is None or e.name not in (own.name for own in law.parameters(held.name)):
            continue
        past = d.scene.past.get(held.name) if d.scene is not None else None
        on_axis = e.unit == variable_names(graph, held.name)[0]
        return 2.0 * past.half if past is not None and on_axis else np.inf
    return np.inf
