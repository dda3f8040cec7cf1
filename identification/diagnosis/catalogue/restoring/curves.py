"""Curves of a store that no short series follows: a magnet near a spring, iron in a coil."""

from __future__ import annotations

from dataclasses import dataclass, replace

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
BEGUN = (0.2, 0.3, 0.4, 0.6, 0.8, 1.1, 1.6, 2.4)
"""The same of those that a fit may begin with; it stays beyond the end: nearer is a stop."""
LIKE = 0.3
"""Part of what both weights make, beside any line, by which one magnet may miss it."""
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
                found.append(Signature(_with_wider(past, gap), shape={"gap": gap}))
    return tuple(found)


def _with_wider(past: PortHistory, gap: float) -> Array:
    u = past.argument / gap
    return np.stack([_magnet(past, gap), 2.0 * u / gap * ((1.0 + u) ** -3 - 1.0)], axis=1)


def _magnet(past: PortHistory, gap: float) -> Array:
    law = Magnet(gap=gap, free_standing=False)
    return np.asarray(law.deviation(NUMPY, past.argument, (), (1.0, gap)))


def _beyond_end(past: PortHistory, side: float, away: float) -> float:
    return past.centre + side * (1.0 + away) * past.half


@dataclass(frozen=True)
class Nearby:
    """What two weights of `magnet_gaps` mean.

    Attributes
    ----------
    magnet : (float, float) or None
        Force at no displacement and gap of the one magnet that is nearest to both; None where
        none is near.
    series : Hint
        Square and cube of the scaled displacement that are.
    """

    magnet: tuple[float, float] | None
    series: Hint


def nearby(past: PortHistory, hint: Hint) -> Nearby:
    """Find the magnet, and the series, that two weights together come nearest to."""
    gap = float(hint.shape["gap"])
    side = -float(np.sign(gap))
    z = (past.argument - past.centre) / past.half
    powers = np.stack([np.ones_like(z), z, z**2, z**3], axis=1)
    gaps = [g for away in BEGUN if side * (g := -_beyond_end(past, side, away)) < -0.1 * past.half]
    told = _with_wider(past, gap) @ hint.weights
    made = np.stack([told, *(_magnet(past, g) for g in gaps)], axis=1)
    bends = made - powers[:, :2] @ np.linalg.lstsq(powers[:, :2], made, rcond=None)[0]
    bend, least, found = bends[:, 0], LIKE * float(np.linalg.norm(bends[:, 0])), None
    for g, c in zip(gaps, bends[:, 1:].T, strict=True):
        force = float(bend @ c) / max(float(c @ c), 1e-300)
        missed = float(np.linalg.norm(bend - force * c))
        if missed < least:
            least, found = missed, (force, g)
    return Nearby(found, Hint({}, np.linalg.lstsq(powers, told, rcond=None)[0][2:]))


def magnet_at(
    effect: Effect, scene: FittedModel, element: Element, force: float, gap: float
) -> Insertion:
    """Insert a magnet beside a spring."""
    past = scene.of(element)
    side = -float(np.sign(gap))
    closest = max(side * _beyond_end(past, side, 0.0), 0.05 * past.half)
    units = rubbing_units(element)
    law = Magnet(force, gap, closest, abs(force) or past.swing, False, units[0], units[2])
    graph, (strength, distance) = effect.with_law(scene, element, law)
    added = force * _magnet(past, gap)
    weaker = min(1.0, 0.5 * past.swing / max(float(np.abs(added).max()), 1e-300))
    start = {strength: weaker * force, distance: gap}
    starts = ({**start, **rebalanced(element, past, weaker * added)}, start)
    inserted = effect.inserted(element, graph, starts, (strength,))
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
