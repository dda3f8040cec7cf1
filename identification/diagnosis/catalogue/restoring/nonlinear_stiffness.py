"""Effort that bends away from the straight line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I
from bondgraph.laws import Gravity, Law, Parametrised, Polynomial
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import coils, springs, storages
from identification.diagnosis.catalogue.restoring.curves import (
    LOSSY,
    coil_knees,
    kneeless_at,
    lossy_at,
    magnet_at,
    nearest_magnet,
    saturating_at,
    turns,
    weight_at,
)
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import law_units, tamed
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
    laws = (Polynomial,)
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
    richer = ("magnet", Gravity.name, LOSSY)
    source = "Duffing 1918; series of the stored energy; pendulum: Huygens, 1673"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """All storages of displacement, and coils."""
        return (*storages(graph), *coils(graph))

    weights = ("a_2", "a_3")

    def made(self, at: Site) -> Law:
        """Quadratic and cubic term about the centre of the record.

        Where the motion passes the rest they add nothing there: a constant would be an offset.
        """
        (effort, way), past = law_units(at.element), at.past
        passes = abs(past.centre) < past.half
        series = Polynomial(past.centre, past.half, 0.1 * past.swing, unit=effort, from_rest=passes)
        return Parametrised(series, ("centre", "half"), (way, way))

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the weights, shrunk until the curve rises everywhere."""
        if hint is None:
            return ({},)
        return (dict(zip(self.weights, tamed(hint.weights, at.past.swing), strict=True)),)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Square and cube of the scaled displacement; knees of a coil."""
        coil = isinstance(element, I)
        return coil_knees(scene.of(element)) if coil else super().signatures(scene, element)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic and cubic term about the centre of the record; iron of a coil."""
        if isinstance(element, I):
            return saturating_at(self, scene, element, hint)
        made = super().insert(scene, element, hint)
        if hint is None or hint.weights[1] >= 0 or not turns(element):
            return made
        says = f"{self.sentence}, as the torque m g l sin(angle) of a weight does that swings wide"
        return replace(made, sentence=says)

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Return a weight, or the magnet that bends as the fitted series does; a coil's iron."""
        if isinstance(element, I):
            return kneeless_at(self, scene, element, ended.get(self.name, {}))
        known = ended.get(self.name, {})
        weight = (weight_at(self, scene, element, known),) if turns(element) else ()
        weights = {n: known.get(f"{n}_{element.name}", 0.0) for n in self.weights}
        if element not in springs(scene.graph) or not any(weights.values()):
            return weight
        at = self.site(scene, element)
        found = nearest_magnet(at.past, at.added(self.made(at), weights))
        if found is None:
            return weight
        return (*weight, magnet_at(self, scene, element, *found, known))

    def refinements(
        self, scene: FittedModel, element: Element, ended: Mapping[str, float]
    ) -> tuple[Insertion, ...]:
        """Return the fitted series with a loss of its own."""
        series = isinstance(getattr(element, "law", None), Parametrised)
        return (lossy_at(self, scene, element, ended),) if isinstance(element, C) and series else ()
