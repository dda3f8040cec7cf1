"""A reading by a wrong factor: a calibration that is off."""

from __future__ import annotations

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, Sensor
from bondgraph.laws import Polynomial
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading_without_offset
from identification.diagnosis.screening.port_history import FittedModel, PortHistory


class SensorGainEffect(Effect):
    """The reading is too large or too small by one factor.

    Shows only beside other sensors, where the parameters of the model cannot make up for it.
    """

    name = "sensor_gain"
    family = "measurement"
    kind = "sensing"
    law = "line"
    sentence = "its reading is wrong by one factor: its calibration is off"
    looks = "the error is a line over the reading, at every speed and level"
    confused_with = ("sensor_nonlinearity", "nonlinear_ratio")
    separated_by = "a known step of what the sensor measures, or a second sensor beside it"
    source = "calibration line"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return sensors beside others: one alone cannot be told from what drives the plant."""
        return sensors(graph) if len(graph.of_type(Sensor)) > 1 else ()

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return the reading about its centre: what an error of one adds."""
        past = _past(scene, element)
        return (Signature.of((past.argument - past.centre,)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One error of the factor; the zero is a nuisance of every fit."""
        line = Polynomial(_past(scene, element).centre, 1.0, 0.05, (1,))
        graph, names = self.with_law(scene, element, line)
        start = {} if hint is None else hint.by_name(names)
        return self.inserted(element, graph, (start,), names)


def _past(scene: FittedModel, element: Element) -> PortHistory:
    y = reading_without_offset(scene, element)
    return PortHistory(y, y, scene.data.dt)
