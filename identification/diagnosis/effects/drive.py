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
        """Return sources."""
        return sources(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Two limits with a soft knee, tried close to and inside the ends."""
        past = scene.of(element)
        low, high = past.centre - past.half, past.centre + past.half
        span = high - low
        law = Saturation(
            low + 0.08 * span, high - 0.08 * span, 0.02 * span, getattr(element, "unit", "")
        )
        names = tuple(p.name for p in law.parameters(element.name))
        insides = ((0.02, 0.02), (0.05, 0.05), (0.1, 0.1), (0.25, 0.25), (-0.1, 0.08), (0.08, -0.1))
        starts = tuple(
            {names[0]: low + a * span, names[1]: high - b * span, names[2]: knee * span}
            for a, b in insides
            for knee in (0.01, 0.05)
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
        """Return sources."""
        return sources(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Dead band at the middle of the range, at the median and at zero."""
        past = scene.of(element)
        span = 2 * past.half
        law = DeadZone(past.centre, 0.02 * span, span, getattr(element, "unit", ""))
        width, centre = (p.name for p in law.parameters(element.name))
        starts: list[dict[str, float]] = [{width: w * span} for w in (0.002, 0.02, 0.06)]
        if abs(past.centre) > 0.02 * span and past.argument.min() < 0 < past.argument.max():
            starts += [{centre: 0.0, width: w * span} for w in (0.005, 0.03)]
        median = float(np.median(past.argument))
        if abs(median - past.centre) > 0.1 * span:
            starts += [{centre: median, width: w * span} for w in (0.005, 0.03)]
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
        """Return sources."""
        return sources(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """One lag, from a fraction of a sample to a part of the record."""
        dt, n = scene.data.dt, scene.data.n
        tau = Parameter(f"tau_{element.name}", 2 * dt, "s", lower=0.02 * dt, upper=0.1 * n * dt)
        graph = scene.graph.with_parameters([tau]).with_element(
            element.name, drive=Drive(lag=tau.name)
        )
        starts = tuple({tau.name: k * dt} for k in (0.4, 2.0, 6.0, 20.0, 100.0))
        return self.inserted(element, graph, starts, (tau.name,))
