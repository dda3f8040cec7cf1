"""Dead times and clocks of sources and sensors, around a simulation that knows neither."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.fractional_delay import TAPS, delayed
from bondgraph.signals.varying_delay import at_clock
from bondgraph.support.arrays import Array
from bondgraph.support.errors import real_number


def is_timed(graph: BondGraph) -> bool:
    """Whether anything is late or has a clock of its own."""
    delayed_source = any(e.drive and e.drive.delay for e in graph.of_type(Source))
    return delayed_source or any(map(_is_timed, graph.of_type(Sensor)))


def dead_times(graph: BondGraph, parameters: Mapping[str, float]) -> dict[str, float]:
    """Dead time in seconds of sources and sensors that have one."""
    return _values_of(graph, named_delays(graph), parameters)


def named_delays(graph: BondGraph) -> dict[str, str]:
    """Return the parameter that is the dead time of each source and sensor that has one."""
    names = {e.name: e.drive.delay for e in graph.of_type(Source) if e.drive and e.drive.delay}
    return names | {e.name: e.delay for e in graph.of_type(Sensor) if e.delay}


def clock_errors(graph: BondGraph, parameters: Mapping[str, float]) -> dict[str, float]:
    """Ratio errors of the sensors' clocks, where they have one of their own."""
    names = {e.name: e.clock for e in graph.of_type(Sensor) if e.clock}
    return _values_of(graph, names, parameters)


def late_resolutions(graph: BondGraph, parameters: Mapping[str, float]) -> dict[str, float]:
    """Return steps of the sensors that are late or have a clock: they round what they sample."""
    coarse = (e for e in graph.of_type(Sensor) if e.resolution is not None and _is_timed(e))
    names = {e.name: str(graph.channel_value(e, "resolution")) for e in coarse}
    return _values_of(graph, names, parameters)


def _is_timed(e: Sensor) -> bool:
    return bool(e.delay or e.clock)


def _values_of(
    graph: BondGraph, names: Mapping[str, str], parameters: Mapping[str, float]
) -> dict[str, float]:
    """Values of the parameters that elements name, by element."""
    known = graph.parameters if names else {}
    found = {}
    for element, n in names.items():
        if n not in known:
            graph.require_sound()
        found[element] = real_number(n, parameters.get(n, known[n].value))
    return found


def without_timing(graph: BondGraph) -> BondGraph:
    """Return the graph with neither dead times nor clocks, and without rounding behind them."""
    for e in graph.of_type(Source):
        if e.drive and e.drive.delay:
            graph = graph.with_element(e.name, drive=replace(e.drive, delay=None))
    for e in graph.of_type(Sensor):
        if _is_timed(e):
            graph = graph.with_element(e.name, delay=None, clock=None, resolution=None)
    return graph


def sent(
    graph: BondGraph,
    time: Array,
    commands: Mapping[str, Array] | None,
    parameters: Mapping[str, float] | None,
    before: float | None,
    hold: str,
) -> dict[str, Array]:
    """Return the commands as they arrive behind the dead times of their sources; see `late`.

    What is held jumps between two samples, and has the mean of the old and the new value there: no
    polynomial goes through a staircase without ringing, even before it is sent.
    """
    delays = dead_times(graph, parameters or {})
    return late(commands or {}, delays, np.asarray(time), before, stairs=hold == "hold")


def read(
    graph: BondGraph,
    time: Array,
    outputs: Mapping[str, Array],
    parameters: Mapping[str, float] | None,
) -> dict[str, Array]:
    """Return the outputs of a simulation as late sensors with clocks of their own give them."""
    values = parameters or {}
    taken = clocked(late(outputs, dead_times(graph, values), time), clock_errors(graph, values))
    return rounded(taken, late_resolutions(graph, values))


def late(
    signals: Mapping[str, Array],
    held: Mapping[str, float],
    time: Array,
    before: float | None = None,
    *,
    stairs: bool = False,
) -> dict[str, Array]:
    """Delay signals that have a dead time; before, they rest at `before`, or their first value.

    Those that are `stairs` keep the mean over every sample, others are interpolated.
    """
    step = float(np.diff(time).mean()) if time.size > 1 else 1.0
    shifted = _mean_behind if stairs else _behind
    return {
        n: shifted(np.asarray(v, float), held[n] / step, before) if held.get(n) else v
        for n, v in signals.items()
    }


def _behind(values: Array, samples: float, before: float | None) -> Array:
    front = 0 if before is None else int(samples) + TAPS
    whole = np.concatenate([np.full(front, before or 0.0), values])
    return delayed(whole, samples)[0][front:]


def _mean_behind(values: Array, samples: float, before: float | None) -> Array:
    n = np.arange(values.size)
    first = values[:1] if before is None else [before]
    return np.asarray(np.interp(n - samples, [-1, *n], np.concatenate([first, values])))


def clocked(signals: Mapping[str, Array], ratios: Mapping[str, float]) -> dict[str, Array]:
    """Take the signals at the times of their sensors' clocks."""
    found = dict(signals)
    for n, ratio in ratios.items():
        found[n] = at_clock(found[n], ratio)
    return found


def rounded(signals: Mapping[str, Array], steps: Mapping[str, float]) -> dict[str, Array]:
    """Round the signals that have a step to its nearest multiple."""
    found = dict(signals)
    for n, step in steps.items():
        found[n] = step * np.floor(found[n] / step + 0.5)
    return found
