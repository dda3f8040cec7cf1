"""A store that spills over its rim."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Overflow
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import tanks
from identification.diagnosis.catalogue.starts import at_least, reach, shared_slope
from identification.diagnosis.screening.port_history import FittedModel

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

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Effort of the largest excess so far, for several rims."""
        past = scene.of(element)
        highest = np.maximum.accumulate(past.argument)
        return tuple(
            Signature(-past.slope * np.maximum(highest - rim, 0.0)[:, None], shape={"rim": rim})
            for rim in (reach(past, share) for share in SHARES)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a rim below the highest level."""
        past = scene.of(element)
        top = reach(past, OUTSIDE)
        tried = [top - reach(past, share) for share in (0.8, 0.4)]
        if hint is not None:
            depth = at_least(top - float(hint.shape["rim"]), 0.1 * past.half)
            # what flowed in while it spilled lifts the linear model: the true rim is often lower
            tried = [depth, depth + 0.3 * past.half]
        law = Overflow(
            **shared_slope(element, past, "m3/Pa"), depth=tried[0], size=past.half,
            top=top,
        )  # fmt: skip
        graph, (_, depth_name) = self.with_law(scene, element, law)
        return self.inserted(element, graph, tuple({depth_name: d} for d in tried), (depth_name,))
