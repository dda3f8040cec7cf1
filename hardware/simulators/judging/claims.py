"""What a verdict says about one recording, old verdicts and new ones alike."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

REASSURING = ("explained", "parameters_only")
"""Verdicts that say that nothing is missing."""

_ALARMING = ("missing_physics", "unknown_physics")
_SPELLINGS = {"look_alike": "look_alikes", "look-alikes": "look_alikes", "ambiguous": "look_alikes"}


@dataclass(frozen=True, slots=True)
class Claim:
    """One finding.

    Attributes
    ----------
    answer : str
        ``exact``, ``approximate``, ``look_alikes``, ``family``, ``kind`` or ``unknown``.
    effect, family, kind : str
        What was said; empty where nothing was. A kind is what new verdicts state beside a name or
        instead of it.
    names : frozenset of str
        Effects that the finding asserts: one for exact and approximate answers, else the set.
    also : frozenset of str
        Effects that it lists as not excluded.
    places : frozenset of str
        The place with all that the finding calls indistinguishable from it.
    also_places : frozenset of str
        Elements of what it lists as not excluded.
    resolved : bool
        A place was given: one at least and not more than half of the model's ports.
    probability : float or None
        That the name is right, where the verdict says so.
    """

    answer: str
    effect: str
    family: str
    kind: str
    names: frozenset[str]
    also: frozenset[str]
    places: frozenset[str]
    also_places: frozenset[str]
    resolved: bool
    probability: float | None = None

    @property
    def named(self) -> bool:
        """Whether it gives a name, a set of names or a family."""
        return self.answer in ("exact", "approximate", "look_alikes", "family")

    @property
    def words(self) -> str:
        """The finding in a few words."""
        what = "/".join(sorted(self.names)) or self.family or self.kind or "unknown"
        where = "/".join(sorted(self.places)) if self.resolved else "?"
        return f"{self.answer} {what}@{where}"


@dataclass(frozen=True, slots=True)
class ExamAnswer:
    """What came of one recording.

    Attributes
    ----------
    verdict : str
        As in the contract; empty after a crash.
    nominal, repaired : mapping
        Held-out rms of each reading in SI, of the declared model and of the repaired one.
    seconds, cpu : float
        On the clock and of the processor.
    mistake : bool
        A mistake in the recording was told, not physics.
    first : mapping
        What the first decision looked at, as plain numbers; empty where that was not kept.
    """

    id: str
    verdict: str
    claims: tuple[Claim, ...] = ()
    nominal: Mapping[str, float] = field(default_factory=dict)
    repaired: Mapping[str, float] = field(default_factory=dict)
    seconds: float = float("nan")
    cpu: float = float("nan")
    error: str = ""
    mistake: bool = False
    first: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    @property
    def alarm(self) -> bool:
        """Something was said to be missing."""
        return self.verdict in _ALARMING

    @property
    def reassuring(self) -> bool:
        """It was said that nothing is missing."""
        return self.verdict in REASSURING

    @property
    def words(self) -> str:
        """The answer in a few words."""
        if self.error:
            return "crash: " + self.error.strip().splitlines()[-1][:80]
        return " + ".join(c.words for c in self.claims) or self.verdict


def told_at(effect: str, element: str, sensors: Collection[str]) -> str:
    """Return where truths and verdicts say that an effect of some element is.

    The clock that all readings share is no element: a model has its skew at a source.
    """
    return "clock" if effect == "clock_skew" and element not in sensors else element


def claim_of(finding: Mapping[str, Any], ports: int) -> Claim:
    """Read a finding; `ports` elements of the model may hold an effect."""
    answer = str(finding.get("answer", ""))
    answer = _SPELLINGS.get(answer, answer)
    effect, family = str(finding.get("effect", "unknown")), str(finding.get("family", ""))
    if not answer:
        kin = "family" if family not in ("", "outside") else "unknown"
        answer = "exact" if effect != "unknown" else kin
    rivals = finding.get("also_possible", ())
    also = frozenset(str(r["effect"]) for r in rivals) - {"unknown"}
    own = frozenset({effect}) - {"unknown"}
    names = {"exact": own, "approximate": own, "look_alikes": own | also}.get(answer, frozenset())
    place = finding.get("location") or {}
    element = str(place.get("element", ""))
    places = frozenset(map(str, [element, *place.get("indistinguishable_from", ())])) - {""}
    probability = finding.get("probability")
    return Claim(
        answer,
        effect if answer in ("exact", "approximate") else "",
        family if answer in ("exact", "approximate", "look_alikes", "family") else "",
        str(finding.get("kind") or ""),
        names,
        also,
        places,
        frozenset(str(r.get("element", "")) for r in rivals) - {""},
        bool(element) and 2 * len(places) <= max(ports, 2),
        None if probability is None else float(probability),
    )


def exam_answer_of(content: Mapping[str, Any]) -> ExamAnswer:
    """Read the content of an answer's file."""
    verdict = content.get("verdict") or {}
    ports = len(content.get("ports") or ())
    return ExamAnswer(
        str(content["id"]),
        str(verdict.get("verdict", "")),
        tuple(claim_of(f, ports) for f in verdict.get("findings", ())),
        content.get("nominal_rms") or {},
        content.get("repaired_rms") or {},
        float(content.get("seconds", "nan")),
        float(content.get("cpu_seconds", "nan")),
        str(content.get("error") or ""),
        any(str(a).endswith(" and diagnose again") for a in verdict.get("advice", ())),
        next(iter(content.get("evidence") or ()), {}),
    )
