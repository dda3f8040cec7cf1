"""A drive that does not respond to small commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws import DeadZone, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.places import commands
from identification.diagnosis.catalogue.signal_traces import weight_of
from identification.diagnosis.catalogue.site import Site, Values, over, times
from identification.diagnosis.screening.port_history import PortHistory


def _centres(past: PortHistory) -> tuple[float, ...]:
    """Middle of the range, zero and median, if they differ."""
    found = [past.centre]
    if past.argument.min() < 0 < past.argument.max():
        found.append(0.0)
    found.append(float(np.median(past.argument)))
    kept: list[float] = []
    for c in found:
        if all(abs(c - k) > 0.06 * past.half for k in kept):
            kept.append(c)
    return tuple(kept)


class DeadZoneEffect(Effect):
    """The drive does not respond to small commands about a centre."""

    name = "dead_zone"
    family = "drive"
    kind = "command"
    law = "dead_zone"
    laws = (DeadZone,)
    sentence = "it does not respond within a band of commands"
    looks = "a flat piece wherever the command crosses the band, large commands a constant short"
    confused_with = ("hysteresis", "backlash", "coulomb_friction")
    separated_by = (
        "a slow sweep through the band and back: a dead zone retraces, play and friction do not"
    )
    source = "describing-function texts, e.g. Gelb and Vander Velde 1968"
    where = staticmethod(commands)

    shapes = over(centre=_centres, width=times("half", 0.02, 0.06, 0.16, 0.4))
    strengths = ("width",)
    at_shape = False

    def made(self, at: Site, **shape: float) -> Law:
        """Return a dead band, at the middle unless it is said where."""
        past = at.past
        width, centre = shape.get("width", 0.04 * past.half), shape.get("centre", past.centre)
        return DeadZone(centre, width, 2 * past.half, at.unit or "1")

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the band of the hint, or some at the middle, the median and zero."""
        if hint is None:
            widths = [2 * at.past.half * w for w in (0.002, 0.02, 0.06)]
            return [{"width": w, "centre": c} for c in _centres(at.past) for w in widths]
        first = hint.shape["width"] * weight_of(hint)
        return [{"width": w, "centre": hint.shape["centre"]} for w in (first, 0.5 * first)]
