"""What comes nearest where neither place nor kind can be told, and how little it explains."""

from __future__ import annotations

from dataclasses import dataclass

from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.evidence.hypotheses import Evidence, Hypothesis
from identification.diagnosis.evidence.kind_score import KindScore

LEAST = 0.05
"""Part of the misfit from which something comes near at all."""
FEW = 3


@dataclass(frozen=True, slots=True)
class Nearest:
    """A law or a kind of physics at a place, and the part of the misfit that it removes.

    Attributes
    ----------
    element : str
    effect, kind : str
        One of the two; the other one is empty.
    part : float
        Of the mean square above the noise, on stretches left out.
    """

    element: str
    effect: str
    kind: str
    part: float


def nearest(e: Evidence) -> tuple[Nearest, ...]:
    """Return what removes most of the misfit, at most `FEW`, the largest part first.

    A kind stands for the laws that it contains, unless one of them does better.
    """
    whole = e.plain.square - 1.0
    if not whole > 0:
        return ()
    found: dict[tuple[str, str], Nearest] = {}
    laws = [s for s in e.laws if s.trial.effect != UNNAMED.name and s.trial.itself]
    tried: list[Hypothesis] = [*laws, *e.kinds]
    for h in tried:
        part = (e.plain.square - h.score.square) / whole
        element, kind = h.element, _kind(h)
        known = found.get((element, kind))
        if part >= LEAST and (known is None or part > known.part):
            named = "" if isinstance(h, KindScore) else h.trial.effect
            found[element, kind] = Nearest(element, named, "" if named else kind, min(part, 1.0))
    return tuple(sorted(found.values(), key=lambda n: -n.part)[:FEW])


def _kind(h: Hypothesis) -> str:
    return h.kind if isinstance(h, KindScore) else h.trial.insertion.kind
