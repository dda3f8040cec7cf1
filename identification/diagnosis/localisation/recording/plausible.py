"""How plausible each element is as the place of what is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.search.candidates import Candidate
from identification.statistics.blocks import paired_z

UNUSUAL = 0.2
"""Weight of a place where an effect can sit but seldom does."""


def place_weights(trials: Sequence[Candidate]) -> dict[str, float]:
    """Plausibility of each element from the trials at it; sums to 1, empty without trials.

    The best trial of an element is compared with the best of all, block by block on held-out
    data; an element weighs the two-sided probability of a lag that large by chance.

    Parameters
    ----------
    trials : sequence of Candidate
        Named effects and unnamed curves.
    """
    from scipy.special import erfc

    sound = [t for t in trials if np.isfinite(t.test) and t.blocks.size]
    if not sound:
        return {}
    best = min(sound, key=lambda t: t.test)
    weights: dict[str, float] = {}
    for t in sound:
        if t.blocks.size != best.blocks.size:
            continue
        z = 0.0 if t is best else paired_z(t.blocks, best.blocks)
        w = float(erfc(max(z, 0.0) / np.sqrt(2.0))) * (1.0 if t.home else UNUSUAL)
        weights[t.element] = max(weights.get(t.element, 0.0), w)
    total = sum(weights.values())
    return {n: w / total for n, w in weights.items()} if total > 0 else {}


def agreed(weights: Mapping[str, float], decision: Decision) -> dict[str, float]:
    """Weights that give the named place and its look-alikes at least the decision's confidence."""
    if decision.chosen is None or decision.kind != "missing_physics":
        return dict(weights)
    group = {decision.chosen.element, *(t.element for t in decision.same_place)}
    weights = {**dict.fromkeys(group, 0.0), **weights}
    inside = sum(w for n, w in weights.items() if n in group)
    if inside >= decision.confidence:
        return weights
    outside = sum(w for n, w in weights.items() if n not in group)
    grown = dict(weights)
    for n in weights:
        if n in group:
            share = weights[n] / inside if inside > 0 else 1.0 / len(group)
            grown[n] = decision.confidence * share
        else:
            grown[n] = (1.0 - decision.confidence) * (weights[n] / outside)
    return grown


def confidence_of_places(
    decisions: Sequence[Decision], trials: Sequence[Candidate]
) -> dict[str, float]:
    """Confidence of every element over all steps of a diagnosis, by element.

    Parameters
    ----------
    decisions : sequence of Decision
        One after another; each effect has a place of its own, so they need not sum to 1.
    trials : sequence of Candidate
        What was fitted, for decisions that do not carry their trials.
    """
    found: dict[str, float] = {}
    for decision in decisions:
        if decision.kind == "explained":
            continue
        own = getattr(decision, "trials", ()) or trials
        for n, w in agreed(place_weights(own), decision).items():
            found[n] = max(found.get(n, 0.0), w)
    return found
