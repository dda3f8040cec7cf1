"""Dry friction of constant level."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import Coulomb, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.friction.forms import FRICTION_FORMS, friction_forms
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import at_least


class CoulombFriction(Effect):
    """Dry friction of constant level."""

    name = "coulomb_friction"
    family = "friction"
    kind = "dissipative"
    law = "coulomb"
    laws = (Coulomb,)
    sentence = "a force of constant size opposes every motion and holds at rest"
    looks = (
        "flat tops where the motion turns, an error of the same size at small and large "
        "amplitude, a step of the force with every change of direction"
    )
    confused_with = ("stribeck_friction", "presliding_friction", "hysteresis")
    separated_by = (
        "constant slow speeds in both directions and a reversal within the slip length: Coulomb "
        "friction has one level and no spring before it slides"
    )
    source = "Coulomb 1785; Moreau 1988 for the implicit step"
    where = staticmethod(mechanical_resistors)
    richer = FRICTION_FORMS
    forms = staticmethod(friction_forms)

    weights = ("F_c",)

    def made(self, at: Site) -> Law:
        """Coulomb law beside the viscous one."""
        return Coulomb(0.3 * _force(at), unit=at.units[0])

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return two levels: along a bent nominal model the screening may see next to nothing."""
        force = _force(at)
        seen = 0.05 if hint is None else at_least(hint.weights[0] / force, 0.02)
        return [{"F_c": level * force} for level in (0.3, seen)]


def _force(at: Site) -> float:
    return at_least(at.past.swing, 1e-12)
