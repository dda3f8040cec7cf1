"""Force that grows with the square of the speed."""

from __future__ import annotations

from bondgraph.laws import Law, QuadraticDrag
from identification.diagnosis.catalogue.friction.rubbing import Rubbing
from identification.diagnosis.catalogue.site import Site


class Drag(Rubbing):
    """Force that grows with the square of the speed."""

    name = "quadratic_drag"
    kind = "dissipative"
    law = "quadratic_drag"
    laws = (QuadraticDrag,)
    sentence = "a force that grows with the square of the speed opposes the motion"
    looks = "peaks at high speed are too low, slow motion is right; damping grows with amplitude"
    confused_with = ("coulomb_friction", "asymmetric_damping")
    separated_by = "free decay or steady speeds from slow to fast: damping grows with the speed"
    source = "Newton's drag law; Batchelor, An Introduction to Fluid Dynamics, section 5.11"

    weights = ("c_2",)

    def made(self, at: Site) -> Law:
        """Quadratic law beside the viscous one."""
        effort, _, way = at.units
        return QuadraticDrag(0.2 * at.past.swing / at.past.half**2, f"{effort}*s2/{way}2")
