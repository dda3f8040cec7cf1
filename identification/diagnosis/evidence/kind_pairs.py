"""Which kinds in question stand in every good pair: a look two effects deep.

Where several effects are missing, what the others leave lies in the way of each: forms of many
kinds then explain about as much, and none could be told. Beside a second form, of any kind
anywhere, the right one leaves less than the others do beside theirs. All pairs are scored on
stretches left out, as single forms are; what every pair holds that the data cannot tell from the
best is told, whatever the second effect is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed

from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.decision import MOSTLY
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.kind_score import (
    Bench,
    KindScore,
    answers_at,
    asked_places,
    forms_at,
    scored_beside,
)
from identification.diagnosis.evidence.kinds_told import CURVES, FAR, LIKE, PLAIN, RICHER
from identification.diagnosis.evidence.shares import together
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.score_test import Screened

MANY = 8
"""Kinds in question beyond which no pair is tried."""


@dataclass(frozen=True, eq=False)
class KindPair:
    """Two kinds with their places, fitted together.

    Attributes
    ----------
    members : tuple of (str, str)
        Element and kind of the one in question, then of the other.
    """

    members: tuple[tuple[str, str], tuple[str, str]]
    score: BlockScore


def pair_scores(
    bench: Bench,
    scene: FittedModel,
    ranked: Sequence[Screened],
    asked: Sequence[KindScore],
    jobs: int = 1,
) -> list[KindPair]:
    """Score every kind in question beside every other kind at every place, in `jobs` threads."""
    elements = bench.problem.graph.elements
    wanted = {(k.element, k.kind) for k in asked}
    begun: dict[tuple[str, str], Bench] = {}
    places = asked_places(bench, scene)
    for name in places:
        if any(name == element for element, _ in wanted):
            forms = forms_at(scene, ranked, elements[name])
            for kind, _, x in answers_at(bench, name, forms):
                if (name, kind) in wanted:
                    columns = np.hstack([bench.columns, x])
                    begun[name, kind] = replace(bench, columns=columns)

    def at(name: str) -> list[KindPair]:
        found = []
        for kind, columns, x in answers_at(bench, name, forms_at(scene, ranked, elements[name])):
            other = (name, kind)
            for one, beside in begun.items():
                if one != other and not (other in begun and other < one):
                    score = scored_beside(beside, columns, x)[0]
                    found.append(KindPair((one, other), score))
        return found

    made = Parallel(n_jobs=jobs, backend="threading")(delayed(at)(name) for name in places)
    return [p for each in made for p in each if p.score.sound]


def in_every_pair(
    pairs: Sequence[KindPair],
    asked: Sequence[KindScore],
    single: BlockScore,
    limits: Thresholds,
    classes: Isolability | None = None,
) -> tuple[tuple[str, str], ...]:
    """Return the kinds in question that all pairs hold which are as good as the best.

    A richer kind at a place holds the curve of one variable there.

    Empty where the best pair does not surely remove most of what the best form alone, `single`,
    leaves above the noise.
    """
    best = min((p.score for p in pairs), key=lambda s: s.loss, default=None)
    if best is None or not single.behind(best) > limits.z:
        return ()
    if not single.square - best.square > MOSTLY * (single.square - 1.0):
        return ()
    loud = float(best.noise.max()) > limits.noise
    gain, least = max(single.excess(best), 1e-12), 1.0 - (LIKE if loud else 0.0)

    def as_good(p: KindPair) -> bool:
        part, behind = 1.0 - p.score.excess(best) / gain, p.score.behind(best)
        return (
            behind < limits.z
            or part > max(least, 1.0 - PLAIN)
            or (part > least and behind < FAR * limits.z)
        )

    def holds(p: KindPair, k: KindScore) -> bool:
        holding = (k.kind, *(RICHER if k.kind in CURVES else ()))
        return any(kind in holding and together(k.element, at, classes) for at, kind in p.members)

    good = [p for p in pairs if as_good(p)]
    return tuple((k.element, k.kind) for k in asked if all(holds(p, k) for p in good))
