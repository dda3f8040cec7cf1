"""One answer beside its truth: what was right, what was wrong, what was left open."""

from __future__ import annotations

from dataclasses import dataclass

from tests.proof.trial.answers import Answer, Statement
from tests.proof.trial.truths import TrueEffect, Truth


@dataclass(frozen=True, slots=True)
class Judged:
    """One finding beside the truth.

    Attributes
    ----------
    name : str
        ``right``, ``family`` (the right one, or one for
        physics outside the vocabulary), ``look_alikes`` (a set that holds the truth),
        ``unknown`` or ``wrong``.
    place : str
        ``right`` (the true element is the place or called indistinguishable from it), ``wrong`` or
        ``unresolved``.
    truth : TrueEffect or None
        The effect that it speaks of, if any.
    """

    statement: Statement
    name: str
    place: str
    truth: TrueEffect | None

    @property
    def names(self) -> bool:
        """Whether the finding gives a name, a family or a set of names."""
        return self.statement.answer != "unknown"


@dataclass(frozen=True, slots=True)
class Outcome:
    """A recording's answer beside its truth.

    Attributes
    ----------
    name : str
        For recordings with one effect the worst that was said: ``wrong``, else ``right``,
        ``look_alikes``, ``family``, ``unknown``, ``missed`` (nothing was said to be missing) or
        ``crashed``. Where nothing is missing: ``quiet``, ``false_alarm`` or ``crashed``.
    place : str
        ``right``, ``wrong``, ``unresolved`` or ``none``.
    found : int
        How many of the effects were named rightly at the right place.
    """

    truth: Truth
    answer: Answer
    judged: tuple[Judged, ...]
    name: str
    place: str
    found: int

    @property
    def right(self) -> bool:
        """Right name at the right class of ports (nothing said where nothing is missing)."""
        if self.truth.empty:
            return self.name == "quiet"
        return self.name == "right" and self.place == "right"

    @property
    def named(self) -> str:
        """Names that were given, as one text; the kind of answer where none was."""
        if not self.answer.alarm:
            return "crashed" if self.answer.error else self.answer.verdict
        said = [" or ".join(sorted(j.statement.names)) or j.statement.family for j in self.judged]
        return " + ".join(s or "unknown" for s in said) or "unknown"

    @property
    def placed(self) -> str:
        """Places that were given, as one text."""
        return " + ".join("/".join(sorted(j.statement.places)) for j in self.judged)


def judge(truth: Truth, answer: Answer, separable: bool | None = None) -> Outcome:
    """Compare an answer with the truth of its recording.

    Parameters
    ----------
    separable : bool, optional
        Whether an oracle that is told the truth separates it from the best rival. Where it cannot,
        a name that lists the truth among what it does not exclude counts as a set of look-alikes.
    """
    judged = tuple(_judged(s, truth, separable) for s in answer.statements)
    if truth.empty:
        name = "false_alarm" if answer.alarm else "crashed" if answer.error else "quiet"
        return Outcome(truth, answer, judged, name, "none", 0)
    found = {
        j.truth for j in judged if j.name == "right" and j.place == "right" and j.truth is not None
    }
    return Outcome(truth, answer, judged, _name(judged, answer), _place(judged), len(found))


def _judged(said: Statement, truth: Truth, separable: bool | None) -> Judged:
    same = [e for e in truth.effects if e.effect in said.names]
    kin = [e for e in truth.effects if said.answer == "family" and e.family == said.family]
    if truth.cell == "form" and said.answer == "exact":
        # another form of a law of the catalogue: its family is the right answer
        same = same or [e for e in truth.effects if e.family == said.family]
    excused = said.answer == "exact" and not same and separable is False
    also = [e for e in truth.effects if excused and e.effect in said.also]
    if said.answer == "exact" and same:
        name = "right"
    elif (said.answer == "look_alikes" and same) or also:
        name = "look_alikes"
    elif kin:
        name = "right" if truth.cell == "form" else "family"
    elif said.answer == "unknown":
        name = "unknown"
    elif said.answer == "family" and truth.cell == "outside":
        name = "family"  # whether it is kin to physics outside the vocabulary cannot be judged
    else:
        name = "wrong"
    spoken = same or also or kin or list(truth.effects)
    here = [e for e in spoken if e.element in said.places]
    place = "unresolved" if not said.resolved else "right" if here else "wrong"
    about = [*here, *spoken]
    return Judged(said, name, place, about[0] if about else None)


def _name(judged: tuple[Judged, ...], answer: Answer) -> str:
    names = {j.name for j in judged}
    for name in ("wrong", "right", "look_alikes", "family", "unknown"):
        if name in names:
            return name
    if answer.error:
        return "crashed"
    return "unknown" if answer.alarm else "missed"


def _place(judged: tuple[Judged, ...]) -> str:
    places = {j.place for j in judged}
    for place in ("wrong", "right", "unresolved"):
        if place in places:
            return place
    return "none"
