"""The plane of a ratio that changes: over what it changes with, as a user needs it."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.places import modulated_ratio
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.law_formula import signal_words
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio.packing import packed
from identification.diagnosis.verdict.document import as_repaired
from identification.estimation.single_record import Fit
from identification.report.numbers import axis_scale
from identification.report.words import spaced

SMOOTH = 200
"""Points of the law over its range."""
BOTH_SIDES = " A ratio acts on both sides at once: the law alone is drawn, no points."


def changed_ratio(d: Diagnosis, name: str) -> Candidate | None:
    """Return the changing ratio that was named at a two-port, with its last numbers."""
    for t in (s.chosen for s in d.findings):
        if t is None or t.element != name:
            continue
        own = modulated_ratio(t.fit.problem.graph.elements.get(name))
        if own is not None and {*map(str, own.free_symbols)} & {*t.insertion.strengths}:
            return as_repaired(t, d)
    return None


def ratio_plane(d: Diagnosis, t: Candidate) -> dict[str, Any]:
    """Return the ratio over the way or the current that it changes with, and that of the model."""
    assert d.scene is not None
    graph, name = t.fit.problem.graph, t.element
    ratio = modulated_ratio(graph[name])
    assert ratio is not None
    centre, span = (graph.parameters[f"{n}_{name}"] for n in ("centre", "span"))
    (signal,) = (s for s in ratio.free_symbols if str(s) not in graph.parameters)
    x = np.linspace(centre.value - span.value, centre.value + span.value, SMOOTH)
    y = _over(ratio, t.fit, signal, x)
    nominal = _over(d.scene.graph.coefficient(d.scene.graph[name]), d.scene.nominal, signal, x)
    unit = getattr(graph[name], "unit", "")
    fx, ux = axis_scale(span.unit if span.unit != "1" else "", float(np.abs(x).max()))
    fy, uy = axis_scale(unit, float(np.abs(y).max()))
    what, nothing = signal_words(graph, str(signal)), packed(np.zeros(0))
    return {
        "x": nothing,
        "y": nothing,
        "power": nothing,
        "xLabel": f"{what} ({ux})" if ux else what,
        "yLabel": f"ratio of {name} ({uy})" if uy else f"ratio of {name}",
        "open": BOTH_SIDES,
        "nominal": {"x": packed(fx * x), "y": packed(fy * nominal)},
        "laws": [{"label": spaced(t.effect), "on": True, "x": packed(fx * x), "y": packed(fy * y)}],
    }


def _over(ratio: sp.Expr, fit: Fit, signal: sp.Symbol, x: Array) -> Array:
    """Return a ratio at the values of a fit, along `x`."""
    parameters = fit.problem.graph.parameters
    known = {n: p.value for n, p in parameters.items()} | dict(fit.values)
    own = ratio.subs({s: known[str(s)] for s in ratio.free_symbols if str(s) in known})
    return np.asarray(sp.lambdify(signal, own, "numpy")(x) + np.zeros(x.size))
