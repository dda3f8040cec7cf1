"""A preloaded contact that cannot pull."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import ContactLoss
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import springs
from identification.diagnosis.catalogue.starts import (
    at_least,
    reach,
    rebalanced,
    rubbing_units,
    shared_slope,
)
from identification.diagnosis.screening.port_history import FittedModel

SHARES = (0.85, 0.6, 0.3, 0.0, -0.4)
"""Places of the loss tried, over half the range from its middle."""
OUTSIDE = 1.5
"""Half ranges from the middle at which a contact without the effect would open."""


class ContactLossEffect(Effect):
    """A preloaded contact that opens instead of pulling."""

    name = "contact_loss"
    family = "restoring"
    kind = "restoring"
    law = "contact_loss"
    sentence = "it is a preloaded contact that opens: it cannot pull"
    looks = "force over displacement is level on one side, long flights on that side"
    confused_with = ("bilinear_stiffness", "end_stop", "nonlinear_stiffness", "backlash")
    separated_by = (
        "the same excitation under more preload: the level side moves outwards and vanishes; the "
        "knee of a bilinear spring keeps its place and its second slope"
    )
    source = "Brogliato, Nonsmooth Mechanics, 3rd ed. 2016 (unilateral contact)"
    where = staticmethod(springs)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Pull that does not come, on either side, for several preloads."""
        past = scene.of(element)
        return tuple(
            Signature(
                side * past.slope * np.maximum(side * (lift - past.argument), 0.0)[:, None],
                shape={"side": side, "lift": lift},
            )
            for side in (1.0, -1.0)
            for lift in (reach(past, -side * share) for share in SHARES)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a contact that opens on the side that explained more."""
        past = scene.of(element)
        side = 1.0 if hint is None else opening_side(hint)
        edge = reach(past, -side * OUTSIDE)
        tried = [side * (reach(past, -side * share) - edge) for share in (0.6, 0.2)]
        if hint is not None:
            depth = at_least(side * (float(hint.shape["lift"]) - edge), 0.1 * past.half)
            shallow = (OUTSIDE - 0.9) * past.half
            tried = [depth, 0.5 * (depth + shallow), shallow]
        law = ContactLoss(
            **shared_slope(element, past, "N/m"), depth=tried[0], size=past.half,
            edge=edge, side=side, unit=rubbing_units(element)[2],
        )  # fmt: skip
        graph, (_, depth_name) = self.with_law(scene, element, law)
        starts = []
        for depth in tried:
            pull = np.maximum(side * (edge - past.argument) + depth, 0.0)
            share = rebalanced(element, past, side * past.slope * pull)
            starts += [{depth_name: depth, **share}, {depth_name: depth}]
        return self.inserted(element, graph, tuple(starts), (depth_name,))


def opening_side(hint: Hint) -> float:
    """Return the side on which the contact opens, 1 below and -1 above.

    Less force on one side of a corner is more on the other beside a stiffness that is free: only
    the weight's sign says which of the two is level.
    """
    return float(hint.shape["side"]) * (1.0 if hint.weights[0] >= 0 else -1.0)
