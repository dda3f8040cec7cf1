"""Dry friction whose level falls with speed."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Stribeck
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.friction.forms import FRICTION_FORMS, friction_forms
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.starts import at_least, rebalanced, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel

SPEEDS = (0.04, 0.1, 0.3, 1.0)
"""Stribeck speeds tried, over the root mean square of the flow."""


class StribeckFriction(Effect):
    """Dry friction whose level falls with speed."""

    name = "stribeck_friction"
    family = "friction"
    kind = "dissipative"
    law = "stribeck"
    sentence = "dry friction that is larger near rest than in motion"
    looks = "as Coulomb friction, with a peak of the force where the motion starts, and stick-slip"
    confused_with = ("coulomb_friction", "presliding_friction")
    separated_by = (
        "constant speeds from very slow to fast: the force falls with speed before the viscous "
        "part lifts it; Coulomb friction stays level"
    )
    simpler = ("coulomb_friction",)
    source = "Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083"
    where = staticmethod(mechanical_resistors)
    richer = FRICTION_FORMS
    forms = staticmethod(friction_forms)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Direction of the flow, and the same near rest, for several speeds."""
        past = scene.of(element)
        f, direction = past.argument, np.sign(past.argument)
        return tuple(
            Signature.of((direction, direction * np.exp(-((f / v) ** 2))), speed=v)
            for v in (share * past.rms for share in SPEEDS)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Stribeck law beside the viscous one."""
        past = scene.of(element)
        force, speed = at_least(past.swing, 1e-12), 0.3 * past.rms
        effort, flow, _ = rubbing_units(element)
        tried: tuple[tuple[float, float, float], ...] = (
            (0.2 * force, 0.1 * force, speed),
            (0.05 * force, 0.05 * force, 0.3 * speed),
        )
        if hint is not None:
            v, (level, drop) = float(hint.shape["speed"]), hint.weights
            v = float(np.clip(v, 0.04 * past.rms, 2.0 * past.rms))
            level, drop = at_least(level, 0.02 * force), at_least(drop, 0.01 * force)
            slower = max(0.8 * v, 0.04 * past.rms)
            tried = ((level, drop, v), (level, level, 0.3 * past.rms), (level, level, slower))
        law = Stribeck(0.2 * force, 0.1 * force, speed, unit=effort, flow_unit=flow)
        graph, names = self.with_law(scene, element, law)
        starts = []
        for level, drop, v in tried:
            values = dict(zip(names, (level, drop, v), strict=True))
            added = (level + drop * np.exp(-((past.argument / v) ** 2))) * np.sign(past.argument)
            starts += [{**values, **rebalanced(element, past, added)}, values]
        return self.inserted(element, graph, tuple(starts), names[:2])
