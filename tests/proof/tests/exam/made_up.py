"""Truths and answers written by hand, for tests that count."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.outcome import ExamOutcome, judge_exam
from hardware.simulators.judging.truths import truth_of
from tests.proof.exam.counting import ExamScore, score_exam

Pair = tuple[Mapping[str, Any], Mapping[str, Any]]
"""A truth and an answer, as they stand in their files."""
NOISE = {"x_1": 1e-6, "x_2": 2e-6}
PORTS = ["F", "b_1", "b_2", "k_1", "k_2", "m_1", "m_2", "x_1", "x_2"]


def effect(name: str = "backlash", place: str = "k_2", moved: float = 10.0) -> dict[str, Any]:
    outside = name == "unknown"
    return {
        "effect": name,
        "names": [] if outside else [name],
        "family": {"backlash": "restoring", "coulomb_friction": "friction"}.get(name, "outside"),
        "kinds": {"backlash": ["restoring"], "coulomb_friction": ["dissipative"]}.get(
            name, ["surface"]
        ),
        "places": [place],
        "law": name,
        "moved": {"x_1": moved, "x_2": 0.1 * moved},
    }


def truth(cell: str, *effects: Mapping[str, Any]) -> dict[str, Any]:
    moved = max((e["moved"]["x_1"] for e in effects), default=0.0)
    return {
        "id": "e0",
        "cell": cell,
        "plant": "chain",
        "effects": list(effects),
        "noise_std": NOISE,
        "moved": {"x_1": moved, "x_2": 0.1 * moved},
    }


def finding(
    answer: str, effect: str = "unknown", place: str = "k_2", **more: Any
) -> dict[str, Any]:
    family = {"backlash": "restoring", "coulomb_friction": "friction"}.get(effect, "outside")
    return {
        "location": {"element": place, "indistinguishable_from": more.pop("same", [])},
        "answer": answer, "effect": effect, "family": family, "also_possible": [], **more,
    }  # fmt: skip


def said(verdict: str, *findings: Mapping[str, Any], over: float = 0.0) -> dict[str, Any]:
    """Answer whose misfit remains `over` times the noise at the second reading."""
    rms = {"x_1": 1e-6, "x_2": 2e-6 * math.hypot(1, over)}
    return {
        "id": "e0", "verdict": {"verdict": verdict, "findings": list(findings)}, "ports": PORTS,
        "nominal_rms": rms, "repaired_rms": None, "seconds": 2.0, "cpu_seconds": 1.0, "error": None,
    }  # fmt: skip


def judged(row: Mapping[str, Any], content: Mapping[str, Any]) -> ExamOutcome:
    return judge_exam(truth_of(row), exam_answer_of(content))


def counted(*pairs: Pair) -> ExamScore:
    rows = {f"e{i}": truth_of({**row, "id": f"e{i}"}) for i, (row, _) in enumerate(pairs)}
    answers = {f"e{i}": exam_answer_of({**c, "id": f"e{i}"}) for i, (_, c) in enumerate(pairs)}
    return score_exam(rows, answers)


BACKLASH = truth("single", effect())
MISSING, UNKNOWN = "missing_physics", "unknown_physics"
