"""``bondsight acquire --studio``: the model as it is runs along while a take is recorded."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, final

import numpy as np

from bondgraph.graph.elements import Sensor
from bondgraph.signals.units import parse_unit

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.support.arrays import Array
    from hardware.contracts import Chunk
    from hardware.live.watching import Report
    from hardware.recorder import TakePlan
    from identification.diagnosis.studio.live import LiveStudio

POINTS = 20_000
"""Points of a take that are drawn, at most."""


@final
class RunningAlong:
    """Hold what arrives of a take against the model at its declared values.

    The waveform is known before the take, so the model is simulated once. A sensor's zero is
    arbitrary: both begin at zero. Clocks are aligned afterwards only, so here sample k of a stream
    is taken at k over its rate.

    Parameters
    ----------
    live : LiveStudio
        Is told.
    plan : TakePlan
        What is played.
    graph : BondGraph
        The model.
    maps : iterable of str
        ``NAME=COLUMN``, sources and sensors.
    rates : mapping of str to float
        Hz, by stream; a stream that the output clocks has the plan's.
    """

    def __init__(
        self,
        live: LiveStudio,
        plan: TakePlan,
        graph: BondGraph,
        maps: Iterable[str],
        rates: Mapping[str, float],
    ) -> None:
        from bondgraph.simulation.simulate import simulate

        columns = dict(m.split("=", 1) for m in maps)
        driven = [n for n, column in columns.items() if column == "V"] or ["V"]
        self._live = live
        self._rates = {s: plan.rate if plan.synchronisation == "clock" else rates[s] for s in rates}
        self._time = np.arange(plan.volts.size) / plan.rate
        made = simulate(graph, self._time, dict.fromkeys(driven, plan.volts), x0="rest")
        sensors = [e.name for e in graph.of_type(Sensor)]
        self._model: dict[str, Array] = {columns.get(n, n): made[n] for n in sensors}
        self._zero: dict[str, float] = {}

    def __call__(self, report: Report) -> None:
        """Tell of every channel that the model has, SI."""
        for chunk in report.chunks:
            step = max(1, round(self._rates.get(chunk.stream, 0.0) * self._time[-1] / POINTS))
            at = np.arange(-chunk.first % step, chunk.n, step)
            for name in self._model.keys() & chunk.channels.keys():
                if at.size and chunk.stream in self._rates:
                    self._live.take(self._told(chunk, name, at))

    def _told(self, chunk: Chunk, name: str, at: Array) -> dict[str, Any]:
        t = (chunk.first + at) / self._rates[chunk.stream]
        y = chunk.channels[name][at] * parse_unit(chunk.units[name]).scale
        model = np.interp(t, self._time, self._model[name]) - self._model[name][0]
        y = y - self._zero.setdefault(name, float(y[0] - model[0]))
        good = np.isfinite(y)
        unit = parse_unit(chunk.units[name]).si
        named = {"name": f"{name} ({unit})" if unit else name}
        return named | {k: v[good].tolist() for k, v in (("t", t), ("y", y), ("model", model))}
