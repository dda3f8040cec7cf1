"""A spring with two slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.laws import Bilinear, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import springs
from identification.diagnosis.catalogue.site import Site, Values, over
from identification.diagnosis.screening.port_history import PortHistory

STIFFEST = 3.0
"""Change of slope over the slope from which a spring's second part is a stop."""


def _knees(past: PortHistory) -> tuple[float, ...]:
    """Return knees in the range, and the natural length of a spring, a likely corner."""
    knees = [past.reach(share) for share in (-0.7, -0.4, -0.15, 0.0, 0.15, 0.4, 0.7)]
    natural = 0.05 * past.half < abs(past.centre) < 0.7 * past.half
    return (*knees, 0.0) if natural else tuple(knees)


class BilinearStiffness(Effect):
    """A spring with another slope beyond a knee, up to four times as stiff."""

    name = "bilinear_stiffness"
    family = "restoring"
    kind = "restoring"
    law = "bilinear"
    laws = (Bilinear,)
    sentence = "it has another stiffness beyond one point of its stroke"
    looks = "effort over displacement is two straight lines with one corner"
    confused_with = ("contact_loss", "end_stop", "nonlinear_stiffness", "asymmetric_damping")
    separated_by = (
        "slow loading through the whole stroke: one corner between two finite slopes; a stop is "
        "many times stiffer, a lost contact has no slope at all beyond it"
    )
    source = "Shaw and Holmes, J. Sound and Vibration 90 (1983) 129"
    simpler = ("contact_loss",)
    where = staticmethod(springs)

    weights = ("dk",)
    shapes = over(knee=_knees)
    at_shape = False

    def made(self, at: Site, **shape: float) -> Law:
        """Change of slope and knee."""
        past, unit = at.past, at.unit or "N/m"
        knee = shape.get("knee", past.centre)
        return Bilinear(0.0, knee, past.slope, past.half, at.units[2], unit)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the knee of the hint, one further inside, and half of the change."""
        k, centre = at.past.slope, at.past.centre
        tried = [(0.3 * k, centre), (-0.3 * k, centre)]
        if hint is not None:
            knee, change = hint.shape["knee"], float(np.clip(hint.weights[0], -0.8 * k, 3 * k))
            tried = [(change, knee), (change, knee - 0.3 * (knee - centre)), (0.5 * change, knee)]
        return [{"dk": change, "knee": knee} for change, knee in tried]

    def holds(self, at: Site) -> Mapping[str, tuple[float, float]]:
        """Return the changes of a spring: what is stiffer is a stop."""
        return {"dk": (-np.inf, STIFFEST * at.past.slope)}
