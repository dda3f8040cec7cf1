"""Where a mismatch sits when nothing may be named: the ports that explain as much as the best."""

from __future__ import annotations

from collections.abc import Sequence

from identification.diagnosis.evidence.decision import PLACES, Decision
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.structural_classes import Isolability

CLEAR = 8.0
"""Standard errors by which a relation must fail for its ports to be ruled out."""
OF_ITS_PORT = ("sensing", "command", "ratio")
"""Kinds that only one sort of element can have, and that follow its own signals."""


def places_of(
    decision: Decision, classes: Isolability | None, relations: Sequence[BlindRelation] = ()
) -> tuple[str, ...]:
    """Elements at which the mismatch may sit, the likeliest first; empty if unresolved.

    Those of the decision's set. Where exactly one relation is at the floor and all others clearly
    are not, its ports are the answer whatever was fitted.
    """
    at_floor = [r for r in relations if r.compatible]
    if len(at_floor) == 1 and all(r.z > CLEAR for r in relations if not r.compatible):
        if len(relations) > 1:
            return at_floor[0].ports
    if not decision.places or len(decision.places) > PLACES:
        return ()
    own = decision.answer == "kind" and decision.physics in OF_ITS_PORT
    group = classes.class_of(decision.places[0]) if classes and not own else ()
    return tuple(dict.fromkeys([*decision.places, *group]))
