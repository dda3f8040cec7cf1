"""A verdict beside what the owners of a recording document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bondgraph.graph.elements import C, I, R, Sensor, Source, TwoPort
from tests.proof.real.case import RealCase
from tests.proof.trial.answers import Statement, share_of, statement_of

__all__ = ["OUTCOMES", "Judgement", "judge"]

OUTCOMES = (
    "wrong name", "wrong place", "right", "look-alike set", "family", "unknown", "no finding",
    "failed", "absent",
)  # fmt: skip
"""Ways in which a case can end; of several findings the first of these counts."""


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
    wrong; a family, or a set of look-alikes, counts if a documented effect is in it. To find
    nothing is right for a control and "no finding" for all others.
    """
    kind = str(verdict.get("verdict", ""))
    ports = len(case.model().of_type(C, I, R, Source, Sensor, TwoPort))
    said = [statement_of(f, ports, share_of(verdict)) for f in verdict.get("findings") or ()]
    if not said:
        if kind == "unknown_physics":
            return Judgement("unknown", "unknown", "")
        nothing = case.control and kind in ("explained", "parameters_only")
        return Judgement("right" if nothing else "no finding", "nothing", "", kind)
    each = [_one(case, s) for s in said]
    worst = min(each, key=lambda e: OUTCOMES.index(e[0]))
    return Judgement(
        worst[0],
        " + ".join(_words(s) for s in said),
        " + ".join(", ".join(sorted(s.places, key=lambda p: p != s.element)) for s in said),
        worst[1],
    )


def _one(case: RealCase, said: Statement) -> tuple[str, str]:
    """Outcome of one finding, and a note."""
    if said.answer == "unknown":
        return "unknown", ""
    kin = [t for t in case.truth if t.family == said.family]
    meant = [t for t in case.truth if t.effect in said.names]
    if said.answer == "family":
        meant = kin
    if not meant:
        return "wrong name", "of the right family" if kin else ""
    if said.places and not any(said.places & set(t.places) for t in meant):
        known = sorted({p for t in meant for p in t.places})
        return "wrong place", f"documented at {', '.join(known)}"
    return {"look_alikes": "look-alike set", "family": "family"}.get(said.answer, "right"), ""


def _words(said: Statement) -> str:
    if said.answer == "look_alikes":
        return " or ".join(sorted(said.names))
    if said.answer == "family":
        return f"{said.family} (family)"
    return said.effect or "unknown"
