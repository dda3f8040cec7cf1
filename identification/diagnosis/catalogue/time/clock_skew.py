"""Readings sampled by another clock than the command."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, Source
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.varying_delay import at_clock
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import sources
from identification.diagnosis.screening.port_history import FittedModel

MISFITS = (0.3, 2.0, -2.0, 8.0, -8.0, 30.0, -30.0)
"""Lateness at the end of the record to try, in samples; the first is taken with either sign."""
LARGEST = 0.02
"""Ratio error beyond which nobody speaks of one sampling rate."""


class ClockSkewEffect(Effect):
    """The clock of one sensor, or of all, runs at another rate than the clock of the command.

    At a source it means the clock that all readings share.

    Where a record is longer than many periods of its fastest motion the misfit is found only if one
    of the tried ones comes within a quarter of that period at its end.
    """

    name = "clock_skew"
    family = "time"
    kind = "sensing"
    law = "clock_ratio"
    sentence = "its samples are taken by a clock that runs at another rate than the command's"
    looks = "on time at the start, later and later (or earlier) towards the end"
    confused_with = ("delay", "sensor_drift", "time_varying_parameter")
    separated_by = "one clock for drive and sensor, or the command recorded beside the reading"
    source = "two converters with oscillators of their own, ratio constant"
    meanings: ClassVar[Mapping[str, str]] = {
        "clock": "error of the ratio of the two clocks",
    }

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """First source, for all readings together; single sensors where there are several."""
        free = tuple(e for e in graph.of_type(Sensor) if e.clock is None and e.delay is None)
        if not free or len(free) < len(graph.of_type(Sensor)):
            return ()
        return (*sources(graph)[:1], *(free if len(free) > 1 else ()))

    def places_in(self, scene: FittedModel) -> tuple[Element, ...]:
        """Return `places` but on windows: a clock reaches over their edges."""
        return () if scene.data.cuts else self.places(scene.graph)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what another rate changes, for several misfits at the end of the record."""
        y, parts = scene.of(element).argument, _parts(scene, element)
        longest = max(p.size for p in parts)
        return tuple(
            Signature.of((np.concatenate([at_clock(p, r) for p in parts]) - y,), ratio=r)
            for r in _ratios(longest)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One ratio error."""
        ratio = Parameter(
            f"clock_{element.name}", 0.0, positive=False, lower=-LARGEST, upper=LARGEST, scale=1e-4
        )
        graph = scene.graph.with_parameters([ratio])
        late = graph.of_type(Sensor) if isinstance(element, Source) else (element,)
        for sensor in late:
            graph = graph.with_element(sensor.name, clock=ratio.name)
        n = max(p.size for p in _parts(scene, element))
        if hint is None:
            starts = [*_ratios(n), -_ratios(n)[0]]
        else:
            shape, w = float(hint.shape["ratio"]), float(hint.weights[0])
            tangent = abs(shape) * n < 1.0
            first = shape * float(np.clip(w, *((-8.0, 8.0) if tangent else (0.3, 1.7))))
            starts = [first] if tangent else [first, shape]
        found = tuple(
            {ratio.name: float(np.clip(s, -LARGEST, LARGEST))} for s in dict.fromkeys(starts)
        )
        return self.inserted(element, graph, found, (ratio.name,))


def _parts(scene: FittedModel, element: Element) -> list[Array]:
    """Return readings recording by recording: each begins with both clocks together."""
    return list(np.split(scene.of(element).argument, scene.data.starts))


def _ratios(n: int) -> list[float]:
    """Ratio errors that make the misfits in a record of `n` samples."""
    return [m / n for m in MISFITS if abs(m) / n <= LARGEST]
