"""A preloaded contact that cannot pull."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import ContactLoss, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import springs
from identification.diagnosis.catalogue.site import Site, Values, numbers
from identification.diagnosis.catalogue.starts import at_least, shared_slope

OUTSIDE = 1.5
"""Half ranges from the middle at which a contact without the effect would open."""


class ContactLossEffect(Effect):
    """A preloaded contact that opens instead of pulling."""

    name = "contact_loss"
    family = "restoring"
    kind = "restoring"
    law = "contact_loss"
    laws = (ContactLoss,)
    sentence = "it is a preloaded contact that opens: it cannot pull"
    looks = "force over displacement is level on one side, long flights on that side"
    confused_with = ("bilinear_stiffness", "end_stop", "nonlinear_stiffness", "backlash")
    separated_by = (
        "the same excitation under more preload: the level side moves outwards and vanishes; the "
        "knee of a bilinear spring keeps its place and its second slope"
    )
    source = "Brogliato, Nonsmooth Mechanics, 3rd ed. 2016 (unilateral contact)"
    where = staticmethod(springs)

    strengths = ("depth",)

    def grid(self, at: Site) -> Sequence[Values]:
        """Return several preloads, on either side."""
        places = [(side, share) for side in (1.0, -1.0) for share in (0.85, 0.6, 0.3, 0.0, -0.4)]
        return [{"side": side, "lift": at.past.reach(-side * share)} for side, share in places]

    def made(self, at: Site, side: float = 1.0, **place: float) -> Law:
        """Return a contact that opens on one side at a place."""
        past, slope = at.past, shared_slope(at.element, at.past, "N/m")
        edge = past.reach(-side * OUTSIDE)
        depth = side * (place.get("lift", past.reach(-side * 0.6)) - edge)
        return ContactLoss(
            **slope, depth=at_least(depth, 0.1 * past.half), size=past.half, edge=edge, side=side,
            unit=at.units[2],
        )  # fmt: skip

    def shape_of(self, hint: Hint) -> Values:
        """Return the place, and the side that the weight tells.

        Less force on one side of a corner is more on the other beside a stiffness that is free:
        only the weight's sign says which of the two is level.
        """
        return {**hint.shape, "side": hint.shape["side"] * (1.0 if hint.weights[0] >= 0 else -1.0)}

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the place of the law, and ones that open less."""
        depth, shallow = numbers(law)[1], (OUTSIDE - 0.9) * at.past.half
        less = [0.5 * (depth + shallow), shallow]
        if hint is None:
            less = [(OUTSIDE - 0.2) * at.past.half]
        return [{"depth": d} for d in (depth, *less)]
