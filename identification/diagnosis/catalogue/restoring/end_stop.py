"""Stiff contact at the end of the stroke."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import EndStop, HuntCrossley, Law
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion
from identification.diagnosis.catalogue.places import springs
from identification.diagnosis.catalogue.site import Site, Values, over, plain
from identification.diagnosis.screening.port_history import FittedModel

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
    laws = (EndStop,)
    sentence = "it runs against a stiff stop at the end of its stroke"
    looks = "cut peaks of the displacement, sharp peaks of force or acceleration at the same times"
    confused_with = ("bilinear_stiffness", "nonlinear_stiffness", "saturation")
    separated_by = (
        "amplitudes growing through the gap: below it the response is linear, above it the "
        "displacement hardly grows while the force does"
    )
    source = "Shaw, Forced vibrations of a beam with one-sided amplitude constraint, 1985"
    where = staticmethod(springs)
    richer = (HuntCrossley.name,)

    weights = ("k_s",)
    shapes = over(share=plain(0.3, 0.5, 0.7, 0.85, 0.95), side=plain(HIGH, LOW, BOTH))
    at_shape = False

    def made(self, at: Site, side: float = BOTH, share: float = 0.7) -> Law:
        """Return stops on both sides; one that is not there stays outside the motion."""
        low, high = _ends(at, side, share)
        return EndStop(
            10 * at.past.slope, low, high, "both", at.past.half, at.units[2], at.unit or "N/m"
        )

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return stiff stops: the fitted linear model runs through them, so they seem weak."""
        k = at.past.slope
        tried = [(10 * k, BOTH, 0.7), (10 * k, BOTH, 0.4)]
        if hint is not None:
            side, share = float(hint.shape["side"]), float(hint.shape["share"])
            seen = float(np.clip(hint.weights[0], 2.5 * k, 500 * k))
            tried = [(seen, side, share), (10 * k, side, share), (10 * k, BOTH, share)]
        ends = [(stiffness, *_ends(at, side, share)) for stiffness, side, share in tried]
        return [dict(zip(("k_s", "low", "high"), values, strict=True)) for values in ends]

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Return a stop with a loss of its own, from where the fit of one without it ended."""
        known, name = ended.get(self.name, {}), element.name
        own_names = [f"{n}_{name}" for n in ("k_s", "low", "high")]
        if not known.keys() >= set(own_names):
            return ()
        site = self.site(scene, element)
        stiffness, low, high = (float(known[n]) for n in own_names)
        slow = 1.0 / (float(np.abs(site.past.rate).max()) or 1.0)
        law = HuntCrossley(
            stiffness, low, high, "both", site.past.half, site.units[2], site.unit or "N/m",
            loss=BEGUN * slow, slowness=slow, loss_unit=f"s/{site.units[2]}",
        )  # fmt: skip
        graph, names = self.with_law(scene, element, law)
        own = {n: v for n, v in known.items() if n in scene.graph.parameters}
        ends = dict(zip(names, (stiffness, low, high), strict=False))
        starts = tuple({**own, **ends, names[-1]: share * slow} for share in (BEGUN, 1.0, 0.03))
        made = self.inserted(element, graph, starts, (names[0], names[-1]))
        says = "it runs against a stiff stop at the end of its stroke, with a loss in the contact"
        return (replace(made, law=law.name, form=True, sentence=says),)

    def refinements(
        self, scene: FittedModel, element: Element, ended: Mapping[str, float]
    ) -> tuple[Insertion, ...]:
        """Return the same once the stop is named: a contact with another loss is nearer to it."""
        return self.forms(scene, element, {self.name: ended})


BEGUN = 0.3
"""Part of the force of a contact that its loss makes at the largest speed, at first."""


def _ends(at: Site, side: float, share: float) -> tuple[float, float]:
    low, high = (AWAY if side == absent else share for absent in (HIGH, LOW))
    return at.past.reach(-low), at.past.reach(high)
