"""Models whose readings use all that a sensor has, and sources recorded in every way."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph import BondGraph, C, Da, Df, Dq, I, One, R, Reading, Se, Sf, Zero
from bondgraph.graph.modulation import effort, flow

TIME = np.linspace(0.0, 1.0, 1001)
FORCE = 3.0 * np.sin(15.0 * TIME) + np.sin(40.0 * TIME)


def spring(source: dict[str, Any] | None = None, **channel: Any) -> BondGraph:
    """A mass on a spring; `channel` are fields of the sensor of its position."""
    with BondGraph("spring") as g:
        v = One("v")
        Se("F", unit="N", **(source or {})) >> v >> I("m", 0.5, unit="kg")
        v >> C("k", stiffness=200.0, unit="N/m")
        v >> R("d", 2.0, unit="N*s/m")
        v >> Dq("x", unit="m", **channel)
    return g


def bench() -> BondGraph:
    """Encoder, accelerometer, force cell, and a monitor of the command."""
    g = spring({"gain": 1.5, "offset": 0.2}, gain=2.0, offset=0.01, resolution=2e-3)
    with g:
        dynamics: dict[str, Any] = {"natural_frequency": 300.0, "damping_ratio": 0.6}
        g["v"] >> Da("a", gain=0.1, offset=-0.5, unit="V", **dynamics)
        Reading("f", effort("k"), unit="N", lag=4e-3)
        Reading("monitor", effort("F"), unit="N", gain=0.25)
    return g


def shaken(given: str) -> BondGraph:
    """A body on a base of which the velocity, the acceleration or the displacement is recorded."""
    unit = {"value": "m/s", "rate": "m/s^2", "integral": "m"}[given]
    with BondGraph("shaken") as g:
        s, gap, body = Zero("s"), One("gap"), One("body")
        Sf("b", unit=unit, given=given) >> s >> body >> I("m", 0.3, unit="kg")
        s >> gap >> C("k", stiffness=200.0, unit="N/m")
        gap >> R("d", 0.8, unit="N*s/m")
        body >> Df("w", unit="m/s", natural_frequency=200.0, damping_ratio=0.7)
        Reading("force", effort("s"), unit="N", offset=0.3)
        if given == "rate":
            body >> Da("a", unit="m/s^2")
    return g


def power() -> BondGraph:
    """A reading that multiplies signals."""
    g = spring()
    with g:
        Reading("P", effort("F") * flow("v"), unit="W", gain=0.5, offset=0.1)
    return g
