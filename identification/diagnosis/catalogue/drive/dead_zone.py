"""A drive that does not respond to small commands."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import DeadZone
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import commands
from identification.diagnosis.catalogue.signal_traces import unit_of, weight_of
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

WIDTHS = (0.01, 0.03, 0.08, 0.2)
"""Half widths to try, in spans of the command."""


class DeadZoneEffect(Effect):
    """The drive does not respond to small commands about a centre."""

    name = "dead_zone"
    family = "drive"
    kind = "command"
    law = "dead_zone"
    sentence = "it does not respond within a band of commands"
    looks = "a flat piece wherever the command crosses the band, large commands a constant short"
    confused_with = ("hysteresis", "backlash", "coulomb_friction")
    separated_by = (
        "a slow sweep through the band and back: a dead zone retraces, play and friction do not"
    )
    source = "describing-function texts, e.g. Gelb and Vander Velde 1968"
    where = staticmethod(commands)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what the band swallows, for several widths and centres."""
        past = scene.of(element)
        u, span = past.argument, 2 * past.half
        return tuple(
            Signature.of((-np.clip(u - c, -w * span, w * span),), width=w * span, centre=c)
            for c in _centres(past)
            for w in WIDTHS
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Dead band where the signature has it, or at the middle, the median and zero."""
        past = scene.of(element)
        span = 2 * past.half
        law = DeadZone(past.centre, 0.02 * span, span, unit_of(element))
        graph, (width, centre) = self.with_law(scene, element, law)
        starts: list[dict[str, float]]
        if hint is not None:
            w, c = hint.shape["width"], hint.shape["centre"]
            first = w * weight_of(hint)
            starts = [{width: first, centre: c}, {width: 0.5 * first, centre: c}]
        else:
            starts = [
                {width: w * span, centre: c} for c in _centres(past) for w in (0.002, 0.02, 0.06)
            ]
        return self.inserted(element, graph, tuple(starts), (width,))


def _centres(past: PortHistory) -> tuple[float, ...]:
    """Middle of the range, zero and median, if they differ."""
    span = 2 * past.half
    found = [past.centre]
    if past.argument.min() < 0 < past.argument.max():
        found.append(0.0)
    found.append(float(np.median(past.argument)))
    kept: list[float] = []
    for c in found:
        if all(abs(c - k) > 0.03 * span for k in kept):
            kept.append(c)
    return tuple(kept)
