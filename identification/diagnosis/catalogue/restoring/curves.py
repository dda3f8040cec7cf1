"""Curves of a store that no short series follows: a magnet near a spring, iron in a coil."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Magnet, SaturatingInductance
from bondgraph.support.arrays import Array
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.starts import at_least, rebalanced, rubbing_units
from identification.diagnosis.catalogue.storage.added_mode import inertia
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

AWAY = (0.4, 1.0)
"""Distances of a magnet tried beyond an end of the motion, over half its range."""
NEAREST = 0.2
"""The same of the nearest one that a fit begins with; it stays beyond the end: nearer is a stop."""
KNEES = (0.3, 0.5, 0.7)
"""Knees tried, over the largest flux linkage."""
STEEPEST = 20.0
"""Change of a coil's reciprocal inductance, over itself, that a fit begins with at most."""


def magnet_gaps(past: PortHistory) -> tuple[Signature, ...]:
    """Return what magnets beyond either end add, each with what a wider gap would change.

    So any distance near one that is tried is seen, with as many weights as a series has.
    """
    found = []
    for side in (-1.0, 1.0):
        for away in AWAY:
            gap = -_beyond_end(past, side, away)
            if side * gap < -0.1 * past.half:  # else no displacement is not before the magnet
                u = past.argument / gap
                wider = 2.0 * u / gap * ((1.0 + u) ** -3 - 1.0)
                found.append(Signature.of((_magnet(past, gap), wider), gap=gap))
    return tuple(found)


def _magnet(past: PortHistory, gap: float) -> Array:
    law = Magnet(gap=gap, free_standing=False)
    return np.asarray(law.deviation(NUMPY, past.argument, (), (1.0, gap)))


def _beyond_end(past: PortHistory, side: float, away: float) -> float:
    return past.centre + side * (1.0 + away) * past.half


def magnet_at(effect: Effect, scene: FittedModel, element: Element, hint: Hint) -> Insertion:
    """Insert a magnet beside a spring, where the hint has it and nearer."""
    past, gap = scene.of(element), float(hint.shape["gap"])
    force, moved = map(float, hint.weights)
    side = -float(np.sign(gap))
    near = _beyond_end(past, side, NEAREST)
    closest = max(side * _beyond_end(past, side, 0.0), 0.05 * past.half)
    if force and abs(moved / force) < 0.5 * abs(gap):
        gap = -side * max(-side * (gap + moved / force), side * near, closest)
    law = Magnet(force, gap, closest, abs(force) or past.swing, False, *rubbing_units(element)[::2])
    graph, (strength, distance) = effect.with_law(scene, element, law)
    added = force * _magnet(past, gap)
    weaker = min(1.0, 0.5 * past.swing / max(float(np.abs(added).max()), 1e-300))
    force, added = weaker * force, weaker * added
    start = {strength: force, distance: gap}
    inserted = effect.inserted(
        element, graph, ({**start, **rebalanced(element, past, added)}, start), (strength,)
    )
    return replace(
        inserted, law=law.name,
        sentence="a force beside it grows towards one end, as with a magnet's inverse square",
    )  # fmt: skip


def coil_knees(past: PortHistory) -> tuple[Signature, ...]:
    """Return the voltage that is lost where the iron is full, for several knees."""
    size = inertia(past)
    flux = size * past.argument
    found = []
    for share in KNEES:
        knee = share * float(np.abs(flux).max())
        if knee > 0:
            kept = SaturatingInductance(1.0, knee).deviation(NUMPY, flux, (), (1.0, knee))
            found.append(Signature.of((-size * np.gradient(kept, past.dt),), knee=knee))
    return tuple(found)


def saturating_at(
    effect: Effect, scene: FittedModel, element: Element, hint: Hint | None
) -> Insertion:
    """Insert iron that saturates at the knee of the hint."""
    past = scene.of(element)
    stiff = 1.0 / (inertia(past) or 1.0)
    largest = float(np.abs(past.argument).max()) / stiff or 1.0
    knee, change = 0.5 * largest, stiff
    if hint is not None:
        knee = float(hint.shape["knee"])
        change = min(at_least(hint.weights[0], 0.05 * stiff), STEEPEST * stiff)
    law = SaturatingInductance(stiff, knee)
    graph, (steep, at) = effect.with_law(scene, element, law)
    starts = tuple({steep: c, at: k} for c, k in ((change, knee), (3 * change, 1.3 * knee)))
    inserted = effect.inserted(element, graph, starts, (steep,))
    return replace(
        inserted, law=law.name,
        sentence="its flux stays behind its current at large ones, as where iron saturates",
    )  # fmt: skip
