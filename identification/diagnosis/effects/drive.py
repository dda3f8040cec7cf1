"""Effects between a command and the source that should follow it."""

from __future__ import annotations

import numpy as np

from bondgraph.drives import Drive
from bondgraph.elements import Element, Parameter
from bondgraph.graph import BondGraph
from bondgraph.laws import DeadZone, Saturation
from identification.diagnosis.effects.effect import Effect, Insertion, sources
from identification.diagnosis.scene import Scene


class SaturationEffect(Effect):
    """The drive bends flat near the ends of its range."""

    name = "saturation"
    family = "drive"
    law = "soft_saturation"
    sentence = "its output stays behind the command near the ends of the range"
    confused_with = ("nonlinear_stiffness", "sensor_nonlinearity")
    source = "hyperbolic corner, common in describing-function texts"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sources."""
        return sources(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Two limits with a soft knee, tried close to and inside the ends."""
        past = scene.of(element)
        low, high = past.centre - past.half, past.centre + past.half
        span = high - low
        law = Saturation(low + 0.08 * span, high - 0.08 * span, 0.02 * span, getattr(element, "unit", ""))
        names = tuple(p.name for p in law.parameters(element.name))
        starts = (
            {},
            {names[0]: low + 0.25 * span, names[1]: high - 0.25 * span, names[2]: 0.05 * span},
        )
        graph = scene.graph.with_element(element.name, drive=Drive(law=law))
        return self.inserted(element, graph, starts, names[:2])


class DeadZoneEffect(Effect):
    """The drive does not respond to small commands about a centre."""

    name = "dead_zone"
    family = "drive"
    law = "dead_zone"
    sentence = "it does not respond within a band of commands"
    confused_with = ("hysteresis",)
    source = "describing-function texts, e.g. Gelb and Vander Velde 1968"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sources."""
        return sources(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Dead band at the middle of the range, at the median and at zero."""
        past = scene.of(element)
        span = 2 * past.half
        law = DeadZone(past.centre, 0.02 * span, span, getattr(element, "unit", ""))
        width, centre = (p.name for p in law.parameters(element.name))
        starts: list[dict[str, float]] = [{}, {width: 0.002 * span}]
        if abs(past.centre) > 0.02 * span and past.argument.min() < 0 < past.argument.max():
            starts.append({centre: 0.0})
        median = float(np.median(past.argument))
        if abs(median - past.centre) > 0.1 * span:
            starts.append({centre: median})
        graph = scene.graph.with_element(element.name, drive=Drive(law=law))
        return self.inserted(element, graph, tuple(starts), (width,))


class LowPass(Effect):
    """The drive follows with a first-order lag."""

    name = "low_pass"
    family = "drive"
    law = "first_order_lag"
    sentence = "it follows the command with a first-order lag"
    confused_with = ("delay", "sensor_lag")
    source = "single-pole amplifier"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sources."""
        return sources(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """One lag, from a fraction of a sample to a part of the record."""
        dt, n = scene.data.dt, scene.data.n
        tau = Parameter(f"tau_{element.name}", 2 * dt, "s", lower=0.02 * dt, upper=0.1 * n * dt)
        graph = scene.graph.with_parameters([tau]).with_element(
            element.name, drive=Drive(lag=tau.name)
        )
        starts = ({}, {tau.name: 0.4 * dt}, {tau.name: 15 * dt})
        return self.inserted(element, graph, starts, (tau.name,))
