"""Richer forms of hysteresis: with creep, in a potential that saturates, wider with the rate."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import final

from bondgraph.graph.elements import Element
from bondgraph.laws import Law, LawSum, Parametrised, Polynomial
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion
from identification.diagnosis.catalogue.memory.creep import Creep
from identification.diagnosis.catalogue.memory.hysteresis import Hysteresis, stops_at
from identification.diagnosis.catalogue.places import storages
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

PLAIN = Hysteresis()


class RicherHysteresis(Effect, ABC):
    """Stops of a storage beside something that they cannot do alone; abstract."""

    name = PLAIN.name
    family = PLAIN.family
    kind = PLAIN.kind
    looks = PLAIN.looks
    confused_with = PLAIN.confused_with
    separated_by = PLAIN.separated_by
    where = staticmethod(storages)


class StopsBeside(RicherHysteresis, ABC):
    """Stops in one law with what is beside them; abstract."""

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert the stops, and exchange their law."""
        stops = PLAIN.insert(scene, element, hint)
        graph, names = self.with_law(scene, element, self.law_at(element, scene.of(element)))
        return self.inserted(element, graph, stops.starts, names)

    @abstractmethod
    def law_at(self, element: Element, past: PortHistory) -> Law:
        """Return the law that holds the stops."""


@final
class CreepingHysteresis(RicherHysteresis):
    """Stops in series with two Kelvin-Voigt branches."""

    law = "hysteresis_with_creep"
    sentence = "its output depends on the turning points of the past, and goes on creeping"
    simpler = ("creep", "leakage")
    source = "Kuhnen and Janocha, Creep and hysteresis compensation, 1998"

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert the stops, then the branches before the storage."""
        stops = PLAIN.insert(scene, element, hint)
        creep = Creep().insert(replace(scene, graph=stops.graph), element)
        strengths = (*stops.strengths, *creep.strengths)
        starts = ({**stops.starts[0], **creep.starts[0]},)
        return self.inserted(element, creep.graph, starts, strengths, creep.within)


@final
class SaturatingHysteresis(StopsBeside):
    """Stops in the potential of a ferroelectric: switching that ends where all has switched."""

    law = "stops_in_a_potential"
    sentence = "it switches with the turning points of the past, and saturates"
    simpler = ("nonlinear_stiffness",)
    source = "Devonshire, Phil. Mag. 40 (1949) 1040; Landis, J. Mech. Phys. Solids 50 (2002) 127"

    def law_at(self, element: Element, past: PortHistory) -> Law:
        """Return stops, and the third and fifth power of a Landau potential, even about zero."""
        half = float(abs(past.argument).max()) or 1.0
        potential = Polynomial(0.0, half, 0.1 * past.swing, (3, 5))
        parts = (stops_at(element, past), potential)
        lifted = (("thresholds",), ("centre", "half"))
        return LawSum(tuple(map(Parametrised, parts, lifted)))


@final
class RatedHysteresis(StopsBeside):
    """Stops that slip later the faster they are moved."""

    law = "rate_dependent_prandtl_ishlinskii"
    sentence = "its output depends on the turning points of the past, with loops wider with speed"
    source = "Al Janaideh and Krejci, IEEE/ASME Trans. Mechatronics 18 (2013) 1498"

    def law_at(self, element: Element, past: PortHistory) -> Law:
        """Return stops with the typical rate of the record."""
        speed = float(abs(past.rate).max()) or 1.0
        rated = replace(stops_at(element, past), rated=True, speed=speed)
        return Parametrised(rated, ("thresholds", "speed"))


FORMS: tuple[RicherHysteresis, ...] = (
    CreepingHysteresis(), SaturatingHysteresis(), RatedHysteresis(),
)  # fmt: skip
"""Tried where plain stops lead and leave more than noise."""
