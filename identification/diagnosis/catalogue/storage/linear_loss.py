"""A damper, or another linear resistor, that the model does not have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, final

from bondgraph.graph.elements import C, Element, R, Se
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Hint, Insertion
from identification.diagnosis.catalogue.lacking_element import LackingElement
from identification.diagnosis.catalogue.places import sharing_flow, undamped
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.screening.port_history import FittedModel, PortHistory


@final
class LinearLoss(LackingElement):
    """A linear resistor on a flow that meets none in the model: effort in proportion to flow."""

    name = "linear_loss"
    kind = "dissipative"
    law = "series_resistor"
    sentence = "a damper or resistor that the model lacks opposes it in proportion to its flow"
    looks = "what rings in the model dies out, and peaks are lower and broader than simulated"
    confused_with = ("added_mode", "creep", "coulomb_friction", "eddy_current_loss")
    separated_by = (
        "let it ring freely: its envelope is an exponential, by the same part each period at every "
        "amplitude"
    )
    source = "Karnopp, Margolis, Rosenberg, System Dynamics, chapter 3 (linear R)"
    meanings: ClassVar[Mapping[str, str]] = {
        "damping": "coefficient of the missing damper or resistor"
    }
    where = staticmethod(undamped)
    word = "damping"
    things: ClassVar[Mapping[str, str]] = {
        "N": "damper",
        "N*m": "rotational damper",
        "V": "resistance",
        "Pa": "flow resistance",
        "m": "flow resistance",
        "K": "thermal resistance",
    }
    whichever = "damper or resistor"
    does = "opposes the {flow} in proportion"
    over = 1

    def variable(self, past: PortHistory, element: Element) -> Array:
        """Return the flow."""
        return past.rate if isinstance(element, C) else past.argument

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Say where it may lie in the source."""
        made = super().insert(scene, element, hint)
        if variables_of(element).effort_unit != "V":
            return made
        beside = sharing_flow(scene.graph, element)
        feeds = next((e for e in beside if isinstance(e, Se) and not e.measured), None)
        if feeds is None:
            return made
        says = f"{self.sentence}; it may be the resistance inside {feeds.name}"
        return replace(made, sentence=says)

    def held(self, name: str, coefficient: str, unit: str) -> R:
        """Return a resistor."""
        return R(name, coefficient, unit=unit)
