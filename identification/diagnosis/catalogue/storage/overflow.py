"""A store that spills over its rim."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import Law, Overflow
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import tanks
from identification.diagnosis.catalogue.site import Site, Values, numbers, over, within_range
from identification.diagnosis.catalogue.starts import at_least, shared_slope

OUTSIDE = 1.5
"""Half ranges above the middle at which a rim is never reached."""


class OverflowEffect(Effect):
    """What stands above a rim is lost."""

    name = "overflow"
    family = "storage"
    kind = "restoring"
    law = "one_sided_play"
    laws = (Overflow,)
    sentence = "it overflows: what rises above a limit is lost for good"
    looks = "peaks cut at one level and, after each, a level that stays too low by what was spilled"
    confused_with = ("leakage", "saturation", "sensor_nonlinearity", "nonlinear_stiffness")
    separated_by = (
        "fill above the limit, then draw a known volume: after an overflow the level is lower than "
        "the balance says, after a saturated reading it is right again"
    )
    source = "weir of a tank: Wigren and Schoukens, cascaded tanks benchmark, 2013"
    where = staticmethod(tanks)

    strengths = ("depth",)
    shapes = over(rim=within_range(0.9, 0.75, 0.5, 0.2))
    rebalances = False  # what stands below the rim is all the spring's

    def made(self, at: Site, **shape: float) -> Law:
        """Return a rim below the highest level."""
        past, slope = at.past, shared_slope(at.element, at.past, "m3/Pa")
        top = past.reach(OUTSIDE)
        depth = at_least(top - shape.get("rim", past.reach(0.8)), 0.1 * past.half)
        return Overflow(**slope, depth=depth, size=past.half, top=top)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the rim, and a lower one: what flowed in meanwhile lifts the linear model."""
        depth, lower = numbers(law)[1], 0.4 if hint is None else 0.3
        return {"depth": depth}, {"depth": depth + lower * at.past.half}
