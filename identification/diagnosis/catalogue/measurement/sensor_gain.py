"""A reading by a wrong factor: a calibration that is off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Law, Polynomial
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion
from identification.diagnosis.catalogue.places import prompt_sensors
from identification.diagnosis.catalogue.signal_traces import reading
from identification.diagnosis.catalogue.site import Site
from identification.diagnosis.screening.port_history import FittedModel


class SensorGainEffect(Effect):
    """The reading is too large or too small by one factor.

    Shows only beside other sensors, where the parameters of the model cannot make up for it.
    """

    name = "sensor_gain"
    family = "measurement"
    kind = "sensing"
    law = "line"
    laws = (Polynomial,)
    sentence = "its reading is wrong by one factor: its calibration is off"
    looks = "the error is a line over the reading, at every speed and level"
    confused_with = ("sensor_nonlinearity", "nonlinear_ratio")
    separated_by = "a known step of what the sensor measures, or a second sensor beside it"
    source = "calibration line"
    meanings: ClassVar[Mapping[str, str]] = {
        "a_1": "error of the gain: 0 is none",
        "error": "error of the gain beyond the declared one: 0 is none",
    }
    site = staticmethod(reading)
    weights = ("a_1",)

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return sensors beside others: one alone cannot be told from what drives the plant.

        A calibration that the model leaves open is no place either, the fit finds it; unless it
        is bounded.
        """
        known, stated = graph.parameters, _stated(graph)

        def held(e: Element) -> bool:
            gain = graph.channel_value(e, "gain") if isinstance(e, Sensor) else None
            held = gain is None or all(known[str(s)].fixed for s in gain.free_symbols)
            return held or e.name in stated

        several = len(graph.of_type(Sensor)) > 1
        return tuple(e for e in prompt_sensors(graph) if held(e)) if several else ()

    def places_in(self, scene: FittedModel) -> tuple[Element, ...]:
        """Return a sensor alone too if its calibration is stated, and that of no command is."""
        found = self.places(scene.graph)
        stated = _stated(scene.nominal.problem.with_chain).keys()
        if found or stated & scene.data.commands.keys():
            return found
        return tuple(e for e in prompt_sensors(scene.graph) if e.name in stated)

    def made(self, at: Site) -> Law:
        """One error of the factor; the zero is a nuisance of every fit."""
        return Polynomial(at.past.centre, 1.0, 0.05, (1,))

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One error of the factor, on top of the gain that the model declares."""
        if isinstance(element, Sensor) and element.gain is not None:
            return self._on_top(scene, element, hint)
        return super().insert(scene, element, hint)

    def _on_top(self, scene: FittedModel, element: Sensor, hint: Hint | None) -> Insertion:
        """Return an error of the gain that the model declares."""
        error = Parameter(f"error_{element.name}", 0.0, positive=False, scale=0.05)
        declared = scene.graph.channel_value(element, "gain")
        # the number stays a parameter of that name
        own = scene.graph.parameters
        held = [own[str(s)] for s in declared.free_symbols] if declared is not None else []
        graph = scene.graph.with_parameters([error, *held])
        graph = graph.with_element(element.name, gain=declared * (1 + error.symbol))
        start = {} if hint is None else hint.by_name((error.name,))
        return self.inserted(element, graph, (start,), (error.name,))


def _stated(graph: BondGraph) -> dict[str, str]:
    # the catalogue is listed without loading what fits
    from identification.study.factors import stated_gains

    return stated_gains(graph)
