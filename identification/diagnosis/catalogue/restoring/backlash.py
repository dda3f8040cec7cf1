"""Free play in a spring."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Backlash
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import springs
from identification.diagnosis.catalogue.starts import rebalanced, rubbing_units, shared_slope
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

SHARES = (0.02, 0.08, 0.25, 0.5)
"""Half widths tried, over half the range."""


class BacklashEffect(Effect):
    """Free play: no force within a gap of the spring's displacement."""

    name = "backlash"
    family = "restoring"
    kind = "restoring"
    law = "backlash"
    sentence = "it has free play: within a gap it carries no force"
    looks = "a flat piece in the middle of force over displacement, softer at small amplitude"
    confused_with = ("nonlinear_stiffness", "end_stop", "contact_loss", "dead_zone", "hysteresis")
    separated_by = (
        "small motion about the middle and the same about a preload: free play vanishes under "
        "preload; a smooth curve and a stop do not"
    )
    source = "Nordin and Gutman, Automatica 38 (2002) 1633"
    where = staticmethod(springs)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Force that a gap would take away, for several widths and centres."""
        past = scene.of(element)
        return tuple(
            Signature.of((_taken(past, centre, width),), centre=centre, width=width)
            for centre in _centres(past)
            for width in (share * past.half for share in SHARES)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a gap that takes away what the spring itself gives."""
        past = scene.of(element)
        shared = shared_slope(element, past)
        law = Backlash(
            coefficient=shared.coefficient, stiffness=shared.stiffness, inverse=shared.inverse,
            stiffness_unit=getattr(element, "unit", "") or "N/m", width=0.05 * past.half,
            centre=past.centre, size=past.half, unit=rubbing_units(element)[2],
        )  # fmt: skip
        graph, (_, width, centre) = self.with_law(scene, element, law)
        tried = [(share * past.half, at) for at in _centres(past) for share in (0.03, 0.25)]
        if hint is not None:
            at, gap = float(hint.shape["centre"]), float(hint.shape["width"])
            guess = gap * float(np.clip(hint.weights[0], 0.2, 3.0))
            aside = 0.05 * past.half  # the corners are sharp: a fit seldom walks over them
            tried = [(guess, at), (guess, at + aside), (guess, at - aside), (0.4 * guess, at)]
        starts = []
        for w, at in tried:
            added = _taken(past, at, w)
            values = {width: w, centre: at}
            starts += [{**values, **rebalanced(element, past, added)}, values]
        return self.inserted(element, graph, tuple(starts), (width,))


def _centres(past: PortHistory) -> tuple[float, ...]:
    """Middle of the range and, inside the range, the relaxed spring."""
    inside = 0.05 * past.half < abs(past.centre) < 0.95 * past.half
    return (past.centre, 0.0) if inside else (past.centre,)


def _taken(past: PortHistory, centre: float, width: float) -> Array:
    """Effort that a gap takes away."""
    lost = np.clip(past.argument - centre, -width, width) - np.clip(-centre, -width, width)
    return np.asarray(-past.slope * lost)
