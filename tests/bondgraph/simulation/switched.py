"""Graphs with switched junctions, and how what switched is compared."""

from __future__ import annotations

import numpy as np
import sympy as sp

from bondgraph import (
    BondGraph,
    C,
    De,
    Df,
    I,
    R,
    Se,
    Zero,
    effort,
    flow,
)
from bondgraph.graph.elements import X1, MSe
from bondgraph.graph.modulation import TIME
from bondgraph.graph.parameter import Parameter
from bondgraph.simulation.modes.guards import Guard, When
from bondgraph.simulation.modes.run import simulate_modes
from bondgraph.simulation.trajectory import Trajectory

THERMOSTAT = Guard("heater", on=When("T", below=19.0), off=When("T", above=21.0))


def diode(name: str) -> Guard:
    """Opens by a forward voltage, closes where the current would turn back."""
    return Guard(name, on=When(effort(name), above=0.0), off=When(flow(name), below=0.0))


def told(run: Trajectory) -> list[tuple[float, str]]:
    """Times of the events and ``on`` or ``off``."""
    return [(e.time, "on" if e.on else "off") for e in run.events]


def assert_same_events(
    found: list[tuple[float, str]], truth: list[tuple[float, str]], atol: float
) -> None:
    assert [m for _, m in found] == [m for _, m in truth]
    np.testing.assert_allclose([t for t, _ in found], [t for t, _ in truth], rtol=0, atol=atol)


def rectifier() -> BondGraph:
    """A source that charges a loaded capacitor through a diode."""
    with BondGraph("rectifier") as g:
        d, node = X1("D", on=False), Zero("node")
        Se("V", unit="V") >> d >> R("R_s", 0.5, unit="ohm")
        d >> node >> C("C_1", 1e-3, unit="F")
        node >> R("load", 100.0, unit="ohm")
        node >> De("u", unit="V")
        d >> Df("i", unit="A")
    return g


def oven() -> BondGraph:
    with BondGraph("oven") as g:
        heater, room = X1("heater", on=False), Zero("room")
        Se("T_h") >> heater >> R("R_h", 1.0)
        heater >> room >> C("C_r", 1.0)
        room >> R("loss", 1.0)
        room >> De("T")
    return g.with_parameters([Parameter("low", 19.0, "1"), Parameter("high", 21.0, "1")])


def diode_circuit(
    source: float, load: float, store: float, *, coil: bool, warming: bool = False
) -> BondGraph:
    """A diode before a loaded capacitor, or with a coil; `warming` modulates the resistance."""
    with BondGraph("circuit") as g:
        d, node = X1("D", on=False), Zero("node")
        Se("V", unit="V") >> d >> R("R_s", source, unit="ohm")
        if warming:
            MSe("warm", -0.1 * source * sp.sin(TIME) ** 2 * flow("D")) >> d
        if coil:
            d >> I("L", store, unit="H")
        else:
            node >> C("C_1", store, unit="F")
        d >> node >> R("load", load, unit="ohm")
        node >> De("u", unit="V")
        d >> Df("i", unit="A")
    return g


def blocks_or_conducts(g: BondGraph, turn: float, seed: int, *, held: bool) -> None:
    """No current flows back, none while it blocks, and no voltage is left across it then."""
    t = np.linspace(0.0, 10.0, 201)
    v = np.sin(turn * t) + np.random.default_rng(seed).normal(0.0, 0.3, t.size)
    hold = "hold" if held else "linear"
    run = simulate_modes(g, t, (), {"V": v}, events=[diode("D")], hold=hold)
    on = np.zeros(t.size, bool)
    for e in run.events:
        on[t >= e.time - 1e-12] = e.on
    assert run["i"].min() >= -1e-9
    assert np.abs(run["i"][~on]).max(initial=0.0) <= 1e-9
    before = np.r_[v[0], v[:-1]] if held else v  # a sample shows what was held before
    assert (np.minimum(before, v) - run["u"])[~on].max(initial=0.0) <= 1e-9
    assert [e.on for e in run.events] == [k % 2 == 0 for k in range(len(run.events))]
