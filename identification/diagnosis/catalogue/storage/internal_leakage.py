"""Two stores between which something seeps that no element joins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, One, Zero
from bondgraph.laws import Orifice
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import apart, vessels
from identification.diagnosis.catalogue.starts import at_least
from identification.diagnosis.catalogue.storage.leakage import (
    HOLE,
    SEEPS,
    hole,
    seep,
    through_hole,
)
from identification.diagnosis.screening.port_history import FittedModel, moved_by


class InternalLeakage(Effect):
    """Charge, heat or volume seeps from one store into another, by the difference of efforts.

    Of a pair the store that was declared first is the place.
    """

    joins = True
    name = "internal_leakage"
    family = "storage"
    kind = "slow"
    law = "resistor_between"
    sentence = "it leaks into another store: what seeps over grows with the difference of efforts"
    looks = "two levels draw near to each other while nothing is drawn, and what they hold is kept"
    confused_with = ("leakage", "creep", "sensor_drift")
    separated_by = (
        "fill one store, close everything and wait: what this one loses the other one gains, and "
        "both end at one level; a leak to the outside empties both"
    )
    source = "cross-port leakage of a cylinder; Merritt, Hydraulic Control Systems, 1967"
    meanings: ClassVar[Mapping[str, str]] = {
        "seep": "rate at which what is stored seeps into the other store",
    }

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return the stores that have another one to leak into."""
        return tuple(e for e in vessels(graph) if partners(graph, e))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Effort that one store loses and the other one gains, through a gap and through a hole."""
        past, found = scene.of(element), []
        for number, other in enumerate(partners(scene.graph, element)):
            there = scene.of(other)
            fall = past.output - there.output
            for way, flow in ((SEEPS, fall / past.slope), (HOLE, through_hole(fall))):
                moved = moved_by(flow, past.dt)[:, None]
                found.append(
                    Signature(
                        -past.slope * moved,
                        shape={"to": float(number), "way": way},
                        course="hole" if way == HOLE else "gap",
                        beside=((other.name, there.slope * moved),),
                    )
                )
        return tuple(found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a resistor or a hole between both stores, whichever explained more."""
        g, past, shape = scene.graph, scene.of(element), dict(hint.shape) if hint else {}
        other = partners(g, element)[int(shape.get("to", 0))]
        typical = 0.1 / past.duration
        if hint is not None and shape["way"] == HOLE:
            level = float(np.abs(past.output - scene.of(other).output).max()) or 1.0
            full = at_least(hint.weights[0] * np.sqrt(level), 0.1 * typical * past.largest)
            leak, rate = hole(element, full, level, "seep")
            tried = [full, 3 * full]
        else:
            leak, rate = seep(
                element.name, typical, past.duration, past.dt, g.coefficient(element), "seep"
            )
            g = g.with_parameters([rate])
            tried = [typical, 30 * typical]
            if hint is not None:
                tried = [at_least(hint.weights[0], 0.1 * typical)]
        gap = One(f"gap_{element.name}")
        g = g.with_branch(g.neighbour(element.name), [gap]).with_branch(gap.name, [leak])
        g.bond(gap, g[g.neighbour(other.name)])
        made = self.inserted(element, g, tuple({rate.name: v} for v in tried), (rate.name,))
        says = f"it leaks into {other.name}: what seeps over grows with the difference of efforts"
        law = leak.law.name if isinstance(leak.law, Orifice) else made.law
        return replace(made, law=law, sentence=says, joined=other.name)


def partners(graph: BondGraph, store: Element) -> tuple[Element, ...]:
    """Return the stores that `store` may leak into, the nearest first."""
    return apart(graph, store, vessels(graph), Zero)
