"""The plane of an element that the model lacks: what must act there, over what it acts on."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph.graph.elements import C, I, R
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.friction.rubbing import Rubbing
from identification.diagnosis.catalogue.places import law_of, sense
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.screening.observation import traced
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio.beside_repair import added_at
from identification.diagnosis.studio.packing import packed, typical
from identification.report.numbers import axis_scale
from identification.report.words import spaced

SAID = " All other values are those of the repaired model; the model as it is has nothing there."


def lacking_plane(
    d: Diagnosis, name: str, known: Array, at: Array, most: int
) -> dict[str, Any] | None:
    """Return the plane of an element that a named effect has hung beside `name`, as data.

    None where no effect did, or what it does is not known.

    Parameters
    ----------
    known : ndarray of bool, shape (N,)
        Samples that are looked at.
    at : ndarray of int
        Those that are drawn.
    most : int
        Points of a line.
    """
    chosen = next((s.chosen for s in d.findings if s.chosen and s.chosen.element == name), None)
    held = None if chosen is None else _hung(d, chosen)
    if chosen is None or held is None or d.repaired is None:
        return None
    found, own = added_at(d, name, known), traced(d.repaired, held.name)
    if found is None or own is None:
        return None
    v, (argument, output) = variables_of(held), own
    word, unit = v.flow, v.flow_unit
    if isinstance(held, C):
        word, unit = v.displacement, v.displacement_unit
    if isinstance(held, I):
        argument = np.asarray(np.gradient(argument, d.repaired.problem.data.dt))
        word, unit = f"rate of the {word}", per_second(unit)
    flow = own[0] if not isinstance(held, C) else np.gradient(own[0], d.repaired.problem.data.dt)
    added = sense(d.graph, d.graph[name]) * found[1]
    fx, ux = axis_scale(unit, float(np.abs(argument[typical(argument)]).max(initial=0.0)))
    fy, uy = axis_scale(v.effort_unit, float(np.abs(output[typical(output)]).max(initial=0.0)))
    line = at[:: max(1, -(-at.size // most))]
    order = line[np.argsort(argument[line], kind="stable")]
    return {
        "x": packed(fx * argument[at]),
        "y": packed(fy * added[at]),
        "power": packed((added * flow)[at]),
        "xLabel": f"{word} of {name} ({ux})" if ux else f"{word} of {name}",
        "yLabel": f"{v.effort} ({uy})" if uy else v.effort,
        "open": SAID,
        "nominal": {"x": packed(fx * argument[order]), "y": packed(np.zeros(order.size))},
        "laws": [
            {
                "label": spaced(chosen.effect), "on": True,
                "x": packed(fx * argument[order]), "y": packed(fy * output[order]),
            }
        ],
    }  # fmt: skip


def per_second(unit: str) -> str:
    """Return the unit of a rate.

    Examples
    --------
    >>> per_second("m/s"), per_second("A"), per_second("")
    ('m/s2', 'A/s', '')
    """
    if not unit:
        return ""
    return f"{unit}2" if unit.endswith("/s") else f"{unit}/s"


def _hung(d: Diagnosis, chosen: Candidate) -> C | I | R | None:
    """Return the element that an effect has brought along, with the strengths of its law."""
    rubbing = {e.name for e in CATALOGUE if isinstance(e, Rubbing)}
    # a lacking element of the user's own is in no catalogue
    if not chosen.insertion.plain and chosen.effect not in rubbing:
        return None
    graph = chosen.insertion.graph
    e: C | I | R
    for e in graph.of_type(C, I, R):
        if e.name in d.graph.elements:
            continue
        law = law_of(e)
        own = {p.name for p in law.parameters(e.name)} if law is not None else set()
        own |= {str(s) for s in graph.coefficient(e).free_symbols}
        if own.issuperset(chosen.insertion.strengths):
            return e
    return None
