"""A mass, or an inductance, that the model does not have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np

from bondgraph.graph.elements import C, Element, I
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.lacking_element import LackingElement
from identification.diagnosis.catalogue.places import without_inertia
from identification.diagnosis.screening.port_history import PortHistory


@final
class LinearInertia(LackingElement):
    """A linear inertia on a flow that has none in the model: effort in proportion to its rate."""

    name = "linear_inertia"
    kind = "slow"  # as a filter of the motion, whose form is that of an after-effect
    sort = "an effort in proportion to the rate of its flow"
    law = "inertia"
    sentence = "a mass or an inductance that the model lacks opposes every change of its flow"
    looks = "slow motion is right, quick motion late and too small, or large at a resonance"
    confused_with = ("low_pass", "sensor_lag", "delay", "creep")
    separated_by = (
        "record what the drive really puts out beside its command, and diagnose with that as the "
        "input: a lag of the drive is gone then, an inertia's is not"
    )
    source = "Karnopp, Margolis, Rosenberg, System Dynamics, chapter 3 (linear I)"
    meanings: ClassVar[Mapping[str, str]] = {"inertia": "missing mass or inductance"}
    where = staticmethod(without_inertia)
    word = "inertia"
    things: ClassVar[Mapping[str, str]] = {
        "N": "mass",
        "N*m": "moment of inertia",
        "V": "inductance",
        "Pa": "fluid inertance",
    }
    whichever = "mass or inductance"
    does = "opposes every change of the {flow}"
    over = 0

    def variable(self, past: PortHistory, element: Element) -> Array:
        """Return the rate of the flow."""
        rate = past.rate
        return np.asarray(np.gradient(rate, past.dt)) if isinstance(element, C) else rate

    def held(self, name: str, coefficient: str, unit: str) -> I:
        """Return an inertia."""
        return I(name, coefficient, unit=unit)
