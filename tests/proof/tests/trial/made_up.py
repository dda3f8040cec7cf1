"""Truths and answers made by hand, for tests that count."""

from __future__ import annotations

from typing import Any

from tests.proof.trial.answers import Answer, answer_of
from tests.proof.trial.truths import TrueEffect, Truth
from tests.proof.trial.vocabulary import FAMILY_OF

PORTS = {"k_1": "storage", "k_2": "storage", "b_1": "resistor", "b_2": "resistor",
         "m_1": "inertia", "F": "source", "x_1": "sensor"}  # fmt: skip


def true(effect: str, element: str) -> TrueEffect:
    return TrueEffect(effect, FAMILY_OF.get(effect, "outside"), element)


def truth(name: str, cell: str, *effects: tuple[str, str], **more: Any) -> Truth:
    return Truth(name, cell, "chain", tuple(true(*e) for e in effects), **more)


def finding(
    effect: str,
    element: str,
    *same: str,
    family: str | None = None,
    also: tuple[str, ...] = (),
    confidence: float = 0.9,
    answer: str | None = None,
    share: float = 0.97,
) -> dict[str, Any]:
    made: dict[str, Any] = {
        "effect": effect,
        "family": family if family is not None else FAMILY_OF[effect],
        "location": {"element": element, "kind": PORTS.get(element, "junction"),
                     "indistinguishable_from": list(same)},
        "confidence": confidence,
        "share_of_misfit_explained": share,
        "also_possible": [{"effect": e, "element": element, "evidence": ""} for e in also],
    }  # fmt: skip
    return made if answer is None else made | {"answer": answer}


def content(
    name: str,
    *findings: dict[str, Any],
    verdict: str | None = None,
    error: str | None = None,
    **more: Any,
) -> dict[str, Any]:
    """Content of an answer's file."""
    kind = verdict or ("missing_physics" if findings else "explained")
    said = None if error else {"verdict": kind, "findings": list(findings)}
    return {"id": name, "verdict": said, "error": error, "seconds": 1.0, "kinds": PORTS} | more


def answer(name: str, *findings: dict[str, Any], **more: Any) -> Answer:
    return answer_of(content(name, *findings, **more))
