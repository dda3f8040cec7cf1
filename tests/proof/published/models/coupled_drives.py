"""The coupled electric drives: two motors, a belt, a pulley and a sensor without sign."""

from __future__ import annotations

from bondgraph import TF, BondGraph, C, De, I, MSe, MSf, One, R, Se, Zero
from bondgraph.graph.modulation import effort, flow
from bondgraph.laws import Coulomb, TableLaw

RECTIFIER = TableLaw((-1.0, 0.0, 1.0), (1.0, 0.0, 1.0), flat=False)
"""Absolute value: a pulse counter does not see the direction."""


def coupled_drives(*, rectified: bool = True, friction: float | None = 2.0) -> BondGraph:
    """Return two inertias joined by an elastic belt, and the counter that reads ``y``.

    Third order in the mechanics, as in T. Wigren, M. Schoukens, Coupled Electric Drives Data Set
    and Reference Models, Uppsala 2017; the counter's pulses are smoothed by a first-order filter
    behind the rectifier. Speeds are in units of the reading, the motors' inertia is the gauge.

    Parameters
    ----------
    rectified : bool
        The counter gives the absolute value; otherwise the speed with its sign.
    friction : float or None
        Start value of the motors' dry friction; None leaves it out.
    """
    with BondGraph("coupled_drives") as g:
        motors, pulley = One("motors"), One("pulley")
        belt, stretch = Zero("belt"), One("stretch")
        Se("u", unit="V") >> TF("K", ratio=0.05) >> motors
        motors >> I("J_m", 1.0, fixed=True)
        motors >> R("b_m", 7.0, law=None if friction is None else Coulomb(friction, unit="1"))
        motors >> belt >> pulley
        belt >> stretch >> C("k_b", stiffness=60.0)
        stretch >> R("d_b", 0.01)
        pulley >> I("J_p", 0.16)
        pulley >> R("b_p", 0.6)
        counter, filtering, reading = One("counter"), One("filtering"), Zero("reading")
        MSf("seen", value=flow("pulley")) >> counter
        counter >> R(
            "count", None if rectified else 1.0, law=RECTIFIER if rectified else None, fixed=True
        )
        MSe("pulses", value=effort("count")) >> filtering >> R("R_f", 1.0, fixed=True)
        filtering >> reading >> C("tau_f", 0.0165)
        reading >> De("y")
    return g
