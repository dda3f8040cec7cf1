"""Damping that differs between the two directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import AsymmetricDamping, DigressiveDamping, Law
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import rubbing_units, shared_slope
from identification.diagnosis.screening.port_history import FittedModel

BENT = (0.3, 1.0, 3.0)
"""Flows tried at which half of the resistance is left, over the rms flow."""
UNEVEN = (0.4, -0.4)
"""Half the difference of both directions that a fit begins with, over their mean."""


class AsymmetricDampingEffect(Effect):
    """Damping that differs between the two directions."""

    name = "asymmetric_damping"
    family = "friction"
    kind = "dissipative"
    law = "asymmetric_damping"
    laws = (AsymmetricDamping,)
    richer = (DigressiveDamping.name,)
    sentence = "it damps one direction of motion more than the other"
    looks = "even harmonics and a shift of the mean that grow in proportion to the amplitude"
    confused_with = ("bilinear_stiffness", "quadratic_drag")
    separated_by = (
        "the same sine at two frequencies: the shift of the mean grows with the speed if it is the "
        "damper and stays if it is the spring"
    )
    source = "Dixon, The Shock Absorber Handbook, 2nd ed. 2007 (rebound and compression)"
    where = staticmethod(mechanical_resistors)

    weights = ("d_a",)
    rebalances = False  # the mean of both coefficients is the resistor's own

    def made(self, at: Site) -> Law:
        """Half the difference of both coefficients beside their mean."""
        return AsymmetricDamping(0.0, 0.3 * at.past.slope, at.unit or "N*s/m")

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return it with either sign; beyond the mean one of the two would be negative."""
        size = at.past.slope
        if hint is None:
            return {"d_a": 0.2 * size}, {"d_a": -0.2 * size}
        return ({"d_a": np.clip(hint.weights[0], -0.9 * size, 0.9 * size)},)

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Return a damper that grows less than the speed: the fitted line is its chord."""
        at = self.site(scene, element)
        past, own = at.past, shared_slope(element, at.past, at.unit or "N*s/m")
        law = DigressiveDamping(**own, flow=past.rms, flow_unit=rubbing_units(element)[1])
        graph, names = self.with_law(scene, element, law)
        slope, uneven, flow = names if len(names) == 3 else ("", *names)
        starts = []
        for share, part in product(BENT, UNEVEN):
            steep = past.slope * (1.0 + 1.0 / share)
            start = {uneven: part * steep, flow: share * past.rms}
            starts.append(start | ({slope: steep} if slope else {}))
        made = self.inserted(element, graph, tuple(starts), (uneven,))
        return (replace(made, law=law.name, sentence=BENDS, form=True),)


BENDS = "it damps one direction more than the other, and both the less the faster it moves"
