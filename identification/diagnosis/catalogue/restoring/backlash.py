"""Free play in a spring."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element, One
from bondgraph.laws import Backlash, Law, LettingGo
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion
from identification.diagnosis.catalogue.places import mechanical_resistors, springs
from identification.diagnosis.catalogue.site import Site, Values, over, times
from identification.diagnosis.catalogue.starts import rubbing_units, shared_slope
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

GRIP = 0.01
"""Way over which a damper grips behind the gap, over half the range."""


def _centres(past: PortHistory) -> tuple[float, ...]:
    """Middle of the range and, inside the range, the relaxed spring."""
    inside = 0.05 * past.half < abs(past.centre) < 0.95 * past.half
    return (past.centre, 0.0) if inside else (past.centre,)


class BacklashEffect(Effect):
    """Free play: no force within a gap of the spring's displacement."""

    name = "backlash"
    family = "restoring"
    kind = "restoring"
    law = "backlash"
    laws = (Backlash,)
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

    shapes = over(centre=_centres, width=times("half", 0.02, 0.08, 0.25, 0.5))
    strengths = ("gap",)
    at_shape = False

    def made(self, at: Site, **shape: float) -> Law:
        """Return a gap that takes away what the spring itself gives."""
        past, slope = at.past, shared_slope(at.element, at.past, "N/m")
        width, centre = shape.get("width", 0.05 * past.half), shape.get("centre", past.centre)
        unit = at.units[2]
        return Backlash(**slope, width=width, centre=centre, size=past.half, unit=unit)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the gap of the hint, also beside: its corners are sharp, few fits pass them."""
        half = at.past.half
        tried = [(share * half, centre) for centre in _centres(at.past) for share in (0.03, 0.25)]
        if hint is not None:
            centre, aside = float(hint.shape["centre"]), 0.05 * half
            gap = float(hint.shape["width"]) * float(np.clip(hint.weights[0], 0.2, 3.0))
            tried = [(gap, centre + c) for c in (0.0, aside, -aside)] + [(0.4 * gap, centre)]
        return [{"gap": gap, "centre": centre} for gap, centre in tried]

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
