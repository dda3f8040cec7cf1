"""A reading whose zero jumps during the record."""

from __future__ import annotations

import numpy as np

from bondgraph.elements import Element
from bondgraph.graph import BondGraph
from bondgraph.laws.onset import Onset
from identification.diagnosis.effects.effect import Effect, Hint, Insertion, Signature, sensors
from identification.diagnosis.effects.signal_traces import unit_of, weighed
from identification.diagnosis.scene import Scene

__all__ = ["SensorOffset"]

JUMPS = 24
"""Times of the jump to try, evenly over the record."""
RISE = 0.25
"""Rise time of a tried jump over the distance of two."""


class SensorOffset(Effect):
    """The zero of the reading jumps once.

    An offset that stays is a nuisance of every fit, not a finding. The time of the jump counts from
    the start of a run, so where a record is scored on windows this law starts anew in each and will
    not explain a jump; the linear screening still sees it.
    """

    name = "sensor_offset"
    family = "measurement"
    law = "jump_of_zero"
    sentence = "the zero of its reading jumps at one time"
    looks = "the residual is flat, then flat again at another level"
    confused_with = ("sensor_drift", "external_disturbance")
    separated_by = (
        "a second sensor of the same motion: a jump of one zero is not felt by the plant and sets "
        "nothing swinging"
    )
    source = "step in time with a finite rise"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sensors."""
        return sensors(graph)

    def signatures(self, scene: Scene, element: Element) -> tuple[Signature, ...]:
        """Unit steps at several times."""
        past = scene.of(element)
        times, rise = _grid(scene)
        return tuple(
            weighed((0.5 * (1 + np.tanh((past.time - t) / rise)),), time=float(t)) for t in times
        )

    def insert(self, scene: Scene, element: Element, hint: Hint | None = None) -> Insertion:
        """One jump, started where the signature has it or at several times."""
        past = scene.of(element)
        times, rise = _grid(scene)
        found = [float(t) for t in times[::6]] if hint is None else [float(hint.shape["time"])]
        margin = float(scene.data.n * scene.data.dt) if hint is None else 1.5 * rise / RISE
        law = Onset(
            found[0], rise, margin, 0.05 * past.half, unit_of(element), free_standing=False
        )
        height, begin, width = (p.name for p in law.parameters(element.name))
        graph = scene.graph.with_element(element.name, law=law)
        if hint is None:
            starts = tuple({begin: t} for t in found)
            return self.inserted(element, graph, starts, (height,))
        start = {height: float(hint.weights[0]), begin: found[0]}
        return self.inserted(element, graph, (start,), (height,))


def _grid(scene: Scene) -> tuple[np.ndarray, float]:
    """Times to try, s, and the rise of the jumps there."""
    length = scene.data.dt * (scene.data.n - 1)
    times = length * np.arange(1, JUMPS + 1) / (JUMPS + 1)
    return times, RISE * length / (JUMPS + 1)
