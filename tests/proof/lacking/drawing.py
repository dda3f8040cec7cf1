"""What is drawn: plants that conceal nothing, and an element that the model of each lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from actuators.models.plants import plant_model
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, One, R, Zero
from bondgraph.support.errors import BondsightError
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.drawing import stream
from hardware.simulators.generator.families import FAMILY_OF
from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.places import ends, sharing_flow
from tests.proof.exam.cells import drawn_case
from tests.proof.exam.world import EXAM

EFFECTS = {e.name: e for e in CATALOGUE}
NAMES: Mapping[type, tuple[str, ...]] = {
    R: ("linear_loss", "leakage", "internal_leakage"),
    C: ("linear_spring", "linear_capacity"),
    I: ("linear_inertia",),
}
"""What a missing element may rightly be called, where the name has a place."""
KINDS: Mapping[type, tuple[str, ...]] = {
    R: ("dissipative", "slow"),
    C: ("restoring", "mode"),
    I: ("slow", "mode"),
}
"""Kinds of physics that are right."""


@dataclass(frozen=True)
class Lacking:
    """A case and the element that its model lacks."""

    case: DrawnCase
    element: str


def drawn(seed: int, count: int) -> list[Lacking]:
    """Return so many cases; the same for the same seed, whatever the count.

    Plants take turns, so that few cases have all; a plant's elements are drawn.
    """
    return [_one(i, stream("lacking", seed, i)) for i in range(count)]


def _one(i: int, rng: np.random.Generator) -> Lacking:
    plant = EXAM.plants[i % len(EXAM.plants)]
    case = replace(drawn_case("lacking", plant, (), rng), id=f"l{i:04d}")
    model = plant_model(plant, case.sensors)
    may = [e.name for e in model.of_type(R, C, I) if removable(model, e.name)]
    return Lacking(case, may[int(rng.integers(len(may)))])


def model_of(lacking: Lacking) -> BondGraph:
    """Return the whole model, with the element."""
    return plant_model(lacking.case.plant, lacking.case.sensors)


def removable(model: BondGraph, element: str) -> bool:
    """Whether the model is sound without a linear element of it."""
    if getattr(model[element], "law", None) is not None:
        return False
    try:
        model.remove(element).require_sound()
    except BondsightError:
        return False
    return True


def truth_of(lacking: Lacking) -> ExamTruth:
    """Return what is right to say, in the form of the exam's truths; the noise is not in it.

    How much the element moves is left out: other parameters may take its part. What it moves counts
    as without bound, so that only a model at the noise may be called explained.
    """
    case, name, model = lacking.case, lacking.element, model_of(lacking)
    element, without = model[name], model.remove(name)
    places = {e.name for e in sharing_flow(model, element)} | beside(model, name)
    node = model.neighbour(name)
    if isinstance(element, C) and isinstance(model[node], Zero):
        # what leads to the effort that it holds stands for it where nothing else is there
        leading = (m for m in ends(model, node) if isinstance(model[m], One))
        places |= {m for n in leading for m in ends(model, n) if isinstance(model[m], R)}
    of = next(t for t in NAMES if isinstance(element, t))
    names = [n for n in NAMES[of] if places & {p.name for p in EFFECTS[n].places(without)}]
    kinds = {EFFECTS[n].kind for n in names} | set(KINDS[of])
    effect = ConcealedEffect(
        f"no {name}", frozenset(names), FAMILY_OF[names[0]] if names else "", frozenset(kinds),
        frozenset(places), names[0] if names else "outside", np.inf,
    )  # fmt: skip
    moved = dict.fromkeys(case.sensors, np.inf)
    return ExamTruth(case.id, "lacking", case.plant, (effect,), {}, moved)


def beside(model: BondGraph, name: str) -> set[str]:
    """Return all that hangs at the junction of an element, without it."""
    node = model.neighbour(name)
    ends = {end for b in model.bonds_of(node) for end in (b.tail, b.head)}
    return ends - {node, name}
