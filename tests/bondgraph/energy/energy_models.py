"""Models for the tests of energy: a slider crank, a moving plate, two coupled inertias."""

from __future__ import annotations

from typing import Any

import sympy as sp

from bondgraph import TF, BondGraph, C, I, One, R, Se
from bondgraph.graph.elements import MTF, CField
from bondgraph.graph.modulation import displacement, port_variables


def rlc() -> BondGraph:
    with BondGraph("rlc") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 0.4)
        loop >> I("L", 0.5)
        loop >> C("C_1", 0.1)
    return g


def coupled() -> BondGraph:
    """Two inertias through a gear: the second depends on the first."""
    with BondGraph("coupled") as g:
        a, b = One("a"), One("b")
        Se("F") >> a >> I("m_1", 2.0)
        a >> R("d", 0.5)
        a >> TF("n", ratio=3.0) >> b >> I("m_2", 1.5)
        b >> C("k", stiffness=4.0)
    return g


def crank(dependent: bool = True) -> BondGraph:
    """A shaft that drives a piston by a ratio of its angle; the piston has mass or only load."""
    with BondGraph("crank") as g:
        shaft, piston = One("shaft"), One("piston")
        r, rod = g.parameter("r", 0.05, "m"), g.parameter("rod", 0.2, "m")
        angle = displacement("spring")
        Se("tau") >> shaft >> I("J", 0.01)
        shaft >> R("d", 0.02)
        shaft >> C("spring", stiffness=2.0)
        ratio = r * sp.sin(angle) * (1 + r * sp.cos(angle) / rod)
        shaft >> MTF("slider", ratio=ratio) >> piston
        if dependent:
            piston >> I("m", 0.5)
        piston >> R("friction", 5.0)
    return g


def plate(published: bool = False) -> BondGraph:
    """Capacitor with a moving plate, mass and spring; its force as published, or right."""
    q, x = port_variables("q", 2)
    with BondGraph("plate") as g:
        c0, x0 = g.parameter("c0", 1e-9, "F"), g.parameter("x0", 1e-3, "m")
        law: dict[str, Any] = {"energy": q**2 * x / (2 * c0 * x0)}
        if published:
            law = {"law": (q * x / (c0 * x0), c0 * x0 * q**2 / (2 * x**2))}
        device = CField("device", **law)
        loop, body = One("loop"), One("body")
        Se("V") >> loop >> R("R_s", 1e6)
        loop >> device
        body >> device
        body >> I("m", 1e-4)
        body >> C("k", stiffness=10.0)
        body >> R("d", 1e-3)
    return g
