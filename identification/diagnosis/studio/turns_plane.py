"""The plane of a law that repeats along a way, within one period: over many it is a tangle."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Periodic
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.places import law_of, sense
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.recovered import NO_POINTS, lost
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.screening.observation import traced
from identification.diagnosis.screening.port_history import PortHistory
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio.packing import packed
from identification.report.numbers import axis_scale, quantity
from identification.report.words import spaced

TURNS = 3.0
"""Periods from which a way is folded."""
SMOOTH = 200
"""Points of the law within its period."""


def repeating(d: Diagnosis, name: str, past: PortHistory) -> Candidate | None:
    """Return the first law still in question at an element that repeats many times on its way."""
    for t in (t for s in d.findings for t in (*s.possible, *s.same_place)):
        if t.element == name and isinstance(law_of(t.fit.problem.graph[_holder(t)]), Periodic):
            way, period = _way(d, t, past), t.fit.values[f"period_{_holder(t)}"]
            many = way is not None and np.ptp(way) > TURNS * period > 0
            return t if many else None
    return None


def turned_plane(
    d: Diagnosis, name: str, past: PortHistory, added: Array, known: Array, at: Array, t: Candidate
) -> dict[str, Any]:
    """Return what is missing over its way within one period, and the law that was found.

    What the model as it is does there is zero: the addition alone is drawn.
    """
    way, held = _way(d, t, past), _holder(t)
    assert way is not None
    if held != name:  # the force beside an inertia, whose bond may point out of it
        added = sense(d.graph, d.graph[name]) * added
    a, b, period = (t.fit.values[f"{n}_{held}"] for n in ("a", "b", "period"))
    law = law_of(t.fit.problem.graph[held])
    assert isinstance(law, Periodic)
    inside = way % period
    s = np.linspace(0.0, period, SMOOTH)
    w = a * np.sin(2 * np.pi * s / period) + b * np.cos(2 * np.pi * s / period)
    fx, ux = axis_scale(law.way_unit, period)
    no_points = lost(added[known], w)
    largest = max(float(np.abs(x).max()) for x in (added[known], w))
    fy, uy = axis_scale(law.unit, largest)
    at = at[:0] if no_points else at
    v = variables_of(d.graph[name])
    what = f"error of {name}" if isinstance(d.graph[name], Sensor) else f"{v.effort} at {name}"
    zero = {"x": packed(fx * s[[0, -1]]), "y": packed(np.zeros(2))}
    flow = np.zeros(past.n) if isinstance(d.graph[name], Sensor) else past.argument
    return {
        "x": packed(fx * inside[at]),
        "y": packed(fy * added[at]),
        "power": packed((added * flow)[at]),
        "xLabel": f"way within its period ({ux})" if ux else "way within its period",
        "yLabel": f"missing {what} ({uy})" if uy else f"missing {what}",
        "open": f" Drawn within the period of {quantity(period, law.way_unit)} that was found."
        + NO_POINTS * no_points,
        "nominal": zero,
        "laws": [
            {"label": spaced(t.effect), "on": True, "x": packed(fx * s), "y": packed(fy * w)}
        ],
    }  # fmt: skip


def _way(d: Diagnosis, t: Candidate, past: PortHistory) -> Array | None:
    """Return the way that the law follows; None where it is not seen.

    A force moves what it acts on: its way is that of the repaired model, within whose periods the
    model as it is would soon be lost.
    """
    if isinstance(d.graph[t.element], Sensor):
        return past.argument
    seen = traced(t.fit, _holder(t))
    if seen is None or d.scene is None:
        return None
    return np.asarray(np.interp(d.scene.data.time, t.fit.problem.data.time, seen[0]))


def _holder(t: Candidate) -> str:
    """Return the element that holds the law: a storage of its own beside an inertia."""
    beside = f"ripple_{t.element}"
    return beside if beside in t.fit.problem.graph.elements else t.element
