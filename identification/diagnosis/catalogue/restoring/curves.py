"""Curves of a store that no short series follows: a magnet near a spring, iron in a coil."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws import Magnet, SaturatingInductance
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.starts import at_least, rebalanced, rubbing_units
from identification.diagnosis.catalogue.storage.added_mode import inertia
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

AWAY = (0.4, 1.0)
"""Distances of a magnet tried beyond an end of the motion, over half its range."""
NEAREST = 0.2
"""The same of the nearest one that a fit may find: nearer is a stop."""
KNEES = (0.3, 0.5, 0.7)
"""Knees tried, over the largest flux linkage."""
STEEPEST = 20.0
"""Change of a coil's reciprocal inductance, over itself, that a fit begins with at most."""


def magnet_gaps(past: PortHistory) -> tuple[Signature, ...]:
    """Return what magnets beyond either end add, each with a force of one at no displacement."""
    found = []
    for side in (-1.0, 1.0):
        for away in AWAY:
            gap = -_beyond_end(past, side, away)
            if side * gap < -0.1 * past.half:  # else no displacement is not before the magnet
                law = Magnet(gap=gap, free_standing=False)
                column = law.deviation(NUMPY, past.argument, (), (1.0, gap))
                found.append(Signature.of((column,), gap=gap))
    return tuple(found)


def _beyond_end(past: PortHistory, side: float, away: float) -> float:
    return past.centre + side * (1.0 + away) * past.half


def magnet_at(effect: Effect, scene: FittedModel, element: Element, hint: Hint) -> Insertion:
    """Insert a magnet beside a spring, where the hint has it and nearer."""
    past, gap, force = scene.of(element), float(hint.shape["gap"]), float(hint.weights[0])
    side = -1.0 if gap > 0 else 1.0
    units = rubbing_units(element)
    law = Magnet(
        force, gap, abs(_beyond_end(past, side, NEAREST)), abs(force) or past.swing, False,
        units[0], units[2],
    )  # fmt: skip
    graph, (strength, distance) = effect.with_law(scene, element, law)
    added = force * law.deviation(NUMPY, past.argument, (), (1.0, gap))
    most = 0.5 * past.swing / max(float(np.abs(added).max()), 1e-300)
    force, added = force * min(1.0, most), added * min(1.0, most)
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
