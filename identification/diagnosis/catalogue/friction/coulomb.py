"""Dry friction of constant level."""

from __future__ import annotations

from typing import final

from identification.diagnosis.catalogue.constant_level import ConstantLevel
from identification.diagnosis.catalogue.friction.forms import FRICTION_FORMS, friction_forms
from identification.diagnosis.catalogue.friction.rubbing import Rubbing


@final
class CoulombFriction(ConstantLevel, Rubbing):
    """Dry friction of constant level."""

    name = "coulomb_friction"
    law = "coulomb"
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
    richer = FRICTION_FORMS
    forms = staticmethod(friction_forms)
