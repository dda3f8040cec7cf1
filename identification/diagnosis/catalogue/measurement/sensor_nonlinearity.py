"""A reading that bends away from the true value."""

from __future__ import annotations

from bondgraph.laws import Law, Parametrised, Polynomial
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading
from identification.diagnosis.catalogue.site import Site


class SensorNonlinearity(Effect):
    """The reading bends away from the true value."""

    name = "sensor_nonlinearity"
    family = "measurement"
    kind = "sensing"
    law = "polynomial"
    laws = (Polynomial,)
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

    site = staticmethod(reading)
    weights = ("a_2", "a_3")

    def made(self, at: Site) -> Law:
        """Quadratic and cubic term about the centre of the readings."""
        past, unit = at.past, at.unit or "1"
        curve = Polynomial(past.centre, past.half, 0.05 * past.half, unit=unit)
        return Parametrised(curve, ("centre", "half"), (unit, unit))
