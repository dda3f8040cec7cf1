"""What a named law does, recovered beside the values of the repair, along the way of the repair.

The model as it is has bent its values to what is missing, and where a reading tells the effort of
a store, its charge is a sum over all that is read: points by these would draw loops.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bondgraph.graph.elements import C, R, Source
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue.places import sense
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.kind_score import at_values_of
from identification.diagnosis.explanation.recovered import recovered
from identification.diagnosis.screening.observation import traced, watched_signals
from identification.diagnosis.screening.port_response import Probes, probes
from identification.study.residual import evaluate


@dataclass(frozen=True, eq=False)
class Recovered:
    """Points of a law plane, shape (N,) each, SI.

    Attributes
    ----------
    argument : ndarray
        Along the repaired model, of a flow that into the element.
    output : ndarray
        Of the element as it is with what was added there.
    added : ndarray
    """

    argument: Array
    output: Array
    added: Array


def beside_repair(d: Diagnosis, name: str, known: Array) -> Recovered | None:
    """Return what a store, a resistor or a drive does whose law alone was named, if that is known.

    Parameters
    ----------
    known : ndarray of bool, shape (N,)
        Samples that are looked at.
    """
    if d.repaired is None or not isinstance(d.graph[name], C | R | Source):
        return None
    found = added_at(d, name, known)
    if found is not None and d.scene is not None and isinstance(d.graph[name], Source):
        past = d.scene.past[name]
        return Recovered(past.argument, past.output + found[1], found[1])
    own = traced(d.repaired, name)
    if found is None or own is None:
        return None
    probed, added = found
    names, (source, factor) = watched_signals(probed.graph).get(name), probed.ports[name]
    if names is None:
        return None
    try:
        _, traces = probed.observed(names, {source: factor * added})
    except BondsightError:  # no exact model
        return None
    if names[1] not in traces:
        return None
    return Recovered(sense(d.graph, d.graph[name]) * own[0], traces[names[1]] + added, added)


def added_at(d: Diagnosis, name: str, known: Array) -> tuple[Probes, Array] | None:
    """Return what must be added at the only place that was named, shape (N,), SI.

    Beside the values of the repair; with the probes of the model as it is at these values.
    """
    alone = [s.chosen.element for s in d.findings if s.chosen is not None] == [name]
    if d.scene is None or d.repaired is None or not alone:
        return None
    base = d.scene.nominal
    if base.problem.data.n != d.repaired.problem.data.n:
        return None
    point = at_values_of(base, d.repaired)
    simulated = evaluate(base.problem, point, derivatives=False).y
    if not np.isfinite(simulated[known]).all():
        return None
    moved = replace(base, point=point, simulated=simulated)
    probed = probes(moved)
    signal = recovered(replace(d, scene=replace(d.scene, nominal=moved)), probed, None, known, name)
    return None if signal is None else (probed, signal.signal)
