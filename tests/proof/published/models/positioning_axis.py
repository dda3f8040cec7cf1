"""The electro-mechanical positioning system EMPS: motor, ball screw and carriage."""

from __future__ import annotations

from bondgraph import BondGraph, Dq, I, One, R, Se
from bondgraph.laws import Coulomb


def positioning_axis(
    mass: float = 80.0, viscous: float = 300.0, coulomb: float = 15.0
) -> BondGraph:
    """Return ``M x'' + F_v x' + F_c sign(x') = F + F_0``; reads the position ``x``.

    A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, Workshop on Nonlinear
    System Identification Benchmarks, Eindhoven 2019; their offset is ``-F_0``.

    Parameters
    ----------
    mass, viscous, coulomb : float
        Start values: kg, N s/m, N.
    """
    with BondGraph("positioning_axis") as g:
        g.parameter("F_0", 0.0, "N", positive=False, scale=3.0)
        carriage = One("carriage")
        Se("F", unit="N", offset="F_0") >> carriage
        carriage >> I("M", mass, unit="kg")
        carriage >> R("F_v", viscous, unit="N*s/m", law=Coulomb(coulomb))
        carriage >> Dq("x", unit="m")
    return g
