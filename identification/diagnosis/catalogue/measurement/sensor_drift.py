"""A reading that wanders with time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.graph.parameter import Parameter
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import prompt_sensors
from identification.diagnosis.screening.port_history import FittedModel


class SensorDrift(Effect):
    """The reading wanders with time."""

    name = "sensor_drift"
    family = "measurement"
    kind = "sensing"
    law = "polynomial_in_time"
    sentence = "its reading wanders slowly with time, whatever is measured"
    looks = "a straight or bent line under the whole record, also where nothing moves"
    confused_with = ("creep", "sensor_offset", "time_varying_parameter")
    separated_by = (
        "a long rest: drift goes on, creep dies out; and a second sensor of the same motion"
    )
    source = "second-order polynomial of time"
    meanings: ClassVar[Mapping[str, str]] = {
        "drift_1": "drift over the record that grows with time",
        "drift_2": "drift over the record that grows with the square of time",
    }
    where = staticmethod(prompt_sensors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return a line and a parabola over the record."""
        ramp = np.linspace(0.0, 1.0, scene.data.n)
        return (Signature.of((ramp, ramp**2)),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Linear and quadratic drift."""
        past, unit = scene.of(element), str(getattr(element, "unit", "")) or "1"
        drift = tuple(
            Parameter(
                f"drift_{j}_{element.name}", 0.0, unit, positive=False,
                scale=0.05 * past.half,
            )
            for j in (1, 2)
        )  # fmt: skip
        names = tuple(p.name for p in drift)
        graph = scene.graph.with_parameters(drift).with_element(element.name, drift=names)
        start = {} if hint is None else hint.by_name(names)
        return self.inserted(element, graph, (start,), names)
