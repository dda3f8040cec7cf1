"""``bondsight acquire --studio``: the model runs along a take, and its page asks for the next."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from itertools import count
from typing import TYPE_CHECKING, Any, final

import numpy as np

from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import BondsightError
from bondsight.cli.spoken import as_options

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.support.arrays import Array
    from hardware.contracts import Chunk
    from hardware.live.watching import Report
    from hardware.recorder import TakePlan
    from identification.diagnosis.diagnose import Diagnosis
    from identification.diagnosis.explanation.next_experiment import Experiment
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


def recorded_on_and_on(
    options: argparse.Namespace, live: LiveStudio, take: Callable[[argparse.Namespace], Diagnosis]
) -> Diagnosis:
    """Record and diagnose, then whatever next experiment the page asks for; returns the last.

    A take that fails, that the bench refuses, or whose search the page stops before anything is
    found, is told, and the last page comes back.
    """
    from bondsight.cli.output import Stopped, words_of
    from bondsight.cli.studio import kept_open

    say = words_of(options)
    found, shown = take(options), options.out
    while True:
        offers = playable(found)
        chosen = kept_open(live, shown, [e.words for e in offers], say=say)
        if chosen is None:
            return found
        asked = following(options, found, offers[chosen])
        try:
            found, shown = take(asked), asked.out
        except BondsightError as error:
            say(f"not recorded: {as_options(str(error))}")
        except Stopped as stop:
            if not live.stopped:  # Ctrl-C
                raise
            say(f"recorded, not diagnosed: {stop}")


def playable(found: Diagnosis) -> tuple[Experiment, ...]:
    """Return the experiments that one output can play: a single source moves, in volts.

    A further sensor is none: it has to be put there first.
    """

    def one(e: Experiment) -> bool:
        if e.kind == "sensor":
            return False
        moving = [found.graph[n] for n, u in e.commands.items() if np.ptp(u) > 0]
        return [s.unit for s in moving if isinstance(s, Source)] == ["V"]

    return tuple(e for e in found.experiments if found.data is not None and one(e))


def following(
    options: argparse.Namespace, found: Diagnosis, experiment: Experiment
) -> argparse.Namespace:
    """Write an experiment as a signal into a new folder, and return the options of its take."""
    from bondgraph.signals.recording import Recording

    assert found.data is not None
    number = next(n for n in count(1) if not (options.out / f"next_{n}").exists())
    name, folder = f"{options.name}_{number}", options.out / f"next_{number}"
    (volts,) = (u for u in experiment.commands.values() if np.ptp(u) > 0)
    folder.mkdir(parents=True)
    time = np.arange(volts.size, dtype=float) * found.data.dt
    signal = Recording(name, time, {"V": volts}, {"V": "V"})
    file = signal.write_csv(folder / "signal.csv")
    changed = {"signal": str(file), "name": name, "out": folder, "rate": None, "rest": 0.0}
    return argparse.Namespace(**vars(options) | changed)
