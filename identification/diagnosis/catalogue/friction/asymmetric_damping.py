"""Damping that differs between the two directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws import AsymmetricDamping, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.site import Site, Values


class AsymmetricDampingEffect(Effect):
    """Damping that differs between the two directions."""

    name = "asymmetric_damping"
    family = "friction"
    kind = "dissipative"
    law = "asymmetric_damping"
    laws = (AsymmetricDamping,)
    sentence = "it damps one direction of motion more than the other"
    looks = "even harmonics and a shift of the mean that grow in proportion to the amplitude"
    confused_with = ("bilinear_stiffness", "quadratic_drag")
    separated_by = (
        "the same sine at two frequencies: the shift of the mean grows with the speed if it is the "
        "damper and stays if it is the spring"
    )
    source = "Dixon, The Shock Absorber Handbook, 2nd ed. 2007 (rebound and compression)"
    where = staticmethod(mechanical_resistors)

    weights = ("d_a",)
    rebalances = False  # the mean of both coefficients is the resistor's own

    def made(self, at: Site) -> Law:
        """Half the difference of both coefficients beside their mean."""
        return AsymmetricDamping(0.0, 0.3 * at.past.slope, at.unit or "N*s/m")

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return it with either sign; beyond the mean one of the two would be negative."""
        size = at.past.slope
        if hint is None:
            return {"d_a": 0.2 * size}, {"d_a": -0.2 * size}
        return ({"d_a": np.clip(hint.weights[0], -0.9 * size, 0.9 * size)},)
