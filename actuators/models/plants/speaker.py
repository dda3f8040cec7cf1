"""A loudspeaker in a closed box; its suspension is known to harden."""

from __future__ import annotations

from actuators.models.plants.spread import SPREAD
from bondgraph import GY, TF, BondGraph, C, Da, De, Df, I, One, R, Se, Zero
from bondgraph.laws.polynomial import Polynomial


def speaker() -> BondGraph:
    """Return a loudspeaker in a closed box; its suspension is known to harden.

    u - R_e, L_e - Bl - m, k (hardening), b - S_d - C_b, R_b.

    Measured are the current, the acceleration of the cone and the pressure in the box.
    """
    hardening = Polynomial(half=1e-3, size=0.1, orders=(3,), unit="N")
    with BondGraph("speaker") as g:
        coil, cone, box = One("coil"), One("cone"), Zero("box")
        Se("u", unit="V") >> coil >> R("R_e", 6.0, unit="ohm", spread=SPREAD)
        coil >> I("L_e", 1e-3, unit="H", spread=SPREAD)
        coil >> GY("Bl", ratio=7.0, unit="N/A", spread=SPREAD) >> cone
        cone >> I("m", 0.02, unit="kg", spread=SPREAD)
        cone >> C("k", stiffness=2.5e3, unit="N/m", spread=SPREAD, law=hardening)
        cone >> R("b", 1.2, unit="N*s/m", spread=SPREAD)
        cone >> TF("S_d", ratio=0.02, unit="m2", spread=SPREAD) >> box
        box >> C("C_b", 1.4e-7, unit="m3/Pa", spread=SPREAD)
        box >> R("R_b", 3e5, unit="Pa*s/m3", spread=SPREAD)
        coil >> Df("i", unit="A")
        cone >> Da("a", unit="m/s^2")
        box >> De("p", unit="Pa")
    return g.with_values({"a_3_k": 0.1})
