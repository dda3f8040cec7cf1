"""A curve without a name at every port: what locates when no name fits."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, R
from bondgraph.laws import Law, Parametrised, PiecewiseLinear
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.places import commands, sensors, storages
from identification.diagnosis.catalogue.site import Site
from identification.diagnosis.catalogue.starts import law_units

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

    weights = tuple(f"c_{i}" for i in PiecewiseLinear(tuple(map(float, range(KNOTS)))).free_knots)
    rebalances = False

    def made(self, at: Site) -> Law:
        """Seven knots over the range of the record."""
        output, argument = law_units(at.element)
        knots = tuple(at.past.reach(float(share)) for share in np.linspace(-1, 1, KNOTS))
        curve = PiecewiseLinear(knots, 0.05 * at.past.swing, output)
        return Parametrised(curve, ("knots",), (argument,))
