"""Effort that bends away from the straight line."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I
from bondgraph.laws import Parametrised, Polynomial
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import coils, springs, storages
from identification.diagnosis.catalogue.restoring.curves import (
    LOSSY,
    coil_knees,
    lossy_at,
    magnet_at,
    nearest_magnet,
    saturating_at,
)
from identification.diagnosis.catalogue.starts import law_units, rebalanced, tamed
from identification.diagnosis.screening.port_history import FittedModel


class NonlinearStiffness(Effect):
    """Effort bends away from the straight line with displacement.

    A quadratic and a cubic term; where they leave a rest, a spring may have a magnet beside it or
    a loss of its own. The iron of a coil saturates.
    """

    name = "nonlinear_stiffness"
    family = "restoring"
    kind = "restoring"
    law = "polynomial"
    sentence = "its effort bends away from the straight line as it is charged or stretched"
    looks = "a smooth curve of effort over displacement without loops; resonance shifts with level"
    confused_with = (
        "bilinear_stiffness", "end_stop", "backlash", "contact_loss", "sensor_nonlinearity",
        "saturation",
    )  # fmt: skip
    separated_by = (
        "slow loading to the largest stroke in both directions: a smooth curve bends everywhere, "
        "the look-alikes have corners at one or two places"
    )
    richer = ("magnet", LOSSY)
    source = "Duffing 1918; series of the stored energy"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """All storages of displacement, and coils."""
        return (*storages(graph), *coils(graph))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Square and cube of the scaled displacement; knees of a coil."""
        past = scene.of(element)
        if isinstance(element, I):
            return coil_knees(past)
        z = (past.argument - past.centre) / past.half
        return (Signature(np.stack([z**2, z**3], axis=1)),)

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Return the magnet that bends nearly as the fitted series does, beside a spring."""
        known, past = ended.get(self.name, {}), scene.of(element)
        weights = [known.get(f"a_{n}_{element.name}", 0.0) for n in (2, 3)]
        if element not in springs(scene.graph) or not any(weights):
            return ()
        z = (past.argument - past.centre) / past.half
        found = nearest_magnet(past, weights[0] * z**2 + weights[1] * z**3)
        return () if found is None else (magnet_at(self, scene, element, *found, known),)

    def refinements(
        self, scene: FittedModel, element: Element, ended: Mapping[str, float]
    ) -> tuple[Insertion, ...]:
        """Return the fitted series with a loss of its own."""
        return (lossy_at(self, scene, element, ended),) if isinstance(element, C) else ()

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic and cubic term about the centre of the record; iron of a coil."""
        past = scene.of(element)
        if isinstance(element, I):
            return saturating_at(self, scene, element, hint)
        assert isinstance(element, C)
        effort, way = law_units(element)
        series = Polynomial(past.centre, past.half, 0.1 * past.swing, unit=effort)
        law = Parametrised(series, ("centre", "half"), (way, way))
        graph, names = self.with_law(scene, element, law)
        starts: tuple[dict[str, float], ...] = ({},)
        if hint is not None:
            weights = tamed(hint.weights, past.swing)
            start = {n: float(w) for n, w in zip(names, weights, strict=True)}
            z = (past.argument - past.centre) / past.half
            added = np.stack([z**2, z**3], axis=1) @ weights
            starts = ({**start, **rebalanced(element, past, added)}, start)
        return self.inserted(element, graph, starts, names)
