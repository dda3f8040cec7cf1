"""Stiff contact at the end of the stroke."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import EndStop
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import springs
from identification.diagnosis.catalogue.starts import reach, rebalanced, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel

SHARES = (0.3, 0.5, 0.7, 0.85, 0.95)
"""Gaps tried, over half the range from its middle."""
LOW, HIGH, BOTH = -1.0, 1.0, 0.0
AWAY = 6.0
"""Place of a stop that is never touched, half ranges from the middle."""


class EndStopEffect(Effect):
    """A stiff contact that limits the stroke on one side or both.

    Its stiffness is several times that of the spring beside it; below it is a bilinear spring.
    """

    name = "end_stop"
    family = "restoring"
    kind = "restoring"
    law = "end_stop"
    sentence = "it runs against a stiff stop at the end of its stroke"
    looks = "cut peaks of the displacement, sharp peaks of force or acceleration at the same times"
    confused_with = ("bilinear_stiffness", "nonlinear_stiffness", "saturation")
    separated_by = (
        "amplitudes growing through the gap: below it the response is linear, above it the "
        "displacement hardly grows while the force does"
    )
    source = "Shaw, Forced vibrations of a beam with one-sided amplitude constraint, 1985"
    where = staticmethod(springs)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Displacement beyond the gap, above, below and on both sides, for several gaps."""
        past = scene.of(element)
        found = []
        for share in SHARES:
            high, low = reach(past, share), reach(past, -share)
            above = np.maximum(past.argument - high, 0.0)
            below = -np.maximum(low - past.argument, 0.0)
            for side, column in ((HIGH, above), (LOW, below), (BOTH, above + below)):
                found.append(Signature.of((column,), side=side, share=share))
        return tuple(found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert stops on both sides; one that is not there stays outside the motion."""
        past = scene.of(element)
        k = past.slope
        law = EndStop(
            10 * k, reach(past, -0.7), reach(past, 0.7), "both", past.half,
            rubbing_units(element)[2], getattr(element, "unit", "") or "N/m",
        )  # fmt: skip
        graph, names = self.with_law(scene, element, law)
        # the fitted linear model runs through a stiff stop, so that its force seems weak and early
        tried = [(10 * k, -0.7, 0.7), (10 * k, -0.4, 0.4)]
        if hint is not None:
            side, share = float(hint.shape["side"]), float(hint.shape["share"])
            low = -AWAY if side == HIGH else -share
            high = AWAY if side == LOW else share
            weight = float(np.clip(hint.weights[0], 2.5 * k, 500 * k))
            tried = [(weight, low, high), (10 * k, low, high), (10 * k, -share, share)]
        starts = []
        for stiffness, low, high in tried:
            ends = (reach(past, low), reach(past, high))
            values = dict(zip(names, (stiffness, *ends), strict=True))
            beyond = np.maximum(past.argument - ends[1], 0) - np.maximum(ends[0] - past.argument, 0)
            starts += [{**values, **rebalanced(element, past, stiffness * beyond)}, values]
        return self.inserted(element, graph, tuple(starts), names[:1])
