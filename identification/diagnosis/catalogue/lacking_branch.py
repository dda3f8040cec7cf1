"""A linear element on a branch of its own: its unit, its typical size, and what a little does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import R
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue.effect import Insertion, Signature
from identification.diagnosis.localisation.recording.variables import Variables
from identification.diagnosis.screening.port_history import FittedModel

SMALL = 1e-4
"""Part of the typical size that is next to none."""


def unit_of(v: Variables, what: str) -> str:
    """Return the unit of a ``capacity``, a ``resistance`` or a ``conductance`` by the effort's."""
    units = {
        "V": ("F", "ohm", "S"), "K": ("J/K", "K/W", "W/K"),
        "Pa": ("m3/Pa", "Pa*s/m3", "m3/(Pa*s)"), "m": ("m2", "s/m2", "m2/s"),
    }  # fmt: skip
    e, f = v.effort_unit, v.flow_unit
    usual = (f"{v.displacement_unit}/({e})", f"{e}/({f})", f"{f}/({e})")
    at = ("capacity", "resistance", "conductance").index(what)
    return units.get(v.effort_unit, usual)[at]


def nearest_resistance(scene: FittedModel, node: str) -> float:
    """Return the resistance nearest to a junction, SI; 1 where there is none."""
    import networkx as nx  # the catalogue is listed without it

    away = nx.single_source_shortest_path_length(
        scene.graph.network.to_undirected(as_view=True), node
    )
    near = sorted((away[e.name], e.name) for e in scene.graph.of_type(R) if e.name in away)
    sizes = (abs(scene.past[n].slope) for _, n in near if n in scene.past)
    return next((s for s in sizes if s > 0 and np.isfinite(s)), 1.0)


def signature_of_run(scene: FittedModel, made: Insertion) -> tuple[Signature, ...]:
    """Return what a little of an element changes, by a run with it; nothing if that fails."""
    changed = _changed_by(scene, made)
    if changed is None:
        return ()
    # where it is seen most is what stands for it at a glance
    at = int(np.argmax(np.abs(changed / scene.data.floor).max(axis=0)))
    return (Signature(changed[:, at : at + 1], seen=changed[:, :, None]),)


def _changed_by(scene: FittedModel, made: Insertion) -> Array | None:
    """Return what little of an element changes in the readings over its size, shape (N, n_y)."""
    # the catalogue is listed without loading what fits
    from identification.estimation.single_record import fit

    problem = replace(scene.nominal.problem, graph=made.graph, built=None, correction=None)
    (name,), typical = made.strengths, made.graph.parameters[made.strengths[0]].value
    sizes = (SMALL * typical, 2.0 * SMALL * typical)
    try:
        less, more = (
            fit(
                replace(problem, starts={**scene.nominal.values, name: c}), max_iterations=0
            ).simulated
            for c in sizes
        )
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return None
    change = (more - less) / (sizes[1] - sizes[0])
    return np.asarray(change) if np.isfinite(change).all() and change.any() else None
