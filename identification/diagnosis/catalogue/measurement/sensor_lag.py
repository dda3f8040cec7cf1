"""A reading that follows with a lag."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

from bondgraph.graph.elements import Element
from identification.diagnosis.catalogue.drive.low_pass import lag_parameter, lag_starts
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import lump_at, prompt_sensors
from identification.diagnosis.catalogue.signal_traces import lateness
from identification.diagnosis.screening.port_history import FittedModel


class SensorLag(Effect):
    """The reading follows with a first-order lag."""

    name = "sensor_lag"
    family = "measurement"
    kind = "sensing"
    law = "first_order_lag"
    sentence = "its reading follows the true value with a first-order lag"
    looks = "late and smaller the faster the motion, in this reading alone"
    confused_with = ("low_pass", "delay", "linear_capacity")
    separated_by = "a second sensor: a lag of the drive shows in both readings, this one in one"
    from_one: ClassVar[Mapping[str, str]] = {
        "delay": "a multisine up to well beyond the corner: a reading with a lag falls in gain, "
        "one that is late does not",
    }
    source = "single-pole sensor"
    meanings: ClassVar[Mapping[str, str]] = {
        "tau": "time constant of the lag",
    }
    where = staticmethod(prompt_sensors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """How far the reading stays behind, for several time constants."""
        return lateness(scene, element)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One lag."""
        tau = lag_parameter(scene, element)
        graph = scene.graph.with_parameters([tau]).with_element(element.name, lag=tau.name)
        made = self.inserted(element, graph, lag_starts(scene, tau, hint), (tau.name,))
        lump = lump_at(scene.graph, element)
        if not lump:
            return made
        says = f"a {lump} behind a resistance, which the model lacks there, does"
        if lump == "heat capacity":
            says = "a probe with heat of its own does"
        return replace(made, sentence=f"{self.sentence}, as {says}")
