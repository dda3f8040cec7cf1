"""A voltage of constant size against every current: brushes, contacts, two diodes head to tail."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

from identification.diagnosis.catalogue.constant_level import ConstantLevel
from identification.diagnosis.catalogue.places import electrical_resistors


@final
class VoltageDrop(ConstantLevel):
    """A drop that does not grow with the current."""

    name = "voltage_drop"
    family = "flow"
    law = "constant_drop"
    sentence = "a voltage of constant size opposes every current, and none flows below it"
    looks = (
        "no current while the voltage is small, then a step of the characteristic with every "
        "change of direction, of the same size at small and large currents"
    )
    confused_with = ("nonlinear_resistance", "diode", "hysteresis", "dead_zone")
    separated_by = (
        "constant currents of several sizes both ways: the drop stays, where that of a nonlinear "
        "resistance grows; and a voltage below it, at which no current flows"
    )
    source = "contact drop of carbon brushes, textbooks of direct current machines"
    where = staticmethod(electrical_resistors)
    meanings: ClassVar[Mapping[str, str]] = {
        "F_c": "voltage that opposes every current, whatever its size"
    }
