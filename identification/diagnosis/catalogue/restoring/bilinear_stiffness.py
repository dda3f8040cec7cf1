"""A spring with two slopes."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Bilinear
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import springs
from identification.diagnosis.catalogue.starts import reach, rebalanced, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

SHARES = (-0.7, -0.4, -0.15, 0.0, 0.15, 0.4, 0.7)
"""Knees tried, over half the range from its middle."""
STIFFEST = 3.0
"""Change of slope over the slope from which a spring's second part is a stop."""


class BilinearStiffness(Effect):
    """A spring with another slope beyond a knee, up to four times as stiff."""

    name = "bilinear_stiffness"
    family = "restoring"
    kind = "restoring"
    law = "bilinear"
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

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Displacement above the knee, for several knees."""
        past = scene.of(element)
        return tuple(
            Signature(np.maximum(past.argument - knee, 0.0)[:, None], shape={"knee": knee})
            for knee in _knees(past)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Change of slope and knee."""
        past = scene.of(element)
        k = past.slope
        law = Bilinear(
            0.0, past.centre, k, past.half, rubbing_units(element)[2],
            getattr(element, "unit", "") or "N/m",
        )  # fmt: skip
        graph, (change, knee) = self.with_law(scene, element, law)
        tried = [(0.3 * k, past.centre), (-0.3 * k, past.centre)]
        if hint is not None:
            at, size = float(hint.shape["knee"]), float(np.clip(hint.weights[0], -0.8 * k, 3 * k))
            inwards = at - 0.3 * (at - past.centre)
            tried = [(size, at), (size, inwards), (0.5 * size, at)]
        starts = []
        for size, at in tried:
            values = {change: size, knee: at}
            added = size * np.maximum(past.argument - at, 0.0)
            starts += [{**values, **rebalanced(element, past, added)}, values]
        within = ((change, -np.inf, STIFFEST * k),)
        return self.inserted(element, graph, tuple(starts), (change,), within)


def _knees(past: PortHistory) -> tuple[float, ...]:
    knees = [reach(past, share) for share in SHARES]
    inside = abs(past.centre) < 0.7 * past.half  # a spring at its natural length is a likely corner
    return (*knees, 0.0) if inside and abs(past.centre) > 0.05 * past.half else tuple(knees)
