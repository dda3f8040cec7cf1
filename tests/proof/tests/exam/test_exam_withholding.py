"""Stored evidence decided without the true law: what knobs do, and what nothing can deny."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from hardware.simulators.judging.truths import truth_of
from tests.identification.diagnosis.decision_cases import Case, lag
from tests.proof.exam import __main__ as command
from tests.proof.exam.certifying import GRID
from tests.proof.exam.stored import evidence_of, stored
from tests.proof.exam.withholding import trades, withheld_lines, without
from tests.proof.tests.exam.made_up import MISSING, effect, finding, said, truth
from tests.proof.trial.layout import Layout
from tests.proof.trial.rates import Rate

FRICTION = truth("single", effect("coulomb_friction", "d", moved=90.0))


def content(other: float) -> dict[str, Any]:
    """Rightly named friction, beside a drag that leaves `other` times the noise."""
    case = Case(90.0).law("coulomb_friction at d", 0.0).law("quadratic_drag at d", other)
    case.kind("dissipative", "d", other - lag(1.0)).law("stribeck_friction at d", lag(0.5))
    told = said(MISSING, finding("exact", "coulomb_friction", "d", physics="dissipative"))
    return {**told, "ports": ["F", "m", "d", "k"], "evidence": [stored(case.evidence())]}


def test_laws_that_contain_the_true_one_go_with_it() -> None:
    left = without(evidence_of(content(0.5)["evidence"][0]), "coulomb_friction")
    assert [s.trial.effect for s in left.laws] == ["quadratic_drag"]


@pytest.mark.parametrize(("other", "noise"), [(0.5, 1), (2.0, 0)])
def test_another_name_is_counted_and_whether_anything_speaks_against_it(
    other: float, noise: int
) -> None:
    found = list(trades({"e0": truth_of(FRICTION)}, [content(other)]))
    assert len(found) == 2 * len(GRID)
    usual = found[0]
    assert usual.limits == GRID[-1]
    assert (usual.misnamed, usual.undeniable, usual.kept) == (
        Rate(1, 1), Rate(noise, 1), Rate(1, 1)
    )  # fmt: skip
    (line, *_) = withheld_lines({"e0": truth_of(FRICTION)}, [content(other)])
    assert "misnamed 1/1" in line
    assert f"leave noise {noise}/1" in line


def test_a_kind_is_no_wrong_name_and_wrong_answers_are_not_asked() -> None:
    far = content(60.0)
    case = Case(90.0).law("coulomb_friction at d", 0.0).law("quadratic_drag at d", 60.0)
    far["evidence"] = [stored(case.kind("dissipative", "d", lag(1.0)).evidence())]
    assert next(trades({"e0": truth_of(FRICTION)}, [far])).misnamed == Rate(0, 1)
    wrong = {**content(0.5), **said(MISSING, finding("exact", "backlash", "k_2"))}
    assert next(trades({"e0": truth_of(FRICTION)}, [wrong])).kept == Rate(0, 0)


def test_the_command_reads_answers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    layout = Layout(tmp_path / "exam")
    layout.answers.mkdir(parents=True)
    (layout.answers / "e0.json").write_text(json.dumps(content(0.5)), encoding="utf-8")
    layout.truths.parent.mkdir(parents=True)
    layout.truths.write_text(json.dumps([FRICTION]), encoding="utf-8")
    assert command.main(["withhold", "--folder", str(layout.folder)]) == 0
    assert capsys.readouterr().out.count("misnamed 1/1") >= 1
