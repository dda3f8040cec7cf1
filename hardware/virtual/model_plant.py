"""A model of the language that stands on the virtual bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import BondsightError, UnusableInput, real_number, require_known
from hardware.simulators.plant_contract import PlantMotion
from hardware.virtual.steppers import March, march_of


@final
class ModelPlant:
    """Any model, advanced step by step from rest at 0.

    A linear model up to scalar laws takes exact steps; any other goes through the general
    integrator. State and memory of operators are carried from call to call, so a record does not
    depend on how it was cut.

    Parameters
    ----------
    graph : BondGraph
        The model. Dead times and clocks of its own are refused: on a bench the devices have them.
    source : str
        Source that the terminal voltage (or force, ...) drives; the other sources stay at 0.
    displacement : str
        Sensor that reads what the interferometer sees (m).
    current : str, optional
        Sensor that reads the current (A); NaN without.
    parameters : mapping, optional
        Values that differ from the declared ones.
    step : float
        Step (s): small against what the nonlinear laws do, and against what is to be seen between
        steps.
    substeps : int
        Steps of the integrator in one of the plant.

    Raises
    ------
    UnknownName
        A source, sensor or parameter that the model does not have.
    UnusableInput
        A model that cannot stand on a bench.

    Examples
    --------
    >>> plant = ModelPlant(graph, "F", "x", step=1e-3)
    >>> float(plant.advance(np.full(3, 8.0)).x[-1]) > 0
    True
    """

    def __init__(
        self,
        graph: BondGraph,
        source: str,
        displacement: str,
        current: str | None = None,
        *,
        parameters: Mapping[str, float] | None = None,
        step: float = 5e-6,
        substeps: int = 1,
    ) -> None:
        if real_number("step", step) <= 0.0 or substeps < 1:
            raise UnusableInput(f"{graph.name}: step and substeps must be positive")
        _checked(graph, source, [displacement, *([current] if current else [])])
        self._name = graph.name
        self.step = step
        self._march: March = march_of(graph, source, dict(parameters or {}), step, substeps)
        names = self._march.outputs
        self._x = names.index(displacement)
        self._i = names.index(current) if current else None
        self._zero = float(self._march.rest[self._x])

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per value of the source, ``(n,)``.

        Raises
        ------
        BondsightError
            If the model has no solution there.
        """
        volts = np.asarray(volts, dtype=np.float64)
        if not volts.size:
            return PlantMotion(np.zeros(0), np.zeros(0))
        y = self._march.advance(volts)
        if not np.isfinite(y[-1]).all():
            raise BondsightError(
                f"{self._name}: the model grew beyond bounds on the bench; a smaller step or more "
                "substeps, or a gentler voltage"
            )
        current = np.full(volts.size, np.nan) if self._i is None else y[:, self._i]
        return PlantMotion(y[:, self._x] - self._zero, np.ascontiguousarray(current))

    def snapshot(self) -> Any:
        """Return a copy of state and memory."""
        return self._march.snapshot()

    def restore(self, state: Any) -> None:
        """Put a state back."""
        self._march.restore(state)


def _checked(graph: BondGraph, source: str, sensors: Sequence[str]) -> None:
    graph.require_sound()
    sources = {e.name: e for e in graph.of_type(Source)}
    readings = {e.name: e for e in graph.of_type(Sensor)}
    require_known("source", graph.name, sources, source)
    require_known("sensor", graph.name, readings, *sensors)
    late = [e.name for e in sources.values() if e.drive and e.drive.delay]
    late += [e.name for e in readings.values() if e.delay or e.clock]
    if late:
        raise UnusableInput(
            f"{graph.name}: {', '.join(late)} has a dead time or a clock of its own; give those to "
            "the devices of the bench and leave them out of the model"
        )
