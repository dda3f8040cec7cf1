"""The Bouc-Wen oscillator of the hysteretic benchmark (simulated)."""

from __future__ import annotations

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.hysteresis import BoucWen
from bondgraph.laws import Hysteretic


def bouc_wen(
    mass: float = 2.2,
    damping: float = 14.0,
    stiffness: float = 4e4,
    growth: float = 4e4,
    rates: tuple[float, float] = (500.0, -400.0),
) -> BondGraph:
    """Return ``m x'' + c x' + k x + z = F`` with a hysteretic force z; reads ``x``.

    ``z' = alpha x' - b (|x'| z) - g (x' |z|)``. The benchmark (J.-P. Noel, M. Schoukens, Workshop
    on Nonlinear System Identification Benchmarks, 2016) writes ``b = beta gamma`` and
    ``g = beta delta``; only the products can be seen. There ``b + g < 0``: the loop hardens and
    the force grows without limit, so the operator's claims of boundedness do not hold; the start
    values given here lie on the other side.

    Parameters
    ----------
    mass, damping, stiffness : float
        kg, N s/m, N/m.
    growth : float
        alpha, N/m.
    rates : (float, float)
        b and g, 1/m.
    """
    operator = BoucWen(slope=stiffness, gain=1.0, growth=growth, beta=rates[0], gamma=rates[1])
    with BondGraph("bouc_wen") as g:
        body = One("body")
        Se("F", unit="N") >> body
        body >> I("m", mass, unit="kg")
        body >> R("c", damping, unit="N*s/m")
        body >> C("h", law=Hysteretic(operator, free=("slope", "growth", "beta", "gamma")))
        body >> Dq("x", unit="m")
    return g
