"""A reading that bends away from the true value."""

from __future__ import annotations

from bondgraph.graph.elements import Element
from bondgraph.laws import Parametrised, Polynomial
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading_without_offset, unit_of
from identification.diagnosis.screening.port_history import FittedModel, PortHistory


class SensorNonlinearity(Effect):
    """The reading bends away from the true value."""

    name = "sensor_nonlinearity"
    family = "measurement"
    kind = "sensing"
    law = "polynomial"
    sentence = "its reading bends away from the true value"
    looks = "the error is one curve over the reading, at every speed"
    confused_with = ("nonlinear_stiffness", "saturation", "nonlinear_ratio")
    simpler = ("sensor_gain",)
    separated_by = (
        "a second sensor, or a free decay: a bent scale leaves the frequency alone, a bent spring "
        "moves it with the amplitude"
    )
    source = "calibration polynomial"
    where = staticmethod(sensors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Quadratic and cubic term."""
        past = _past(scene, element)
        z = (past.argument - past.centre) / past.half
        return (Signature.of((z**2, z**3)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Quadratic and cubic term about the centre of the readings."""
        past = _past(scene, element)
        unit = unit_of(element)
        curve = Polynomial(past.centre, past.half, 0.05 * past.half, unit=unit)
        law = Parametrised(curve, ("centre", "half"), (unit, unit))
        graph, names = self.with_law(scene, element, law)
        start = {} if hint is None else hint.by_name(names)
        return self.inserted(element, graph, (start,), names)


def _past(scene: FittedModel, element: Element) -> PortHistory:
    y = reading_without_offset(scene, element)
    return PortHistory(y, y, scene.data.dt)
