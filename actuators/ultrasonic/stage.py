"""Driver, plate and stage as a bond graph: table, first-order lag, mass, damper, dry friction.

The model of figure 8.1 of the stack actuator thesis (after Villgrattner), ``V_c -> dead zone -> F
-> 1 / (m s^2 + b s) -> x``, with the characteristic of figure 8.3 and, if wanted, what it leaves
out.
"""

from __future__ import annotations

from actuators.ultrasonic.characteristic import voltage_force
from actuators.ultrasonic.data_sheet import M661
from bondgraph import BondGraph, Df, Dq, I, One, R, Se
from bondgraph.graph.drives import Drive
from bondgraph.laws import Coulomb, Law

MOVED_MASS = 10e-3
"""kg; an assumption: the printed 30 g are the whole actuator, the moved part is not printed."""
MASS_SOURCE = "assumed: a third of the 30 g of the whole actuator (thesis table 3.2)"
DAMPING_SOURCE = "thesis table 3.2: 1 N push force over 500 mm/s"


def ultrasonic_stage(
    *,
    law: Law | None = None,
    mass: float = MOVED_MASS,
    damping: float = M661.damping,
    friction: float = 0.0,
    lag: float | None = None,
    sensors: tuple[str, ...] = ("x", "v"),
) -> BondGraph:
    """Return the ultrasonic plate actuator that moves a free stage.

    Parameters
    ----------
    law : Law, optional
        Force (N) less 1 N/V times the control voltage; the table of `voltage_force` when left out.
    mass : float
        kg.
    damping : float
        N s/m; the speed of the vibrating contact falls in proportion to the load.
    friction : float
        Dry friction of the guide, N; 0 leaves it out (figure 8.1 has none).
    lag : float, optional
        Time constant of the vibration's build-up, s; it acts on the force.
    sensors : tuple of {"x", "v"}

    Returns
    -------
    BondGraph
        Input ``V_c`` (V); states ``p_m`` and the position; with a lag also ``z_V_c`` (N).

    Examples
    --------
    >>> ultrasonic_stage().check()
    ()
    """
    with BondGraph("ultrasonic_stage") as g:
        if lag is not None:
            g.parameter("tau", lag, "s", source="build-up of the vibration, Q / (pi f)")
        stage = One("stage")
        drive = Drive(law=law or voltage_force(), lag=None if lag is None else "tau")
        Se("V_c", unit="V", drive=drive) >> stage
        stage >> I("m", mass, unit="kg", spread=3.0, source=MASS_SOURCE)
        stage >> R(
            "b",
            damping,
            unit="N*s/m",
            spread=5.0,
            source=DAMPING_SOURCE,
            law=Coulomb(friction) if friction else None,
        )
        if "x" in sensors:
            stage >> Dq("x", unit="m")
        if "v" in sensors:
            stage >> Df("v", unit="m/s")
    return g
