"""A reading that loses the sign."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import Law, Rectifier
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading, weight_of
from identification.diagnosis.catalogue.site import Site, Values


class SensorRectification(Effect):
    """The sensor gives the size of the signal without its sign, wholly or in part.

    A nominal model that was fitted to a rectified reading may have lost its gain, and then the
    linear screening sees little; the start at full rectification does not depend on it.
    """

    name = "sensor_rectification"
    family = "measurement"
    kind = "sensing"
    law = "rectifier"
    laws = (Rectifier,)
    sentence = "its reading loses the sign of what it measures"
    looks = "the reading turns back at zero with a corner, at twice the frequency of the motion"
    confused_with = ("sensor_nonlinearity", "asymmetric_damping", "bilinear_stiffness")
    separated_by = "a slow motion through zero: a rectified reading turns back there"
    source = "full-wave rectifier, |s|"
    where = staticmethod(sensors)

    site = staticmethod(reading)
    weights = ("amount",)

    def made(self, at: Site) -> Law:
        """Return rectification in full."""
        return Rectifier()

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return it in full and as the signature weighs it."""
        found = 0.5 if hint is None else weight_of(hint, 0, 0.02, 1.0)
        return [{"amount": a} for a in dict.fromkeys((found, 1.0))]
