"""The plant of most small tests: a mass on a spring with a damper, pushed, its place read."""

from __future__ import annotations

from bondgraph import BondGraph, C, Dq, I, One, R, Se


def spring(m: float = 0.5, d: float = 2.0, k: float = 200.0) -> BondGraph:
    with BondGraph("spring") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", m, unit="kg")
        v >> R("d", d, unit="N*s/m")
        v >> C("k", stiffness=k, unit="N/m")
        v >> Dq("x", unit="m")
    return g
