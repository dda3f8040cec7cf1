"""Dry friction whose level falls with speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws import Law, Stribeck
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.catalogue.friction.forms import FRICTION_FORMS, friction_forms
from identification.diagnosis.catalogue.friction.rubbing import Rubbing
from identification.diagnosis.catalogue.site import Site, Values, over, times
from identification.diagnosis.catalogue.starts import at_least


class StribeckFriction(Rubbing):
    """Dry friction whose level falls with speed."""

    name = "stribeck_friction"
    kind = "dissipative"
    law = "stribeck"
    laws = (Stribeck,)
    sentence = "dry friction that is larger near rest than in motion"
    looks = "as Coulomb friction, with a peak of the force where the motion starts, and stick-slip"
    confused_with = ("coulomb_friction", "presliding_friction")
    separated_by = (
        "constant speeds from very slow to fast: the force falls with speed before the viscous "
        "part lifts it; Coulomb friction stays level"
    )
    simpler = ("coulomb_friction", *Rubbing.simpler)
    source = "Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083"
    richer = FRICTION_FORMS
    forms = staticmethod(friction_forms)

    weights = ("F_c", "F_d")
    shapes = over(speed=times("rms", 0.04, 0.1, 0.3, 1.0))
    at_shape = False

    def made(self, at: Site, speed: float = 0.0) -> Law:
        """Stribeck law beside the viscous one."""
        force, (effort, flow, _) = at_least(at.past.swing, 1e-12), at.units
        return Stribeck(0.2 * force, 0.1 * force, speed or 0.3 * at.past.rms, effort, flow)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the levels at a slow speed and at the usual one."""
        usual = 0.3 * at.past.rms
        if hint is None:
            force = at_least(at.past.swing, 1e-12)
            tried = [(0.2 * force, 0.1 * force, usual), (0.05 * force, 0.05 * force, 0.3 * usual)]
        else:
            (found,) = super().tried(at, law, hint)
            level, drop = found.values()
            v = float(np.clip(hint.shape["speed"], 0.04 * at.past.rms, 2.0 * at.past.rms))
            slower = max(0.8 * v, 0.04 * at.past.rms)
            tried = [(level, drop, v), (level, level, usual), (level, level, slower)]
        return [dict(zip(("F_c", "F_d", "f_s"), values, strict=True)) for values in tried]
