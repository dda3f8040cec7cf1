"""Plants that only the general dynamics runs, and recordings of them with known truths."""

from __future__ import annotations

import numpy as np
import sympy as sp

from bondgraph import GY, BondGraph, C, De, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.equations.codegen import program_of
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import MTF, CField, RField
from bondgraph.graph.modulation import displacement, port_variables
from bondgraph.signals.recording import Recording
from bondgraph.simulation.dynamics import GeneralDynamics
from identification.experiments.design import multisine
from tests.settled import simulate


def general(graph: BondGraph) -> GeneralDynamics:
    """Return the general dynamics of any graph, of linear ones as well."""
    return GeneralDynamics(program_of(equations(graph)), graph.parameters)


def pendulum() -> BondGraph:
    """A rigid pendulum: a store of one port with an energy."""
    angle = sp.Symbol("q1", real=True)
    with BondGraph("pendulum") as g:
        weight, shaft = g.parameter("mgl", 3.0, "N*m"), One("shaft")
        Se("T", unit="N*m") >> shaft >> I("J", 0.05, unit="kg*m^2")
        shaft >> R("b", 0.04, unit="N*m*s/rad")
        shaft >> CField("gravity", energy=weight * (1 - sp.cos(angle)), ports=1)
        shaft >> Dq("phi", unit="rad")
    return g


def motor() -> BondGraph:
    """A motor behind a gear whose ratio changes with the position of a loaded spring."""
    with BondGraph("motor") as g:
        n, e = g.parameter("n", 0.2, "1"), g.parameter("e", 0.3, "1")
        loop, shaft, load = One("loop"), One("shaft"), One("load")
        Se("V", unit="V") >> loop >> R("Ra", 1.0, unit="ohm")
        loop >> I("La", 5e-3, unit="H")
        loop >> GY("kt", ratio=0.1, unit="N*m/A") >> shaft
        shaft >> I("J", 1e-3, unit="kg*m^2")
        shaft >> R("b", 2e-3, unit="N*m*s/rad")
        shaft >> MTF("gear", ratio=n * (1 + e * sp.sin(displacement("spring")))) >> load
        load >> C("spring", stiffness=3.0, unit="N*m/rad")
        load >> R("d", 5e-2, unit="N*m*s/rad")
        loop >> Df("i", unit="A")
        load >> Dq("phi", unit="rad")
    return g


def tank() -> BondGraph:
    """Two tanks (a store of two ports) and an orifice whose flow must be solved for."""
    q1, q2 = port_variables("q", 2)
    flow = sp.Symbol("f1", real=True)
    with BondGraph("tank") as g:
        area, k = g.parameter("area", 0.02, "m^2"), g.parameter("k", 4e7, "kg/m^7")
        first, second, between = Zero("first"), Zero("second"), One("between")
        Sf("Q", unit="m^3/s") >> first
        first >> CField("store", energy=9810 * (q1**2 + q2**2) / (2 * area), ports=2)
        second >> g["store"]
        first >> between >> second
        between >> R("pipe", 5e5, unit="Pa*s/m^3")
        second >> RField("valve", law=(k * flow * sp.sqrt(flow**2 + 1e-14),), ports=1)
        first >> De("p1", unit="Pa")
        second >> De("p2", unit="Pa")
    return g


def coupled() -> BondGraph:
    """Two masses on a coupled spring: linear, so that both dynamics run it."""
    with BondGraph("coupled") as g:
        k1, k12 = g.parameter("k1", 300.0, "N/m"), g.parameter("k12", 80.0, "N/m")
        k2 = g.parameter("k2", 200.0, "N/m")
        a, b = One("a"), One("b")
        Se("F", unit="N") >> a >> I("m1", 1.0, unit="kg")
        a >> R("d1", 2.0, unit="N*s/m")
        a >> CField("k", matrix=((k1, k12), (k12, k2)))
        b >> g["k"]
        b >> I("m2", 0.5, unit="kg")
        b >> R("d2", 1.0, unit="N*s/m")
        a >> Dq("x1", unit="m")
        b >> Dq("x2", unit="m")
    return g


def recorded(
    graph: BondGraph,
    source: str,
    rate: float,
    period: int,
    band: tuple[float, float],
    *,
    peak: float = 1.0,
    bias: float = 0.0,
    periods: int = 4,
    noise: float = 0.01,
    seed: int = 0,
) -> Recording:
    """Multisine answers with white noise; two periods are run before the record begins."""
    signal = multisine(rate, period, periods=2 + periods, peak=peak, band=band, bias=bias,
                       seed=seed)  # fmt: skip
    time = np.arange(signal.values.size) / rate
    made = simulate(graph, time, {source: signal.values}, accuracy=1e-7).outputs
    rng = np.random.default_rng(1000 + seed)
    channels = {source: np.asarray(signal.values)} | {
        n: v + noise * v.std() * rng.standard_normal(v.size) for n, v in made.items()
    }
    kept = slice(2 * period, None)
    return Recording(
        graph.name, time[: periods * period], {n: v[kept] for n, v in channels.items()},
        {n: getattr(graph[n], "unit", "") or "1" for n in channels},
    )  # fmt: skip


def swung(amplitude: float = 1.0, **options: int) -> Recording:
    """Return the pendulum's record; 3 N*m swings it through 120 degrees."""
    return recorded(pendulum(), "T", 50.0, 500, (0.1, 4.0), peak=amplitude, **options)


def driven() -> Recording:
    """Return the motor's record."""
    return recorded(motor(), "V", 200.0, 1000, (0.2, 20.0), peak=4.0)


def filled() -> Recording:
    """Return the tanks' record, about an inflow that keeps them from running dry."""
    return recorded(tank(), "Q", 2.0, 1000, (0.002, 0.2), peak=2e-3, bias=4e-3)
