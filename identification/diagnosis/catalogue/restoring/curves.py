"""What a short series of a store misses: a magnet near a spring, iron in a coil, a loss."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bondgraph.graph.elements import C, Element, I
from bondgraph.laws import (
    Gravity,
    GrowingDamping,
    LawSum,
    Magnet,
    Parametrised,
    Polynomial,
    SaturatingInductance,
)
from bondgraph.support.arrays import Array
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import SPRINGS, has_unit
from identification.diagnosis.catalogue.starts import at_least, rebalanced, rubbing_units
from identification.diagnosis.catalogue.storage.added_mode import inertia
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

BEGUN = (0.2, 0.3, 0.4, 0.6, 0.8, 1.1, 1.6, 2.4)
"""Distances beyond an end of the motion, over half its range, that a fit may begin with; nearer is
a stop."""
LIKE = 0.3
"""Part of a bend, beside any line, by which a magnet may miss it."""
KNEES = (0.3, 0.5, 0.7)
"""Knees tried, over the largest flux linkage."""
STEEPEST = 20.0
"""Change of a coil's reciprocal inductance, over itself, that a fit begins with at most."""


def _magnet(past: PortHistory, gap: float) -> Array:
    law = Magnet(gap=gap, free_standing=False)
    return np.asarray(law.deviation(NUMPY, past.argument, (), (1.0, gap)))


def _beyond_end(past: PortHistory, side: float, away: float) -> float:
    return past.centre + side * (1.0 + away) * past.half


def nearest_magnet(past: PortHistory, bend: Array) -> tuple[float, float] | None:
    """Return force at rest and gap of the magnet nearest to a bend; None if none is near.

    Parameters
    ----------
    bend : ndarray, shape (N,)
        Effort along the history of the spring, beside any straight line.
    """
    line = np.stack([np.ones(past.argument.size), past.argument - past.centre], axis=1)
    gaps = [
        gap
        for side in (-1.0, 1.0)
        for away in BEGUN
        if side * (gap := -_beyond_end(past, side, away)) < -0.1 * past.half
    ]
    made = np.stack([bend, *(_magnet(past, g) for g in gaps)], axis=1)
    told, *tried = (made - line @ np.linalg.lstsq(line, made, rcond=None)[0]).T
    least, found = LIKE * float(np.linalg.norm(told)), None
    for g, c in zip(gaps, tried, strict=True):
        force = float(told @ c) / max(float(c @ c), 1e-300)
        missed = float(np.linalg.norm(told - force * c))
        if missed < least:
            least, found = missed, (force, g)
    return found


def magnet_at(
    effect: Effect,
    scene: FittedModel,
    element: Element,
    force: float,
    gap: float,
    ended: Mapping[str, float],
) -> Insertion:
    """Insert a magnet beside a spring, where the fit of a series `ended`."""
    past = scene.of(element)
    side = -float(np.sign(gap))
    closest = max(side * _beyond_end(past, side, 0.0), 0.05 * past.half)
    units = rubbing_units(element)
    law = Magnet(force, gap, closest, abs(force) or past.swing, False, units[0], units[2])
    graph, (strength, distance) = effect.with_law(scene, element, law)
    added = force * _magnet(past, gap)
    weaker = min(1.0, 0.5 * past.swing / max(float(np.abs(added).max()), 1e-300))
    start = {strength: weaker * force, distance: gap}
    known = {n: v for n, v in ended.items() if n in scene.graph.parameters}
    starts = (
        {**known, **start}, {**start, **rebalanced(element, past, weaker * added)}, start,
    )  # fmt: skip
    inserted = effect.inserted(element, graph, starts, (strength,))
    return replace(
        inserted, law=law.name, form=True,
        sentence="a force beside it grows towards one end, as with a magnet's inverse square",
    )  # fmt: skip


def turns(element: Element) -> bool:
    """Whether a store is a stiffness over an angle, which the torque of a weight may be."""
    return isinstance(element, C) and rubbing_units(element)[2] == "rad"


def weight_at(
    effect: Effect, scene: FittedModel, element: Element, ended: Mapping[str, float]
) -> Insertion:
    """Insert the torque of a weight on an arm, where the fit of a series `ended`, if one did.

    Alone it is all of the torque: as large as the stiffness where it hangs.
    """
    past = scene.of(element)
    known = {n: v for n, v in ended.items() if n in scene.graph.parameters}
    effort = rubbing_units(element)[0]
    law = Gravity(past.slope, past.slope, free_standing=False, unit=effort)
    graph, (strength,) = effect.with_law(scene, element, law)
    slope = past.slope
    if isinstance(element, C) and element.name in known:
        own = known[element.name]
        slope = own if element.stiffness is not None else 1.0 / own
    starts = tuple({**known, strength: share * slope} for share in (1.0, 0.5))
    inserted = effect.inserted(element, graph, starts, (strength,))
    return replace(
        inserted, law=law.name, form=True,
        sentence="its torque follows the sine of the angle, as that of a weight on an arm does",
    )  # fmt: skip


LOSSY = "polynomial_with_loss"
"""Law of `lossy_at`."""
WEAKLY = (1e-3, 3e-2)
"""Part of a spring's effort that its loss begins with."""


def lossy_at(
    effect: Effect, scene: FittedModel, element: C, ended: Mapping[str, float]
) -> Insertion:
    """Insert damping beside the series of a spring, the larger the more that bends.

    It begins with its rest where the slope of ``a_2 z^2 + a_3 z^3`` is least, within the range.
    """
    past, name = scene.of(element), element.name
    bends = [ended.get(f"a_{n}_{name}", 0.0) for n in (2, 3)]
    turn = float(np.clip(-bends[0] / (3.0 * bends[1] or np.inf), -1.0, 1.0))
    size = past.swing / (past.half**2 * float(np.std(past.rate)) or 1.0)
    units = ("1", "1")
    if has_unit(element, SPRINGS):
        effort, _, length = rubbing_units(element)
        units = (f"{effort}*s/{length}3", length)
    damping = GrowingDamping(past.centre + turn * past.half, 0.0, past.half, 0.1 * size, *units)
    assert element.law is not None
    graph, _ = effect.with_law(scene, element, LawSum((element.law, damping)))
    strength = f"gamma_{name}"
    known = {n: v for n, v in ended.items() if n in scene.graph.parameters}
    starts = tuple({**known, strength: share * size} for share in WEAKLY)
    inserted = effect.inserted(element, graph, starts, (strength,))
    return replace(
        inserted,
        law=LOSSY,
        form=True,
        sentence=f"{effect.sentence}, with a loss that follows the bend",
    )


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


def kneeless_at(
    effect: Effect, scene: FittedModel, element: I, ended: Mapping[str, float]
) -> tuple[Insertion, ...]:
    """Insert a current that bends as a series of the flux, where iron with a knee `ended`."""
    name, past = element.name, scene.of(element)
    steep, knee = (ended.get(f"{n}_{name}", 0.0) for n in ("c_s", "p_s"))
    flux = inertia(past) * past.argument
    largest = float(np.abs(flux).max())
    if not (steep and knee and largest):
        return ()
    bend = SaturatingInductance().deviation(NUMPY, flux, (), (steep, knee))
    z = flux / largest
    line, *curve = np.linalg.lstsq(np.stack([z, z**2, z**3], axis=1), bend, rcond=None)[0]
    series = Polynomial(0.0, largest, 0.1 * past.half, unit="A")
    law = Parametrised(series, ("centre", "half"), ("V*s", "V*s"))
    graph, names = effect.with_law(scene, element, law)
    own = {n: v for n, v in ended.items() if n in scene.graph.parameters}
    start = {**own, **dict(zip(names, map(float, curve), strict=True))}
    if name in own:
        start[name] = 1.0 / (1.0 / own[name] + float(line) / largest)
    inserted = effect.inserted(element, graph, (start,), names)
    return (
        replace(
            inserted, law=series.name, form=True,
            sentence="its current bends away from the line with its flux, without a knee",
        ),
    )  # fmt: skip
