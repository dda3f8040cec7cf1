"""A diode across a resistor: beyond a threshold it conducts, one way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws import Diode, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import electrical_resistors, has_unit
from identification.diagnosis.catalogue.site import Site, Values, over, plain
from identification.diagnosis.catalogue.starts import shared_slope


class DiodeEffect(Effect):
    """A diode, with some resistance in series, lies across a resistor."""

    name = "diode"
    family = "flow"
    kind = "dissipative"
    law = "diode_with_series_resistance"
    laws = (Diode,)
    sentence = "beyond a threshold a diode conducts across it, one way only"
    looks = "one side of the characteristic is straight, the other bends flat beyond a threshold"
    confused_with = ("nonlinear_resistance", "saturation", "sensor_nonlinearity")
    separated_by = (
        "a small excitation about a bias on either side: the slope is one of two, and between them "
        "it changes within some tens of millivolts"
    )
    source = "Shockley 1949; Banwell and Jayakumar, Electronics Letters 36 (2000) 291"
    where = staticmethod(electrical_resistors)

    weights = ("share",)
    shapes = over(sense=plain(1.0, -1.0), onset=plain(0.0, 0.15, 0.35, 0.6), width=plain(0.02, 0.1))

    def made(self, at: Site, sense: float = 1.0, onset: float = 0.15, width: float = 0.1) -> Law:
        """Share, onset and rounding; the last two in largest flows."""
        most, unit = at.past.largest, "A" if has_unit(at.element, ("ohm",)) else f"V/({at.unit})"
        slope = shared_slope(at.element, at.past)
        return Diode(**slope, onset=onset * most, width=width * most, sense=sense, unit=unit)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return a part of the resistance, at the place of the hint."""
        share = 0.5 if hint is None else float(np.clip(hint.weights[0], 0.05, 0.95))
        return ({"share": share},)
