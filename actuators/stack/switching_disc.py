"""A ferroelectric disc whose polarisation switches: current, charge and strain of one element."""

from __future__ import annotations

from bondgraph import MTF, BondGraph, C, Df, Dq, One, R, Reading, Se, displacement
from bondgraph.laws import LawSum, Polynomial, StopSum

SATURATION = 0.25
"""C/m2."""
COERCIVE = 1.2e6
"""V/m."""
SOURCE = "soft PZT as handbooks give it: 1.2 kV/mm, 0.25 C/m2, Q33 = 0.02 m4/C2; not measured"


def switching_disc(*, thickness: float = 0.8e-3, area: float = 60e-6) -> BondGraph:
    """Polarisation with memory, and the strain ``Q P^2`` of the same polarisation.

    ``C_p`` holds pinned walls (stops) in a Landau potential: its voltage follows from its charge.
    Between current and velocity stands the modulated transformer ``dx/dq = 2 Q h q / A^2``, which
    is what electrostriction is (Devonshire, Phil. Mag. 40 (1949) 1040; Landis, J. Mech. Phys.
    Solids 50 (2002) 127): no power is made, and a pull at the face acts back on the voltage. Driven
    past the coercive voltage the displacement draws the butterfly; about a polarisation that stays
    it is the linear piezo.

    Parameters
    ----------
    thickness, area : float
        h and A, m and m2.

    Returns
    -------
    BondGraph
        Commands ``V_in`` (V) and ``F_e`` (N, pulls the face); readings ``i`` (A), ``P`` (C/m2) and
        ``x`` (m, from where it starts). Mass and stiffness show far above what switches.
    """
    most, coercive = SATURATION * area, COERCIVE * thickness
    walls = StopSum((0.1 * most, 0.3 * most), height=2.5 * coercive / most, unit="V/C")
    potential = Polynomial(0.0, most, 0.1 * coercive, (3, 5), unit="V")
    charge = displacement("C_p")
    with BondGraph("switching_disc") as g:
        strain = g.parameter("Q", 0.02, "m4/C2", source=SOURCE)
        disc, face = One("disc"), One("face")
        Se("V_in", unit="V") >> disc >> R("R_e", 1e5, unit="ohm")
        disc >> C("C_p", 5 * most / coercive, unit="F", law=LawSum((walls, potential)))
        rate = 2 * strain * thickness / area**2 * charge
        disc >> MTF("T_s", ratio=rate, unit="m/C") >> face
        Se("F_e", unit="N") >> face
        disc >> Df("i", unit="A")
        Reading("P", charge / area, unit="C/m2")
        face >> Dq("x", unit="m")
    return g.with_values({"a_3_C_p": 0.1 * coercive, "a_5_C_p": 0.3 * coercive})
