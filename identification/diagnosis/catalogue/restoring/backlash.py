"""Free play in a spring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element, One
from bondgraph.laws import Backlash, LettingGo
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import mechanical_resistors, springs
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
    richer = ("backlash_with_damper",)

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
        law = Backlash(
            **shared_slope(element, past, "N/m"), width=0.05 * past.half,
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

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Let the dampers beside the spring go within the gap as well."""
        past, name, values = scene.of(element), element.name, ended.get(self.name, {})
        node = scene.graph.neighbour(name)
        beside = [
            r for r in mechanical_resistors(scene.graph)
            if scene.graph.neighbour(r.name) == node and isinstance(scene.graph[node], One)
            and isinstance(r.value, int | float)  # type: ignore[attr-defined]
        ]  # fmt: skip
        width = values.get(f"gap_{name}", 0.0)
        if not beside or width <= 0:
            return ()
        plain, found = self.insert(scene, element), []
        unit, centre = rubbing_units(element)[2], values.get(f"centre_{name}", past.centre)
        for r in beside:
            law = LettingGo(
                f"q_{name}", r.name, scene.of(r).slope, width, centre, GRIP * past.half, past.half,
                getattr(r, "unit", "") or "N*s/m", unit,
            )  # fmt: skip
            known = {n: v for n, v in values.items() if n in plain.graph.parameters}
            starts = tuple(
                {**known, f"gap_{r.name}": share * width, f"centre_{r.name}": centre}
                for share in (1.0, 0.3)
            )
            found.append(replace(
                plain, graph=plain.graph.with_element(r.name, law=law), starts=starts, form=True,
                law="backlash_with_damper", strengths=(*plain.strengths, f"gap_{r.name}"),
                kind="surface",
                sentence="it has free play: within a gap neither spring nor damper carries a force",
            ))  # fmt: skip
        return tuple(found)


GRIP = 0.01
"""Way over which a damper grips behind the gap, over half the range."""


def _centres(past: PortHistory) -> tuple[float, ...]:
    """Middle of the range and, inside the range, the relaxed spring."""
    inside = 0.05 * past.half < abs(past.centre) < 0.95 * past.half
    return (past.centre, 0.0) if inside else (past.centre,)


def _taken(past: PortHistory, centre: float, width: float) -> Array:
    """Effort that a gap takes away."""
    lost = np.clip(past.argument - centre, -width, width) - np.clip(-centre, -width, width)
    return np.asarray(-past.slope * lost)
