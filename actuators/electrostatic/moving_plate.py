"""The moving-plate capacitor: an electrostatic actuator as one store of energy, with pull-in.

A plate on a spring, a gap of rest ``g`` before a fixed electrode:
``W(q, x) = q^2 (g - x) / (2 eps A) + k x^2/2``. Its gradient gives the voltage
``q (g - x)/(eps A)`` and the force ``k x - q^2/(2 eps A)``. The suspension belongs to the same
energy, so that the displacement is one state and no eigenvalue is lost to counting it twice. Fringe
fields are left out.
"""

from __future__ import annotations

from typing import Any

from actuators.materials.ceramics import VACUUM_PERMITTIVITY
from actuators.stack.charge_drive import current_driven
from bondgraph import BondGraph, Df, Dq, I, One, R, Se
from bondgraph.graph.elements import CField
from bondgraph.graph.modulation import port_variables

SOURCE = "example: a plate of 0.4 mm by 0.4 mm over 2 um of air"


def moving_plate(
    *,
    stiffness: float = 1.0,
    gap: float = 2e-6,
    area: float = 1.6e-7,
    permittivity: float = VACUUM_PERMITTIVITY,
    mass: float = 1e-9,
    damping: float = 1e-5,
    resistance: float | None = None,
    sensors: tuple[str, ...] = ("x",),
) -> BondGraph:
    """Moving-plate capacitor under the voltage ``V_in``.

    Parameters
    ----------
    stiffness, gap, area, permittivity : float
        N/m, m, m^2, F/m.
    mass, damping : float
        kg, N s/m.
    resistance : float, optional
        Between source and plate, ohm; without it the charge is solved from the voltage.
    sensors : tuple of {"x", "i"}
        Displacement and current.

    Returns
    -------
    BondGraph
        States ``q_plate2`` (the displacement), ``p_m``, with a resistance ``q_plate1``.

    Examples
    --------
    >>> sorted(moving_plate().parameters)
    ['A', 'b', 'eps', 'gap', 'k', 'm']
    """
    with BondGraph("moving_plate") as g:
        q, x = port_variables("q", 2)
        k = g.parameter("k", stiffness, "N/m", spread=2.0, source=SOURCE)
        rest = g.parameter("gap", gap, "m", spread=1.5, source=SOURCE)
        face = g.parameter("A", area, "m^2", spread=1.2, source=SOURCE)
        eps = g.parameter("eps", permittivity, "F/m", fixed=True, source="CODATA 2018, vacuum")
        energy = q**2 * (rest - x) / (2 * eps * face) + k * x**2 / 2
        plate = CField("plate", energy=energy, units=("V", "N"))
        loop, body = One("loop"), One("body")
        Se("V_in", unit="V") >> loop >> plate
        if resistance is not None:
            loop >> R("R_e", resistance, unit="ohm", spread=3.0, source=SOURCE)
        body >> plate
        body >> I("m", mass, unit="kg", spread=2.0, source=SOURCE)
        body >> R("b", damping, unit="N*s/m", spread=10.0, source=SOURCE)
        if "i" in sensors:
            loop >> Df("i", unit="A")
        if "x" in sensors:
            body >> Dq("x", unit="m")
    return g


def moving_plate_charge(**options: Any) -> BondGraph:
    """Moving-plate capacitor whose charge the current ``i_in`` imposes: no pull-in in the gap.

    Options of `moving_plate`.
    """
    return current_driven(moving_plate(**options), name="moving_plate_charge")
