"""Readings that begin anew after each turn, as the model declares: fits take them straight.

A jump that the simulation makes a sample later than the recording is an error of a whole turn, and
a reading that is compared to the nearest turn has as many best fits as there are turns. Without the
jumps neither is so. How many turns lie before the first sample no such reading tells: it begins in
the turn in which the model does.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.laws.wrapping import Wrapping
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.study.problem import Problem
from identification.study.residual import start_point, windows

FASTEST = 0.4
"""Part of a turn between two samples up to which it is told which way round it was."""


@dataclass(frozen=True)
class Turn:
    """A turn of a reading as it reads it, SI: how long, and where it begins."""

    size: float
    low: float


def turns_of(graph: BondGraph, free: Collection[str]) -> dict[str, Turn]:
    """Return the turns of the readings that begin anew after each.

    Parameters
    ----------
    free : collection of str
        Parameters that are fitted.

    Raises
    ------
    UnusableInput
        How long a turn reads depends on one of them.
    """
    found = {}
    for s in graph.of_type(Sensor):
        if isinstance(s.law, Wrapping):
            gain = _known(graph, s, "gain", free, 1.0)
            ends = (gain * s.law.low, gain * (s.law.low + s.law.turn))
            offset = _known(graph, s, "offset", (), 0.0)
            found[s.name] = Turn(abs(gain) * s.law.turn, min(ends) + offset)
    return found


def _known(graph: BondGraph, s: Sensor, field: str, free: Collection[str], without: float) -> float:
    """Return a number of a sensor; `without` it if it has none."""
    value = graph.channel_value(s, field)
    if value is None:
        return without
    symbols = sorted(value.free_symbols, key=str)
    if fitted := [str(n) for n in symbols if str(n) in free]:
        raise UnusableInput(
            f"{s.name} begins anew after each turn, and what a turn reads depends on {fitted[0]}, "
            f"which is fitted; hold {fitted[0]}, or give recording.unwrap({s.name!r}, period) and "
            "leave the law out"
        )
    return float(value.subs({n: graph.parameters[str(n)].value for n in symbols}))


def straight_graph(graph: BondGraph) -> BondGraph:
    """Return the graph whose readings do not begin anew after each turn."""
    for s in graph.of_type(Sensor):
        if isinstance(s.law, Wrapping):
            graph = graph.with_element(s.name, law=None)
    return graph


def turning_graph(graph: BondGraph, declared: BondGraph) -> BondGraph:
    """Return a graph that was made straight with the turns as declared, where no law came since."""
    for s in declared.of_type(Sensor):
        held = graph.elements.get(s.name)
        if isinstance(s.law, Wrapping) and isinstance(held, Sensor) and held.law is None:
            graph = graph.with_element(s.name, law=s.law)
    return graph


def straight_recording(recording: Recording, turns: Mapping[str, Turn]) -> Recording:
    """Return the recording without the jumps by a turn.

    Raises
    ------
    UnusableInput
        A reading moves so far between two samples that it is not told which way round.
    """
    for name, turn in turns.items():
        if name not in recording.channels:
            continue
        made = recording.unwrap(name, turn.size)
        furthest = float(np.abs(np.diff(made[name])).max(initial=0.0)) / turn.size
        if furthest > FASTEST:
            raise UnusableInput(
                f"{recording.name}: {name} moves by {furthest:.2g} of a turn from one sample to "
                "the next: it is not told which way round; record it faster, or give a channel "
                "that counts turns and leave wraps out"
            )
        # one that is straight already says nothing of jumps
        recording = recording if np.array_equal(made[name], recording[name]) else made
    return recording


def in_turn(problem: Problem, turns: Mapping[str, Turn]) -> Problem:
    """Return the problem whose readings begin in the turn in which the model does.

    It does at the start values, from the initial states a fit begins with; each recording apart.
    """
    data = problem.data
    sizes = np.array([turns[n].size if n in turns else np.inf for n in data.names])
    if not np.isfinite(sizes).any():
        return problem
    readings = data.readings.copy()
    for begin, end, first in _beginnings(problem):
        turned = np.where(np.isfinite(first), first - readings[begin], 0.0) / sizes
        readings[begin:end] += np.where(np.isfinite(sizes), np.round(turned) * sizes, 0.0)
    return replace(problem, data=replace(data, readings=readings), built=problem.dynamics)


def _beginnings(problem: Problem) -> list[tuple[int, int, Array]]:
    """Return where each recording begins and ends, and what the model reads at first."""
    data, dynamics = problem.data, problem.dynamics
    ends = (0, *data.breaks, data.n)
    states = {
        w.start: x for w, x in zip(windows(problem), start_point(problem).states, strict=True)
    }
    found = []
    for begin, end in pairwise(ends):
        brief = slice(begin, min(begin + 2, end))
        ready = dynamics.prepare(problem.start_vector, data.step(brief), problem.steps, (), False)
        x = states.get(begin, problem.rest_state)
        run = dynamics.run(ready, problem.inputs[brief], x, problem.fine_inputs(brief))
        found.append((begin, end, np.asarray(run.y[0, : len(data.names)])))
    return found


def around(y: Array, names: Sequence[str], turns: Mapping[str, Turn]) -> Array:
    """Return readings as the instruments give them, anew after each turn, shape (N, n_y)."""
    y = y.copy()
    for c, name in enumerate(names):
        if (turn := turns.get(name)) is not None:
            y[:, c] -= turn.size * np.floor((y[:, c] - turn.low) / turn.size)
    return y
