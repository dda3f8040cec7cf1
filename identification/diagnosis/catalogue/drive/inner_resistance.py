"""A source that gives less the more is asked of it: a battery, a pump that slips."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, final

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, One, R, Se, Sf, Zero
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.graph.sensors import Sensor
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.lacking_branch import (
    nearest_resistance,
    signature_of_run,
    unit_of,
)
from identification.diagnosis.catalogue.lacking_element import LEAST, free_name
from identification.diagnosis.catalogue.places import commands, ends, on_effort, on_flow
from identification.diagnosis.localisation.recording.variables import (
    GENERIC,
    MOVES,
    variables_beside,
)
from identification.diagnosis.screening.port_history import FittedModel

TYPICAL = 0.1
"""Resistance inside a source of effort over the nearest one, and its inverse of one of flow."""
SIZES = (1.0, 10.0, 0.1, 0.01)
"""Times that which are tried as starts."""


@final
class InnerResistance(Effect):
    """A resistance in series with a source of effort, or across a source of flow."""

    name = "inner_resistance"
    family = "drive"
    kind = "dissipative"
    sort = "a loss in proportion to what is drawn"
    law = "linear_source"
    sentence = "it gives less the more is asked of it, in proportion: it has a resistance inside"
    looks = "a voltage that falls with the current, a flow that falls with the pressure"
    confused_with = ("sensor_gain", "leakage", "linear_loss")
    separated_by = (
        "hold its command and load it more and more: what it gives falls along a straight line"
    )
    source = (
        "slip of a pump: Merritt, Hydraulic Control Systems, 1967; sources of Thevenin and Norton"
    )
    meanings: ClassVar[Mapping[str, str]] = {
        "inside": "resistance in series with a source of effort",
        "slip": "flow that a source of flow loses, over the effort it works against",
    }
    plain = True

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return commanded sources where no element of the model does the same."""
        return tuple(e for e in commands(graph) if _open(graph, e))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what a small resistance inside changes."""
        return signature_of_run(scene, self.insert(scene, element))

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Put a resistor between the source and the rest, or across it."""
        g, name = scene.graph, element.name
        node = g.neighbour(name)
        v, near = variables_beside(g, node), nearest_resistance(scene, node)
        gives_effort = isinstance(element, Se)
        typical = TYPICAL * near if gives_effort else TYPICAL / near
        resistance = unit_of(v, "resistance")
        unit = resistance if gives_effort else unit_of(v, "conductance")
        amount = Parameter(
            free_name(g, f"{'inside' if gives_effort else 'slip'}_{name}"), typical, unit,
            lower=LEAST * typical, upper=typical / LEAST, scale=typical,
        )  # fmt: skip
        a = symbol(amount.name, positive=True)
        inside = R(free_name(g, f"R_{name}"), a if gives_effort else 1 / a, unit=resistance)
        junction: One | Zero = One(free_name(g, f"in_{name}"))
        if not gives_effort:
            junction = Zero(junction.name)
        (bond,) = g.bonds_of(name)
        g = g.with_parameters([amount]).with_inserted(bond, junction)
        g = g.with_branch(junction.name, [inside])
        tried = [typical * times for times in SIZES]
        if hint is not None and hint.weights[0] > 0:
            tried = [float(np.clip(hint.weights[0], 1e-3 * typical, 1e3 * typical)), *tried]
        made = self.inserted(element, g, tuple({amount.name: x} for x in tried), (amount.name,))
        says = (
            f"its {v.effort} falls with the {v.flow} that is drawn: it has a resistance inside"
            if gives_effort
            else f"it gives less the higher the {v.effort}: a part leaks back inside"
        )
        same = [e.name for e in on_flow(scene.graph, node) if isinstance(e, R) and gives_effort]
        says += f"; {' or '.join(same)} beyond its bounds is the same" if same else ""
        # what it loses depends on its load: it is no matter of the command
        return replace(made, sentence=says, kind=self.kind)


def _open(graph: BondGraph, source: Element) -> bool:
    """Whether a resistance inside would be no part of a resistor, or a leak, that is there."""
    node = graph.neighbour(source.name)
    v = variables_beside(graph, node)
    if not isinstance(source, Se | Sf) or v is GENERIC or v.displacement in MOVES:
        return False
    own = One if isinstance(source, Se) else Zero
    if not isinstance(graph[node], own):
        # it gives the junction its common variable: no single branch there is loaded by it alone
        others = [m for m in ends(graph, node) if m != source.name]
        others = [m for m in others if not isinstance(graph[m], Sensor)]
        if len(others) != 1:
            return True
        node = others[0]
    if not isinstance(graph[node], own):
        return False
    beside = on_flow(graph, node) if own is One else on_effort(graph, node)
    if isinstance(source, Sf) and any(isinstance(e, C) for e in beside):
        return False  # a leak of that store is the same
    resistors = [e for e in beside if isinstance(e, R)]
    if resistors:
        return all(_bounded(e) for e in resistors)
    return not any(isinstance(e, C | I) for e in beside)


def _bounded(resistor: R) -> bool:
    """Whether the value of a resistor may not become what a resistance inside would make of it."""
    stated = resistor.fixed or resistor.spread is not None
    return resistor.law is None and isinstance(resistor.value, int | float) and stated
