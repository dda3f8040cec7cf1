"""A verdict beside what the owners of a recording document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bondgraph.graph.elements import C, I, R, Source, TwoPort
from bondgraph.graph.sensors import Sensor
from hardware.simulators.judging.claims import Claim, claim_of
from tests.proof.real.case import RealCase

__all__ = ["OUTCOMES", "Judgement", "judge"]

OUTCOMES = (
    "wrong name", "wrong place", "right", "right kind", "set of the kind", "look-alike set",
    "family", "unknown", "no finding", "failed", "absent",
)  # fmt: skip
"""Ways in which a case can end; of several findings the first of these counts."""
REASSURING = ("explained", "parameters_only")
"""Verdicts that say that no physics is missing."""
NOTHING = "nothing"
"""What was said where nothing was found."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """What was said, and how it stands beside the documented physics.

    Parameters
    ----------
    outcome : str
        One of `OUTCOMES`.
    said, place : str
        Names and places of all findings.
    note : str
        Why, where the outcome alone does not say it.
    """

    outcome: str
    said: str
    place: str
    note: str = ""


def judge(case: RealCase, verdict: Mapping[str, Any]) -> Judgement:
    """Judge a verdict (schema ``bondsight.verdict/1``) by the documented effects of a case.

    A single name must be a documented effect at one of its places, or at an element that the
    finding calls indistinguishable from such a place. A name that is only of the same family is
    wrong; a family, or a set of look-alikes, counts if a documented effect is in it. A kind (a
    finding with ``answer`` "kind" and its ``kind``) must be one of the case, at a place of a
    documented effect; another kind is a wrong name, and one without a place is no answer. A set of
    look-alikes that are all of one kind of the case tells that kind too. Kinds at places that are
    listed as alike are a set of look-alikes if a documented one is among them, else nothing is
    known. A set of which every member is documented, at a documented place, tells nothing wrong and
    counts as one of the kind. To find nothing is right for a control and "no finding" for all
    others.
    """
    overall = str(verdict.get("verdict", ""))
    ports = len(case.model().of_type(C, I, R, Source, Sensor, TwoPort))
    findings = tuple(verdict.get("findings") or ())
    said = [claim_of(f, ports) for f in findings]
    kinds = [_kind(f) for f in findings]
    if not said:
        if overall == "unknown_physics":
            return Judgement("unknown", "unknown", "")
        nothing = case.control and overall in REASSURING
        return Judgement("right" if nothing else "no finding", NOTHING, "", overall)
    both = tuple(zip(said, kinds, strict=True))
    each = [
        _of_kind(case, s, k) if k else _one(case, s, f)
        for (s, k), f in zip(both, findings, strict=True)
    ]
    worst = min(each, key=lambda e: OUTCOMES.index(e[0]))
    return Judgement(
        worst[0],
        " + ".join(f"{k} (kind)" if k else _words(s) for s, k in both),
        " + ".join(map(_places, findings)),
        worst[1],
    )


def _places(finding: Mapping[str, Any]) -> str:
    """Places of a finding, the stated one first."""
    place = finding.get("location") or {}
    alike = sorted({*map(str, place.get("indistinguishable_from", ()))} - {place.get("element")})
    return ", ".join(filter(None, (str(place.get("element", "")), *alike)))


def _kind(finding: Mapping[str, Any]) -> str:
    """Kind that a finding states in place of a name; empty if it does not."""
    return str(finding.get("kind", "")) if finding.get("answer") == "kind" else ""


def _kinds_alike(case: RealCase, finding: Mapping[str, Any]) -> tuple[str, str]:
    """Outcome of kinds at places that are said to look alike, and a note."""
    told = [(r["kind"], r["element"]) for r in finding.get("also_possible", ()) if r.get("kind")]
    known = {p for t in case.truth for p in t.places}
    right = [kind in case.kinds and place in known for kind, place in told]
    if not any(right):
        return "unknown", _nearest(finding)
    note = "alike: " + ", ".join(f"{k} at {p}" for k, p in told)
    return ("set of the kind" if all(right) else "look-alike set"), note


def _nearest(finding: Mapping[str, Any]) -> str:
    """What comes nearest where nothing is told: a hint, which counts as no answer."""
    near = [
        f"{n.get('kind') or n['effect']} at {n['element']} {100 * n['share']:.0f} %"
        for n in finding.get("nearest", ())
    ]
    return f"nearest: {', '.join(near)}" if near else ""


def _of_kind(case: RealCase, said: Claim, kind: str) -> tuple[str, str]:
    """Outcome of a finding that is a kind, and a note."""
    if kind not in case.kinds:
        return "wrong name", f"right kinds are {', '.join(case.kinds)}"
    if not said.places:
        return "unknown", "a kind without a place"
    known = {p for t in case.truth for p in t.places}
    if not said.places & known:
        return "wrong place", f"documented at {', '.join(sorted(known))}"
    return "right kind", ""


def _one(case: RealCase, said: Claim, finding: Mapping[str, Any]) -> tuple[str, str]:
    """Outcome of one finding, and a note."""
    if not said.named:
        return _kinds_alike(case, finding)
    kin = [t for t in case.truth if t.family == said.family]
    meant = [t for t in case.truth if t.effect in said.names]
    if said.answer == "family":
        meant = kin
    if not meant:
        return "wrong name", "of the right family" if kin else ""
    if said.places and not any(said.places & set(t.places) for t in meant):
        known = sorted({p for t in meant for p in t.places})
        return "wrong place", f"documented at {', '.join(known)}"
    kind = str(finding.get("kind", ""))
    if said.answer == "look_alikes" and kind in case.kinds:
        return "set of the kind", kind
    if said.answer == "look_alikes" and said.names == {t.effect for t in meant}:
        return "set of the kind", "every one of them is documented"
    return {"look_alikes": "look-alike set", "family": "family"}.get(said.answer, "right"), ""


def _words(said: Claim) -> str:
    if said.answer == "look_alikes":
        return " or ".join(sorted(said.names))
    if said.answer == "family":
        return f"{said.family} (family)"
    return said.effect or "unknown"
