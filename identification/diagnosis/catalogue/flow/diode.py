"""A diode across a resistor: beyond a threshold it conducts, one way."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Diode
from bondgraph.laws.diode import wright_omega
from bondgraph.support.arrays import Array
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import electrical_resistors, has_unit
from identification.diagnosis.catalogue.starts import rebalanced, shared_slope
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

ONSETS = (0.0, 0.15, 0.35, 0.6)
"""Flows at which it may begin to conduct, in largest flows."""
WIDTHS = (0.02, 0.1)
"""Rounding to try, likewise."""


class DiodeEffect(Effect):
    """A diode, with some resistance in series, lies across a resistor."""

    name = "diode"
    family = "flow"
    kind = "dissipative"
    law = "diode_with_series_resistance"
    sentence = "beyond a threshold a diode conducts across it, one way only"
    looks = "one side of the characteristic is straight, the other bends flat beyond a threshold"
    confused_with = ("nonlinear_resistance", "saturation", "sensor_nonlinearity")
    separated_by = (
        "a small excitation about a bias on either side: the slope is one of two, and between them "
        "it changes within some tens of millivolts"
    )
    source = "Shockley 1949; Banwell and Jayakumar, Electronics Letters 36 (2000) 291"
    where = staticmethod(electrical_resistors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what it takes off, for either sense and several onsets and widths."""
        past = scene.of(element)
        return tuple(
            Signature.of((-taken(past, sense, a, w),), sense=sense, onset=a, width=w)
            for sense in (1.0, -1.0)
            for a in ONSETS
            for w in WIDTHS
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Share, onset and rounding, from the best signature or in the middle of them."""
        past = scene.of(element)
        shape = dict(sense=1.0, onset=ONSETS[1], width=WIDTHS[1]) if hint is None else hint.shape
        sense, reach = float(shape["sense"]), _reach(past)
        onset, width = float(shape["onset"]) * reach, float(shape["width"]) * reach
        unit = getattr(element, "unit", "")
        law = Diode(
            **shared_slope(element, past), onset=onset, width=width, sense=sense,
            unit="A" if has_unit(element, ("ohm",)) else f"V/({unit})",
        )  # fmt: skip
        graph, _ = self.with_law(scene, element, law)
        share = 0.5 if hint is None else float(np.clip(hint.weights[0] / past.slope, 0.05, 0.95))
        names = [f"{n}_{element.name}" for n in ("share", "onset", "width")]
        start = dict(zip(names, (share, onset, width), strict=True))
        off = -share * past.slope * taken(past, sense, shape["onset"], shape["width"])
        starts = ({**start, **rebalanced(element, past, off)}, start)
        return self.inserted(element, graph, starts, (names[0],))


def taken(past: PortHistory, sense: float, onset: float, width: float) -> Array:
    """Return the flow that a diode would take, with its sign; `onset`, `width` in largest flows."""
    reach = _reach(past)
    z = (sense * past.argument / reach - onset) / width
    return np.asarray(sense * width * reach * wright_omega(NUMPY, z))


def _reach(past: PortHistory) -> float:
    return float(np.abs(past.argument).max()) or 1.0
