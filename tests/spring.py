"""The plant of most small tests: a mass on a spring with a damper, pushed, its place read."""

from __future__ import annotations

from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se
from bondgraph.laws import Law


def spring(
    m: float = 0.5,
    d: float | None = 2.0,
    k: float | None = 200.0,
    law: Law | None = None,
    friction: Law | None = None,
    *,
    name: str = "spring",
    speed: str = "",
) -> BondGraph:
    """Laws bend spring and damper, or replace them; `speed` names a second sensor."""
    d = None if friction is not None and friction.slope is not None else d
    k = None if law is not None and law.slope is not None else k
    with BondGraph(name) as g:
        v = One("body" if speed == "v" else "v")  # names are addresses
        Se("F", unit="N") >> v >> I("m", m, unit="kg")
        v >> R("d", d, unit="N*s/m", law=friction)
        v >> C("k", stiffness=k, unit="N/m", law=law)
        v >> Dq("x", unit="m")
        if speed:
            v >> Df(speed, unit="m/s")
    return g
