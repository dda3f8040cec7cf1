"""What the page looks at: the fits to compare, units, what is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.found import after_of
from identification.estimation.single_record import Fit
from identification.report.numbers import unit_of_level
from identification.report.traces import span
from identification.study.data import Data


@dataclass(frozen=True)
class Curve:
    """A fit with the word it has all over the page."""

    label: str
    fit: Fit


def curves(d: Diagnosis) -> tuple[Curve, ...]:
    """Fits to compare, before first."""
    if d.nominal is None:
        return ()
    if d.kind == "parameters_only" and d.declared is not None:
        return Curve(DECLARED, d.declared), Curve("fitted values", d.nominal)
    after = after_of(d)
    if after is not None:
        word = "repaired" if d.kind == "missing_physics" else "closest"
        return Curve(AS_IT_IS, d.nominal), Curve(word, after)
    return (Curve(AS_IT_IS, d.nominal),)


AS_IT_IS = "the model as it is, fitted"
DECLARED = "declared values, offsets and initial states fitted"
"""What `simulate` gives has other ones: from rest, and no offset of a sensor."""


def unit_of(d: Diagnosis, name: str) -> str:
    """SI unit of a channel, else of the element of that name."""
    found = d.recording.units.get(name) if name in d.recording.units else None
    if found is None and name in d.graph.elements:
        found = getattr(d.graph[name], "unit", "")
    return "" if found in (None, "1") else str(found)


def level_unit_of(d: Diagnosis, name: str) -> str:
    """Return the unit of the values of a channel: that of the file, where its zero is its own."""
    return unit_of_level(unit_of(d, name), d.recording.read_in.get(name, ""))


def scored(data: Data) -> slice:
    """Stretch of the record from the first to the last sample that is scored."""
    return span(data.mask("train") | data.mask("held-out"))


def residual(f: Fit, column: int) -> Array:
    """Measured less simulated on the whole record, SI, shape (N,)."""
    return np.asarray(f.problem.data.readings[:, column] - f.simulated[:, column])
