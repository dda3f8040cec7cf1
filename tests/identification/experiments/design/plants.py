"""The two plants of the design tests: a linear spring, and a stage with a Maxwell slip store."""

from __future__ import annotations

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic

NOISE = {"x": 2e-4}


def stage() -> BondGraph:
    with BondGraph("stage") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 0.1, unit="kg", fixed=True)
        body >> R("d", 40.0, unit="N*s/m", fixed=True)
        spring = MaxwellResistiveCapacitor((2e4, 1e4), (6.0, 9.0))
        body >> C("k", law=Hysteretic(spring, ("stiffnesses", "breakaways")))
        body >> C("guide", stiffness=1e4, unit="N/m")
        body >> Dq("x", unit="m")
    return g
