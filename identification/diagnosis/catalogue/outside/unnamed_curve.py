"""A curve without a name at every port: what locates when no name fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, R
from bondgraph.laws import Parametrised, PiecewiseLinear
from bondgraph.support.arrays import Array
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import commands, sensors, storages
from identification.diagnosis.catalogue.starts import law_units
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

KNOTS = 7


class UnnamedCurve(Effect):
    """Any memoryless deviation as a function of the port's own variable."""

    name = "unknown"
    family = "outside"
    law = "piecewise_linear"
    sentence = "an unnamed function of its own variable would explain part of the misfit"
    looks = "the deviation over the port's own variable falls on one curve of no known shape"
    separated_by = "a slow sweep of the port's variable over its whole range, both ways"
    source = "hat functions"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Every storage, resistor, source and sensor."""
        resistors = (e for e in graph.of_type(R) if e.law is None)
        return (*storages(graph), *resistors, *commands(graph), *sensors(graph))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """One hat a free knot."""
        return (Signature(hats(scene.of(element))),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Seven knots over the range of the record."""
        output, argument = law_units(element)
        curve = replace(_curve(scene.of(element)), unit=output)
        law = Parametrised(curve, ("knots",), (argument,))
        graph, names = self.with_law(scene, element, law)
        starts = {} if hint is None else hint.by_name(names)
        return self.inserted(element, graph, (starts,), names)


def hats(past: PortHistory) -> Array:
    """Hat functions of the argument on the free knots, shape (N, KNOTS - 2)."""
    law = _curve(past)
    heights = np.eye(len(law.free_knots))
    return np.stack([law.deviation(NUMPY, past.argument, (), h) for h in heights.tolist()], axis=1)


def _curve(past: PortHistory) -> PiecewiseLinear:
    knots = past.centre + past.half * np.linspace(-1, 1, KNOTS)
    return PiecewiseLinear(tuple(float(v) for v in knots), 0.05 * past.swing)
