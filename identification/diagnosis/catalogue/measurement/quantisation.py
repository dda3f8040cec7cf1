"""A reading that knows few values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Law, Rounding
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.measurement.grid_step import quantisation_step
from identification.diagnosis.catalogue.measurement.periodic_error import promising_cycles
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading
from identification.diagnosis.catalogue.site import Site, Values


class Quantisation(Effect):
    """The reading is rounded to an even grid, coarse against everything else that is wrong.

    Step and origin of the grid are read off the recording. A fine grid is part of the noise floor
    and never a finding; a coarse one is, when the fitted model predicts the rounding errors
    themselves: the weight of their column is then near one.
    """

    name = "quantisation"
    family = "measurement"
    kind = "sensing"
    law = "rounding"
    laws = (Rounding,)
    sentence = "its reading is rounded to few values"
    looks = "stairs: few distinct values, the residual even between half a step below and above"
    confused_with = ("periodic_error", "dead_zone", "coulomb_friction", "sensor_nonlinearity")
    separated_by = "count the distinct values of the reading; a finer range of the converter"
    source = "uniform quantiser, Widrow 1956"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return sensors that round nothing in the model."""
        return tuple(e for e in sensors(graph) if isinstance(e, Sensor) and e.resolution is None)

    site = staticmethod(reading)
    weights = ("amount",)

    def grid(self, at: Site) -> Sequence[Values]:
        """Return the grid of the reading, or the likeliest ones.

        A reading that was rounded before noise came to it lies on no grid; its step is where the
        residual repeats itself along the reading.
        """
        found = _grid(at)
        if found:
            return [found]
        # what a converter rounded finely may have been rounded coarsely before
        least = COARSER * at.scene.data.resolution.get(at.element.name, 0.0)
        y, left = at.past.argument, at.residual
        steps = (_sharpened(y, left, step) for step in _repeating(y, left))
        return [{"step": h, "origin": 0.0} for h in steps if h > least]

    def made(self, at: Site, step: float = 0.0, origin: float = 0.0) -> Law:
        """Round to a grid; to one too fine to matter where there is none."""
        grid = {"step": step, "origin": origin} if step else _grid(at)
        grid = grid or {"step": 1e-9 * 2 * at.past.half, "origin": 0.0}
        return Rounding(**grid, unit=at.unit or "1")

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return rounding in full: it is never anything else."""
        return ({"amount": 1.0},)


COARSER = 2.0
"""Times the declared unit of a converter from which a step is another one."""

TRIED = 3
"""Steps that are tried where the reading lies on no grid."""


def _rounded(y: Array, step: float, origin: float) -> Array:
    return np.asarray(origin + step * np.floor((y - origin) / step + 0.5))


def _repeating(y: Array, left: Array) -> list[float]:
    span = float(np.ptp(y)) or 1.0
    return [span / float(c) for c in promising_cycles(y, left, TRIED)]


def _sharpened(y: Array, left: Array, step: float) -> float:
    """Step near `step` whose rounding errors are most like the residual."""
    half = 0.25 * step / (float(np.ptp(y)) or 1.0)

    def likeness(h: float) -> float:
        error = _rounded(y, h, 0.0) - y
        return float(abs(error @ left) / (np.linalg.norm(error) + 1e-300))

    tries = step * (1 + half * np.linspace(-1, 1, 21))
    return float(max(tries, key=likeness))


def _grid(at: Site) -> Values:
    data, name = at.scene.data, at.element.name
    readings = data.readings[:, data.names.index(name)]
    step = quantisation_step(readings)
    if step is None or step < 1.01 * data.resolution.get(name, 0.0):
        return {}  # a converter that is known to be coarse is no finding
    return {"step": step, "origin": float(readings[0] - step * np.round(readings[0] / step))}
