"""The sealed demonstration: committed first, judged after the verdict."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bondsight.cli import demonstration as module
from bondsight.cli.demonstration import Outcome, describe, judge, summary
from bondsight.cli.main import main
from hardware.simulators import draw_truth
from hardware.simulators.draw import Truth
from identification.diagnosis.catalogue import CATALOGUE

FEW = ("quadratic_drag", "coulomb_friction", "hysteresis", "creep", "nonlinear_stiffness", "delay")
"""Effects that the cheaper demonstration may name."""


def played(effect: str, seed: int, out: Path, capsys: pytest.CaptureFixture[str]) -> str:
    arguments = ["demo", "--seed", str(seed), "--effect", effect, "--out", str(out)]
    assert main(arguments) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    text = captured.out
    sealed = re.search(r"truth sealed: +sha256 [0-9a-f]{64}", text)
    assert sealed is not None
    assert sealed.start() < text.index("held-out error") < text.index("seal opened:")
    assert effect not in text[: text.index("recording:")]
    assert {"recording.csv", "report.html", "verdict.json"} == {p.name for p in out.iterdir()}
    return text


@pytest.mark.slow
def test_drag_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    few = [e for e in CATALOGUE if e.name in FEW]
    monkeypatch.setattr("identification.diagnosis.search.candidates.CATALOGUE", tuple(few))
    text = played("quadratic_drag", 11, tmp_path, capsys)
    assert "the verdict is: right" in text
    v = json.loads((tmp_path / "verdict.json").read_text(encoding="utf-8"))
    assert v["verdict"] == "missing_physics"
    assert v["findings"][0]["effect"] == "quadratic_drag"


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = played("none", 12, tmp_path, capsys)
    assert "nothing was concealed" in text
    assert "the verdict is: right" in text
    v = json.loads((tmp_path / "verdict.json").read_text(encoding="utf-8"))
    assert v["findings"] == []


@cache
def drawn(effect: str) -> Truth:
    return draw_truth(3, effect=effect)


# -- judge ------------------------------------------------------------------------------------
def judged(
    monkeypatch: pytest.MonkeyPatch, hidden: str, kind: str, named: str = "", place: str = "",
    same: tuple[str, ...] = (), possible: tuple[tuple[str, str], ...] = (),
) -> Outcome:  # fmt: skip
    findings = [
        {
            "effect": named, "confidence": 0.9,
            "location": {"element": place, "indistinguishable_from": list(same)},
            "also_possible": [{"effect": e, "element": p} for e, p in possible],
        }
    ] if kind in ("missing_physics", "unknown_physics") else []  # fmt: skip
    monkeypatch.setattr(module, "verdict", lambda _: {"verdict": kind, "findings": findings})
    d: Any = SimpleNamespace(nominal=None, repaired=None, seconds=1.0)
    return judge(drawn(hidden), d)


@pytest.mark.parametrize(
    ("hidden", "kind", "named", "place", "result"),
    [
        ("quadratic_drag", "missing_physics", "quadratic_drag", "R_nl", "right"),
        ("quadratic_drag", "missing_physics", "quadratic_drag", "k", "wrong"),
        ("quadratic_drag", "missing_physics", "creep", "C_nl", "wrong"),
        ("quadratic_drag", "unknown_physics", "unknown", "R_nl", "abstained"),
        ("quadratic_drag", "explained", "", "", "missed"),
        ("quadratic_drag", "parameters_only", "", "", "missed"),
        ("none", "explained", "", "", "right"),
        ("none", "parameters_only", "", "", "right"),
        ("none", "missing_physics", "creep", "C_nl", "false alarm"),
        ("none", "unknown_physics", "unknown", "C_nl", "false alarm"),
    ],
)
def test_judge(
    monkeypatch: pytest.MonkeyPatch, hidden: str, kind: str, named: str, place: str, result: str
) -> None:
    assert judged(monkeypatch, hidden, kind, named, place).result == result


def test_judge_accepts_the_class_and_reports_look_alikes(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = ("quadratic_drag", "R_nl")
    kind = "missing_physics"
    assert judged(monkeypatch, truth[0], kind, truth[0], "k", same=("R_nl",)).result == "right"
    for k in (kind, "unknown_physics"):
        outcome = judged(monkeypatch, truth[0], k, "creep", "C_nl", possible=(truth,))
        assert outcome.result == "look-alikes"


def test_words(monkeypatch: pytest.MonkeyPatch) -> None:
    assert describe(drawn("none")) == "nothing was concealed"
    assert describe(drawn("quadratic_drag")).endswith("quadratic_drag at R_nl")
    right = judged(monkeypatch, "none", "explained")
    text = summary([right, judged(monkeypatch, "quadratic_drag", "explained")], 2.0)
    assert "right 1" in text
    assert "quadratic_drag" in text
