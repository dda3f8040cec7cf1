"""What the evidence supports, and how often answers of that sort were right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.nearest import LEAST, Nearest
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.search.candidates import Candidate


@dataclass(frozen=True, eq=False, repr=False)
class Decision:
    """What the evidence supports.

    Attributes
    ----------
    kind : {"explained", "missing_physics", "unknown_physics"}
    answer : {"exact", "approximate", "look_alikes", "family", "kind", "unknown"}
    chosen : Candidate or None
        The named effect, or the best description when nothing may be named.
    physics : str
        Kind of physics (`screening.flexible_forms.KINDS`); empty where none can be told.
    places : tuple of str
        Elements in the set, the likeliest first; empty where they are too many.
    richer : tuple of Candidate
        Richer forms of the named effect that these data neither need nor exclude.
    same_place : tuple of Candidate
        The same effect at other elements, not separable.
    rivals : tuple of Candidate
        Other effects that describe the data as well.
    share : float
        Part of the excess misfit that `chosen` explains.
    law_fit : float
        Part of what any law of its kind could explain at its place; NaN without a law.
    confidence : float
        Calibrated chance that the answer is right.
    reasons : tuple of str
    remaining : Remaining or None
        What is left beside `chosen`.
    trials : tuple of Candidate
        All that was fitted for this decision.
    nominal : float
        Held-out mean square over the floor before this decision.
    nearest : tuple of Nearest
        What comes nearest where neither place nor kind nor name is told.
    """

    kind: str
    chosen: Candidate | None
    same_place: tuple[Candidate, ...]
    rivals: tuple[Candidate, ...]
    share: float
    confidence: float
    reasons: tuple[str, ...]
    richer: tuple[Candidate, ...] = ()
    remaining: Remaining | None = None
    trials: tuple[Candidate, ...] = ()
    nominal: float = float("nan")
    answer: str = "unknown"
    physics: str = ""
    places: tuple[str, ...] = ()
    law_fit: float = float("nan")
    kinds: tuple[KindScore, ...] = ()
    nearest: tuple[Nearest, ...] = ()

    def __repr__(self) -> str:
        """Return one line; all that was fitted would fill pages."""
        what = self.chosen.label if self.chosen is not None else self.physics
        return f"<Decision {' '.join(filter(None, (self.kind, self.answer, what)))}>"

    def with_rest(self, left: Remaining) -> Decision:
        """Return it with what is left on all held-out samples, in its reasons too.

        It was decided on those that choices may look at; a reader is told one number. What names an
        effect tells what that gains, and stays.
        """
        if self.kind == "missing_physics" or self.remaining is None:
            return self
        told, now = self.remaining.words, left.words
        return replace(self, reasons=tuple(r.replace(told, now) for r in self.reasons))

    @property
    def closest(self) -> Candidate | None:
        """The best description, if it explains enough to come near at all."""
        return self.chosen if self.share >= LEAST else None

    @property
    def possible(self) -> tuple[Candidate, ...]:
        """The best description and its rivals."""
        return self.rivals if self.chosen is None else (self.chosen, *self.rivals)

    @property
    def family(self) -> str:
        """Family of what is missing; ``outside`` where none can be given."""
        families = {t.insertion.family for t in self.possible}
        known = self.answer not in ("unknown", "kind") and len(families) == 1
        return families.pop() if known else "outside"


RIGHT: Mapping[str, float] = MappingProxyType(
    {"exact": 0.973, "approximate": 0.966, "family": 0.857, "kind": 0.808}
)
"""Share of the answers of a sort that were right in the development exam, as its `certify` prints
it: one right and one wrong more than were counted."""


def probability(d: Decision) -> float:
    """Chance that the answer is right; zero where none is given."""
    return RIGHT.get(d.answer, 0.0)
