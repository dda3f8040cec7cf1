"""Dead time of a drive or of a reading."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Element, Source
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.fractional_delay import delayed_values
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import commands, prompt_sensors, sources
from identification.diagnosis.catalogue.signal_traces import weight_of
from identification.diagnosis.screening.port_history import FittedModel

DELAYS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Dead times to try, in samples."""


class Delay(Effect):
    """Dead time between command and response, or of one reading.

    Several commands that move are late together: a fit takes dead times at the readings.
    """

    name = "delay"
    family = "time"
    kind = "command"
    law = "dead_time"
    sentence = "everything after it comes a fixed time late"
    looks = "shifted along time, the same at every frequency and amplitude, gain untouched"
    confused_with = ("low_pass", "sensor_lag")
    separated_by = (
        "a multisine over two decades: the phase of a delay falls in proportion, at full gain"
    )
    source = "transport delay"
    meanings: ClassVar[Mapping[str, str]] = {
        "delay": "dead time",
    }

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Drives and sensors; a sensor alone only where there are several.

        All inputs are late together, so beside measured ones a command is no place of its own.
        """
        readings, inputs = prompt_sensors(graph), sources(graph)
        measured = tuple(e for e in inputs if e not in commands(graph))
        return (*(measured or inputs), *(readings if len(readings) > 1 else ()))

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what lateness changes, for several dead times."""
        s, dt = scene.of(element).argument, scene.data.dt
        return tuple(
            Signature.of((delayed_values(s, k) - s,), tau=k * dt)
            for k in DELAYS
            if k < 0.1 * scene.data.n
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One dead time, started where the signature has it or at several sizes."""
        dt = scene.data.dt
        tau = Parameter(f"delay_{element.name}", 0.0, "s", positive=False, lower=0.0, scale=dt)
        graph = scene.graph.with_parameters([tau])
        if isinstance(element, Source):
            for s in _moving(scene, element):
                held = s.drive or Drive()
                graph = graph.with_element(s.name, drive=replace(held, delay=tau.name))
        else:
            graph = graph.with_element(element.name, delay=tau.name)
        if hint is None:
            starts = [k * dt for k in (0.5, 1, 2, 3, 4, 6, 8, 10, 12, 16, 24, 40)]
        else:
            shape = float(hint.shape["tau"])
            starts = [shape * weight_of(hint, 0, 0.2, 2.0), shape, 0.75 * shape]
        found = tuple({tau.name: s} for s in dict.fromkeys(starts))
        return self.inserted(element, graph, found, (tau.name,))


def _moving(scene: FittedModel, element: Source) -> tuple[Source, ...]:
    """`element` and every other source whose command moves."""
    commands = scene.data.commands
    return tuple(
        s
        for s in scene.graph.of_type(Source)
        if s.name == element.name or float(np.ptp(commands.get(s.name, np.zeros(1)))) > 0
    )
