"""Where a mismatch sits when nothing may be named: the ports that explain as much as the best."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.kinds_told import PLACES
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.structural_classes import Isolability

CLEAR = 8.0
"""Standard errors by which a relation must fail for its ports to be ruled out."""
LEFT = 0.01
"""Part of the misfit that the relation blind to the right place may leave: linear in the port."""
UNSEEN = 1.0
"""Held-out misfit above the noise, over what was fitted, that is no accident."""
APART = 4.0
"""Times more that the relation blind to any other place must leave."""


def located(relations: Sequence[BlindRelation], readings: Collection[str]) -> tuple[str, ...]:
    """Return the only ports where the mismatch may sit, whatever its law; empty if not known.

    The relation blind to them is at the floor or leaves little of the misfit, and every other one
    clearly leaves more. What is blind to one of the `readings` does not hear it, so that the others
    leave little anyhow: there all of it has to go. Ports that no relation excludes are among them:
    two-ports, whose sides together explain more than any other port.
    """
    decided = [r for r in relations if r.decided]
    single = [r for r in decided if r.sides == 1]
    if len(decided) < 2 or not single:
        return ()
    # the two sides of a two-port hide all that lies behind it: they exclude nobody
    best = single[0]
    if not _alone(single, readings):
        return ()
    least = best.train if best.compatible else APART * best.train
    free = [
        r for r in relations
        if r is not best and (not r.decided or (r.sides > 1 and (r.compatible or r.train < least)))
    ]  # fmt: skip
    ports = (*best.ports, *(n for r in free for n in r.ports))
    return ports if len(free) == 0 or len(ports) <= PLACES else ()


def _alone(relations: Sequence[BlindRelation], readings: Collection[str]) -> bool:
    """Whether the first relation explains the mismatch and no other one does."""
    best, *others = relations
    listens = not set(best.ports) & set(readings)
    least = LEFT * (best.nominal - 1.0)
    if best.test - 1.0 > max(least, UNSEEN * best.train):
        return False  # what was fitted to some samples must hold for others
    apart = all(r.train > APART * best.train for r in others)
    if best.compatible:
        # no floor can be read below what is left there: one read too high hides what others leave
        return apart or (listens and all(not r.compatible and r.z > CLEAR for r in others))
    little = best.train - 1.0 < least and best.test - 1.0 < least
    clear = all(r.train - 1.0 > APART * (best.train - 1.0) for r in others)
    return listens and little and clear


def places_of(decision: Decision, classes: Isolability | None) -> tuple[str, ...]:
    """Elements at which the mismatch may sit, the likeliest first; empty if unresolved."""
    if not decision.places or len(decision.places) > PLACES:
        return ()
    own = decision.answer == "kind"  # not every element can have it
    group = classes.class_of(decision.places[0]) if classes and not own else ()
    return tuple(dict.fromkeys([*decision.places, *group]))
