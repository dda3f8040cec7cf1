"""Friction that bends before it slides."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import DahlFriction
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.friction.forms import (
    FRICTION_FORMS,
    SHORTEST,
    friction_forms,
    way_of,
)
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.starts import at_least, rebalanced, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel

WAYS = (0.01, 0.03, 0.1, 0.3, 1.0)
"""Slip lengths tried, over half the range of the motion."""
LARGEST_EXPONENT = 200.0


class PreslidingFriction(Effect):
    """A contact that is a spring before it slides (Dahl's bristle)."""

    name = "presliding_friction"
    family = "friction"
    kind = "memory"
    law = "dahl"
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
    simpler = ("coulomb_friction",)
    source = "Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1, 1968"
    where = staticmethod(mechanical_resistors)
    richer = FRICTION_FORMS
    forms = staticmethod(friction_forms)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Bend of a bristle along the motion, for several slip lengths."""
        way = way_of(scene, element)
        half = 0.5 * float(np.ptp(way)) or 1.0
        return tuple(
            Signature.of((bend(way, length),), way=length)
            for length in (share * half for share in WAYS)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a bristle beside the viscous law."""
        past = scene.of(element)
        force = at_least(past.swing, 1e-12)
        way = way_of(scene, element)
        half = 0.5 * float(np.ptp(way)) or 1.0
        effort, _, length = rubbing_units(element)
        tried = ((0.2 * force, 0.03 * half), (0.2 * force, 0.3 * half))
        if hint is not None:
            level, slip = at_least(hint.weights[0], 0.02 * force), float(hint.shape["way"])
            tried = ((level, slip), (level, 0.3 * slip))
        law = DahlFriction(0.2 * force, 0.03 * half, unit=effort, way_unit=length)
        graph, names = self.with_law(scene, element, law)
        starts = []
        for level, slip in tried:
            values = dict(zip(names, (level, slip), strict=True))
            share = rebalanced(element, past, level * bend(way, slip))
            starts += [{**values, **share}, values]
        # a bristle that slips at once is dry friction without one
        within = ((names[1], SHORTEST * half, np.inf),)
        return self.inserted(element, graph, tuple(starts), names[:1], within)


def bend(way: Array, length: float) -> Array:
    """Bend ``z`` of ``dz/dx = (1 - z sign(dx)) / length`` along a motion, from rest.

    In path length it is a first-order filter of the direction, which is summed in parts short
    enough for the exponential.

    Parameters
    ----------
    way : ndarray, shape (N,)
    length : float
        Slip length, unit of `way`.

    Returns
    -------
    ndarray, shape (N,)
        -1 to 1.
    """
    step = np.diff(way)
    size = np.minimum(np.abs(step) / length, 0.5 * LARGEST_EXPONENT)
    gain = -np.expm1(-size) * np.sign(step)
    path = np.cumsum(size)
    z = np.zeros(way.size)
    first, last, base = 0, 0.0, 0.0
    while first < size.size:
        end = max(int(np.searchsorted(path, base + LARGEST_EXPONENT)), first + 1)
        e = path[first:end] - base
        z[first + 1 : end + 1] = np.exp(-e) * (last + np.cumsum(gain[first:end] * np.exp(e)))
        first, last, base = end, float(z[end]), float(path[end - 1])
    return z
