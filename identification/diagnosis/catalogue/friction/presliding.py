"""Friction that bends before it slides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.hysteresis import Dahl
from bondgraph.laws import DahlFriction, Law
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.catalogue.friction.forms import (
    FRICTION_FORMS,
    SHORTEST,
    friction_forms,
    way_of,
)
from identification.diagnosis.catalogue.friction.rubbing import Rubbing
from identification.diagnosis.catalogue.site import Site, Values, numbers
from identification.diagnosis.catalogue.starts import at_least

WAYS = (0.01, 0.03, 0.1, 0.3, 1.0)
"""Slip lengths tried, over half the range of the motion."""


class PreslidingFriction(Rubbing):
    """A contact that is a spring before it slides (Dahl's bristle)."""

    name = "presliding_friction"
    kind = "memory"
    law = "dahl"
    laws = (DahlFriction,)
    sentence = "a contact that bends like a spring after every reversal before it slides"
    looks = (
        "rounded corners of the friction force over the way after each reversal, loops in force "
        "over displacement even for motions too small to slide"
    )
    confused_with = ("coulomb_friction", "hysteresis", "stribeck_friction")
    separated_by = (
        "reversals of growing amplitude from far below to far above the slip length: a bristle is "
        "a spring below and Coulomb friction above; hysteresis of a spring does not level off"
    )
    simpler = ("coulomb_friction", "linear_spring", *Rubbing.simpler)
    source = "Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1, 1968"
    richer = FRICTION_FORMS
    forms = staticmethod(friction_forms)

    weights = ("F_c",)
    at_shape = False

    def grid(self, at: Site) -> Sequence[Values]:
        """Return slip lengths over the range of the motion."""
        return [{"way": share * _half(at)} for share in WAYS]

    def made(self, at: Site, way: float = 0.0) -> Law:
        """Return a bristle beside the viscous law."""
        force, (effort, _, length) = at_least(at.past.swing, 1e-12), at.units
        return DahlFriction(0.2 * force, way or 0.03 * _half(at), effort, length)

    def added(self, at: Site, law: Law, values: Values) -> Array:
        """Return the force along the motion as such: the law would add up the flow anew."""
        force, length = numbers(law, values)
        way = way_of(at.scene, at.element)
        if not np.isfinite(way).all():
            return np.full(way.size, np.nan)
        return np.asarray(Dahl(force / length, force).run(way - way[0])[0])

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return a short slip length and a longer one."""
        force, half = numbers(law)[0], _half(at)
        tried = [(force, 0.03 * half), (force, 0.3 * half)]
        if hint is not None:
            level, slip = at_least(hint.weights[0], 0.1 * force), float(hint.shape["way"])
            tried = [(level, slip), (level, 0.3 * slip)]
        return [{"F_c": level, "delta": slip} for level, slip in tried]

    def holds(self, at: Site) -> Mapping[str, tuple[float, float]]:
        """Return lengths of a bristle: one that slips at once is dry friction without one."""
        return {"delta": (SHORTEST * _half(at), np.inf)}


def _half(at: Site) -> float:
    return 0.5 * float(np.ptp(way_of(at.scene, at.element))) or 1.0
