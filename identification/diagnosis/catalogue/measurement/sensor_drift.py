"""A reading that wanders with time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import WarmUp
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import prompt_sensors, sensors
from identification.diagnosis.catalogue.site import Site
from identification.diagnosis.screening.port_history import FittedModel

PACES = (0.05, 0.15, 0.4)
"""Time constants of a warm-up that are tried, over the duration of the record."""


class SensorDrift(Effect):
    """`drift_1 t / T + drift_2 (t / T)^2` over the record `T`, or `h (1 - exp(-t / tau))`."""

    name = "sensor_drift"
    family = "measurement"
    kind = "sensing"
    law = "polynomial_in_time"
    sentence = "its reading wanders slowly with time, whatever is measured"
    richer = (WarmUp.name,)
    looks = (
        "a line under the whole record, straight, bent or levelling off, also where nothing moves"
    )
    confused_with = ("creep", "sensor_offset", "time_varying_parameter")
    separated_by = (
        "a long rest: drift goes on, creep dies out; and a second sensor of the same motion"
    )
    source = "second-order polynomial of time; a first-order approach for what warms up"
    meanings: ClassVar[Mapping[str, str]] = {
        "drift_1": "drift over the record that grows with time",
        "drift_2": "drift over the record that grows with the square of time",
        **WarmUp.meanings,
    }
    where = staticmethod(prompt_sensors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return a line and a parabola over the record, and approaches to a level."""
        at, found = self.site(scene, element), []
        ramp = np.linspace(0.0, 1.0, at.past.n)
        # behind a gain a law would not be in the unit of the reading
        paces = PACES if element in sensors(scene.graph) else ()
        for tau in (part * at.past.duration for part in paces):
            course = self.added(at, _warming(at, tau), {"h": 1.0})
            found.append(Signature(course[:, None], shape={"tau": tau}, course=WarmUp.name))
        return (Signature.of((ramp, ramp**2)), *found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Linear and quadratic drift, or a warm-up."""
        at = self.site(scene, element)
        if hint is not None and hint.shape:
            law = _warming(at, hint.shape["tau"])
            graph, (height, tau) = self.with_law(scene, element, law)
            start = {height: float(hint.weights[0]), tau: hint.shape["tau"]}
            made = self.inserted(element, graph, (start,), (height,))
            return replace(made, law=law.name, sentence=WARMS)
        drift = tuple(
            Parameter(
                f"drift_{j}_{element.name}", 0.0, at.unit or "1", positive=False,
                scale=0.05 * at.past.half,
            )
            for j in (1, 2)
        )  # fmt: skip
        names = tuple(p.name for p in drift)
        graph = scene.graph.with_parameters(drift).with_element(element.name, drift=names)
        start = {} if hint is None else hint.by_name(names)
        return self.inserted(element, graph, (start,), names)


def _warming(at: Site, tau: float) -> WarmUp:
    return WarmUp(tau, 0.05 * at.past.half, at.unit or "1")


WARMS = "its reading moves to another level while it warms up, whatever is measured"
