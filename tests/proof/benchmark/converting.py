"""Our own answers as entries: they come in by the same door as all others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hardware.simulators.judging.claims import Claim, exam_answer_of


def entry_of(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of an answer's file as an entry of the benchmark."""
    said = exam_answer_of(content)
    decided = said.alarm or said.reassuring
    made: dict[str, Any] = {
        "id": said.id,
        "alarm": said.alarm if decided else None,
        "findings": [finding_of_claim(c) for c in said.claims],
    }
    if said.mistake:
        made["mistake"] = True
    if said.error or not said.verdict:
        made["error"] = said.error or "no verdict"
    return made


def finding_of_claim(c: Claim) -> dict[str, Any]:
    """Return a claim as a finding, what it leaves open left out."""
    found: dict[str, Any] = {
        "answer": c.answer,
        "names": sorted(c.names),
        "family": c.family if c.answer == "family" else "",
        "kind": c.kind,
        "places": sorted(c.places),
        "also_names": sorted(c.also),
        "also_places": sorted(c.also_places),
        "probability": c.probability,
    }
    return {k: v for k, v in found.items() if v not in ("", [], None)}
