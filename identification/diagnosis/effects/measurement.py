"""Effects in a sensor or a clock: drift, curvature, lag, dead time."""

from __future__ import annotations

from dataclasses import replace

from bondgraph.drives import Drive
from bondgraph.elements import Element, Parameter, Source
from bondgraph.graph import BondGraph
from bondgraph.laws import Polynomial
from identification.diagnosis.effects.effect import Effect, Insertion, sensors, sources
from identification.diagnosis.scene import Scene


class SensorDrift(Effect):
    """The reading wanders with time."""

    name = "sensor_drift"
    family = "measurement"
    law = "polynomial_in_time"
    sentence = "its reading wanders slowly with time, whatever is measured"
    confused_with = ("creep",)
    source = "second-order polynomial of time"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sensors."""
        return sensors(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Linear and quadratic drift."""
        past = scene.of(element)
        size = 0.05 * past.half
        drift = tuple(
            Parameter(
                f"drift_{j}_{element.name}",
                0.0,
                getattr(element, "unit", ""),
                positive=False,
                scale=size,
            )
            for j in (1, 2)
        )
        names = tuple(p.name for p in drift)
        graph = scene.graph.with_parameters(drift).with_element(element.name, drift=names)
        return self.inserted(element, graph, ({},), names)


class SensorNonlinearity(Effect):
    """The reading bends away from the true value."""

    name = "sensor_nonlinearity"
    family = "measurement"
    law = "polynomial"
    sentence = "its reading bends away from the true value"
    confused_with = ("nonlinear_stiffness", "saturation")
    source = "calibration polynomial"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sensors."""
        return sensors(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Quadratic and cubic term about the centre of the readings."""
        past = scene.of(element)
        law = Polynomial(
            past.centre, past.half, 0.05 * past.half, unit=getattr(element, "unit", "")
        )
        law = replace(law)
        names = tuple(p.name for p in law.parameters(element.name))
        graph = scene.graph.with_element(element.name, law=law)
        return self.inserted(element, graph, ({},), names)


class SensorLag(Effect):
    """The reading follows with a first-order lag."""

    name = "sensor_lag"
    family = "measurement"
    law = "first_order_lag"
    sentence = "its reading follows the true value with a first-order lag"
    confused_with = ("low_pass", "delay")
    source = "single-pole sensor"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sensors."""
        return sensors(graph)

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """One lag."""
        dt, n = scene.data.dt, scene.data.n
        tau = Parameter(f"tau_{element.name}", 2 * dt, "s", lower=0.02 * dt, upper=0.1 * n * dt)
        graph = scene.graph.with_parameters([tau]).with_element(element.name, lag=tau.name)
        return self.inserted(
            element,
            graph,
            tuple({tau.name: k * dt} for k in (0.4, 2.0, 6.0, 20.0, 100.0)),
            (tau.name,),
        )


class Delay(Effect):
    """Dead time between command and response, or of one reading."""

    name = "delay"
    family = "time"
    law = "dead_time"
    sentence = "everything after it comes a fixed time late"
    confused_with = ("low_pass", "sensor_lag")
    source = "transport delay"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Drives and sensors; a sensor alone only where there are several."""
        readings = sensors(graph)
        return (*sources(graph), *(readings if len(readings) > 1 else ()))

    def insert(self, scene: Scene, element: Element) -> Insertion:
        """One dead time, started at several sizes."""
        dt = scene.data.dt
        tau = Parameter(f"delay_{element.name}", 0.0, "s", positive=False, lower=0.0, scale=dt)
        graph = scene.graph.with_parameters([tau])
        if isinstance(element, Source):
            graph = graph.with_element(element.name, drive=Drive(delay=tau.name))
        else:
            graph = graph.with_element(element.name, delay=tau.name)
        starts = tuple(
            {tau.name: k * dt}
            for k in (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 16.0, 24.0, 40.0)
        )
        return self.inserted(element, graph, starts, (tau.name,))
