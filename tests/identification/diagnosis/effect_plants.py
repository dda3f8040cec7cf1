"""Four small linear plants with their scenes, for the effects that are put into them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bondgraph import BondGraph, C, De, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Split
from bondgraph.simulation.lure import exact_form
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.study.data import Data
from tests.settled import simulate

N = 800
Array = Any


def mechanical() -> BondGraph:
    with BondGraph("oscillator") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.3, unit="kg")
        body >> R("d", 0.9, unit="N*s/m")
        body >> C("k", stiffness=30.0, unit="N/m")
        body >> Dq("x", unit="m")
        body >> Df("v", unit="m/s")
    return g


def electrical() -> BondGraph:
    with BondGraph("circuit") as g:
        loop = One("loop")
        Se("V", unit="V") >> loop >> R("R_1", 2.0, unit="ohm")
        loop >> C("C_1", 0.5, unit="F")
        loop >> Df("i", unit="A")
    return g


def coil() -> BondGraph:
    with BondGraph("coil") as g:
        loop = One("loop")
        Se("V", unit="V") >> loop >> R("R_w", 2.0, unit="ohm")
        loop >> I("L", 0.5, unit="H")
        loop >> Df("i", unit="A")
    return g


def hydraulic() -> BondGraph:
    with BondGraph("tanks") as g:
        upper, pipe, lower = Zero("upper"), One("pipe"), Zero("lower")
        Sf("Q", unit="m3/s") >> upper >> C("T_1", 0.02, unit="m3/Pa")
        upper >> pipe >> R("R_1", 50.0, unit="Pa*s/m3")
        pipe >> lower >> C("T_2", 0.03, unit="m3/Pa")
        lower >> R("R_2", 40.0, unit="Pa*s/m3")
        upper >> De("p_1", unit="Pa")
        lower >> De("p_2", unit="Pa")
    return g


@dataclass(frozen=True)
class Plant:
    build: Callable[[], BondGraph]
    drive: str
    dt: float
    command: Callable[[Array], Array]


def tones(t: Array) -> Array:
    """Two sines that start from rest."""
    return np.sin(3.1 * t) * np.minimum(t, 1.0) + 0.6 * np.sin(7.7 * t) * np.minimum(t, 1.0)


PLANTS = {
    "mechanical": Plant(mechanical, "F", 0.02, lambda t: 20.0 * tones(t)),
    "electrical": Plant(electrical, "V", 0.02, lambda t: 4.0 * tones(t)),
    "coil": Plant(coil, "V", 0.02, lambda t: 4.0 * tones(t)),
    "hydraulic": Plant(hydraulic, "Q", 0.02, lambda t: 0.1 * (1 + tones(t)) * (t > 0)),
}


@cache
def scene(name: str) -> FittedModel:
    plant = PLANTS[name]
    graph = plant.build()
    t = plant.dt * np.arange(N)
    command = {plant.drive: plant.command(t)}
    names = SignalNames(graph)
    ports = {}
    for element in graph.of_type(C, R, I):
        (bond,) = graph.bonds_of(element.name)
        argument = f"q_{element.name}" if isinstance(element, C) else names.flow(bond)
        ports[element.name] = (argument, names.effort(bond))
    watched = tuple({n for pair in ports.values() for n in pair})
    run = simulate(graph, t, command, observed=watched)
    past = {}
    for e, (a, b) in ports.items():
        moved = np.concatenate([[0.0], np.cumsum(0.5 * (run[a][1:] + run[a][:-1])) * plant.dt])
        past[e] = PortHistory(run[a], run[b], plant.dt, None if isinstance(graph[e], C) else moved)
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    readings = np.stack([run[s] for s in sensors], axis=1)
    floor = 1e-3 * readings.std(axis=0)
    split = Split(slice(0, 500), slice(500, N), "first part")
    data = Data("run", t, command, readings, sensors, floor, split)
    noise = np.random.default_rng(1).normal(size=readings.shape) * floor
    noise[:, 0] += 5 * floor[0] * np.sin(21.0 * t)
    nominal: Any = None  # no effect looks at the fit itself
    return FittedModel(graph, data, nominal, noise, past)


def response(
    graph: BondGraph, plant: str, values: Mapping[str, float], accuracy: float = 1e-6
) -> Array:
    s = scene(plant)
    rest = np.zeros(exact_form(graph).n_x)  # type: ignore[union-attr]
    run = simulate(graph, s.data.time, s.data.commands, values, x0=rest, accuracy=accuracy)
    return np.stack([run[n] for n in s.data.names], axis=1)


def response_to_effort(plant: str, element: str, effort: Array) -> Array:
    """Readings of the nominal graph when `effort` is added to that of one element."""
    s = scene(plant)
    (bond,) = s.graph.bonds_of(element)
    graph = s.graph.with_inserted(bond, One("probe")).with_branch("probe", [])
    graph.bond(graph.add(Se("added")), graph["probe"])
    rest = np.zeros(exact_form(graph).n_x)  # type: ignore[union-attr]
    commands = {**s.data.commands, "added": -effort}
    run = simulate(graph, s.data.time, commands, x0=rest, accuracy=1e-6)
    return np.stack([run[n] for n in s.data.names], axis=1)
