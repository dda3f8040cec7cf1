"""Where a mismatch sits when nothing may be named: the ports that explain as much as the best."""

from __future__ import annotations

from collections.abc import Sequence

from identification.diagnosis.evidence.decision import Decision
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.search.candidates import Candidate

AS_GOOD = 0.85
"""Part of the best one's improvement that makes a place as good."""
MOST = 5
"""More places than this are no answer."""
LEAST = 0.5
"""Part of the misfit that the best description must remove before its place means anything."""


CLEAR = 8.0
"""Standard errors by which a relation must fail for its ports to be ruled out."""


def places_of(
    decision: Decision, classes: Isolability | None, relations: Sequence[BlindRelation] = ()
) -> tuple[str, ...]:
    """Elements that explain the mismatch about equally well, best first; empty if unresolved.

    Where exactly one relation is at the floor and all others clearly are not, its ports are the
    answer whatever was fitted.
    """
    at_floor = [r for r in relations if r.compatible]
    if len(at_floor) == 1 and all(r.z > CLEAR for r in relations if not r.compatible):
        if len(relations) > 1:
            return at_floor[0].ports
    best_at: dict[str, Candidate] = {}
    for t in decision.trials:
        if t.element not in best_at or t.test < best_at[t.element].test:
            best_at[t.element] = t
    if not best_at:
        return ()
    ranked = sorted(best_at.values(), key=lambda t: t.test)
    excess = max(decision.nominal - 1.0, 1e-12)
    gains = [(decision.nominal - t.test) / excess for t in ranked]
    if gains[0] < LEAST:
        return ()
    chosen = [t.element for t, g in zip(ranked, gains, strict=True) if g > AS_GOOD * gains[0]]
    group = classes.class_of(ranked[0].element) if classes else ()
    together = tuple(dict.fromkeys([*chosen, *group]))
    return together if len(chosen) <= MOST else ()
