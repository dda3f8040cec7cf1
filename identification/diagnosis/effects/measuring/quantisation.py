"""A reading that knows few values."""

from __future__ import annotations

import numpy as np

from bondgraph.elements import Element
from bondgraph.graph import BondGraph
from bondgraph.laws.rounding import Rounding
from identification.diagnosis.effects.effect import Effect, Hint, Insertion, Signature, sensors
from identification.diagnosis.effects.measuring.grid_step import quantisation_step
from identification.diagnosis.effects.signal_traces import reading_without_offset, unit_of, weighed
from identification.diagnosis.scene import Scene

__all__ = ["Quantisation"]

Array = np.ndarray


class Quantisation(Effect):
    """The reading is rounded to an even grid, coarse against everything else that is wrong.

    Step and origin of the grid are read off the recording. A fine grid is part of the noise floor
    and never a finding; a coarse one is, when the fitted model predicts the rounding errors
    themselves: the weight of their column is then near one.
    """

    name = "quantisation"
    family = "measurement"
    law = "rounding"
    sentence = "its reading is rounded to few values"
    looks = "stairs: few distinct values, the residual even between half a step below and above"
    confused_with = ("dead_zone", "coulomb_friction", "sensor_nonlinearity")
    separated_by = "count the distinct values of the reading; a finer range of the converter"
    source = "uniform quantiser, Widrow 1956"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Sensors."""
        return sensors(graph)

    def signatures(self, scene: Scene, element: Element) -> tuple[Signature, ...]:
        """Return the rounding error of the simulated reading; nothing where there is no grid."""
        y = reading_without_offset(scene, element)
        found = _grid(scene, element)
        if found is None:
            return (weighed((np.zeros(y.size),)),)
        step, origin = found
        return (weighed((origin + step * np.floor((y - origin) / step + 0.5) - y,), step=step),)

    def insert(self, scene: Scene, element: Element, hint: Hint | None = None) -> Insertion:
        """Round to the grid of the recording; to one too fine to matter where there is none."""
        y = reading_without_offset(scene, element)
        tiny = 1e-9 * (float(np.ptp(y)) or 1.0)
        step, origin = _grid(scene, element) or (tiny, 0.0)
        law = Rounding(step, origin, unit=unit_of(element))
        amount, *_ = (p.name for p in law.parameters(element.name))
        graph = scene.graph.with_element(element.name, law=law)
        return self.inserted(element, graph, ({amount: 1.0},), (amount,))


def _grid(scene: Scene, element: Element) -> tuple[float, float] | None:
    readings = scene.data.readings[:, scene.data.names.index(element.name)]
    step = quantisation_step(readings)
    if step is None or step < 1.01 * scene.data.resolution.get(element.name, 0.0):
        return None  # a converter that is known to be coarse is no finding
    return step, float(readings[0] - step * np.round(readings[0] / step))
