"""A store that spills over its rim."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import Law, Overflow
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import tanks
from identification.diagnosis.catalogue.site import Site, Values, numbers, over, within_range
from identification.diagnosis.catalogue.starts import at_least, shared_slope

SHARES = (0.9, 0.75, 0.5, 0.2)
"""Rims tried, over half the range from its middle."""
OUTSIDE = 1.5


class OverflowEffect(Effect):
    """What stands above a rim is lost."""

    name = "overflow"
    family = "storage"
    kind = "restoring"
    law = "one_sided_play"
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
    shapes = over(rim=within_range(*SHARES))
    rebalances = False  # what stands below the rim is all the spring's

    def made(self, at: Site, rim: float | None = None) -> Law:
        """Return a rim below the highest level."""
        past = at.past
        top = past.reach(OUTSIDE)
        depth = top - (past.reach(0.8) if rim is None else rim)
        return Overflow(
            **shared_slope(at.element, past, "m3/Pa"), depth=at_least(depth, 0.1 * past.half),
            size=past.half, top=top,
        )  # fmt: skip

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the rim, and a lower one: what flowed in meanwhile lifts the linear model."""
        depth, lower = numbers(law)[1], 0.4 if hint is None else 0.3
        return {"depth": depth}, {"depth": depth + lower * at.past.half}
