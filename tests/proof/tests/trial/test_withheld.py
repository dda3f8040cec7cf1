"""The truth withheld: who is asked, and what counts as another name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from hardware.simulators.judging.claims import ExamAnswer, exam_answer_of
from hardware.simulators.judging.truths import ExamTruth, truth_of
from tests.proof.tests.exam.made_up import (
    BACKLASH,
    MISSING,
    UNKNOWN,
    effect,
    finding,
    said,
    truth,
)
from tests.proof.trial import withheld
from tests.proof.trial.gates import MISNAMED
from tests.proof.trial.layout import Layout
from tests.proof.trial.nesting import containing
from tests.proof.trial.publishing import withheld_counted
from tests.proof.trial.rates import Rate
from tests.proof.trial.truths import Public
from tests.proof.trial.withheld import (
    publish_withheld,
    run_withheld,
    score_withheld,
    to_withhold,
)

RIGHT = said(MISSING, finding("exact", "backlash"))


def truths(*rows: Mapping[str, Any]) -> dict[str, ExamTruth]:
    return {f"e{i}": truth_of({**r, "id": f"e{i}"}) for i, r in enumerate(rows)}


def answers(*contents: Mapping[str, Any]) -> dict[str, ExamAnswer]:
    return {f"e{i}": exam_answer_of({**c, "id": f"e{i}"}) for i, c in enumerate(contents)}


def test_single_effects_that_were_named_rightly_are_asked() -> None:
    rows = (BACKLASH, BACKLASH, BACKLASH, truth("control"), truth("two", effect(), effect("creep")))
    wrong = said(MISSING, finding("exact", "backlash", "k_1"))
    given = answers(RIGHT, wrong, said(UNKNOWN, finding("unknown")), said("explained"), RIGHT)
    assert to_withhold(truths(*rows), given) == ("e0",)


def test_of_too_many_a_drawn_part_is_asked() -> None:
    many = truths(*[BACKLASH] * 50)
    given = answers(*[RIGHT] * 50)
    some = to_withhold(many, given, 10)
    assert len(set(some)) == 10
    assert some != tuple(sorted(many))[:10]
    # the same ones whatever the order, and more of them with a larger part
    assert to_withhold(dict(reversed(many.items())), given, 20)[:10] == some


def test_the_true_law_is_withheld_from_those_that_are_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def pretend(_: Layout, public: Public, seed: int, names: tuple[str, ...]) -> dict[str, Any]:
        return {**said(UNKNOWN, finding("unknown")), "id": public.id, "seen": [seed, *names]}

    monkeypatch.setattr(withheld, "exam_answer", pretend)
    layout = Layout(tmp_path / "trial")
    layout.recordings.mkdir(parents=True)
    public = [Public(f"e{i}", "chain", ("x_1",)) for i in range(3)]
    for p in public:
        (layout.recordings / f"{p.id}.npz").touch()
    rows = truths(*[truth("single", effect("coulomb_friction", "b_1"))] * 3)
    assert run_withheld(layout, public, rows, ("e0", "e2"), jobs=1) == 2
    assert sorted(p.name for p in layout.withheld.iterdir()) == ["e0.json", "e2.json"]
    kept = json.loads((layout.withheld / "e2.json").read_text(encoding="utf-8"))
    assert kept["seen"] == [0, *containing("coulomb_friction")]
    assert kept["without"] == list(containing("coulomb_friction"))


@pytest.mark.parametrize(
    ("content", "errors"),
    [
        (said(MISSING, finding("exact", "creep")), 1),
        (said(MISSING, finding("approximate", "creep")), 1),
        (said(MISSING, finding("exact", "nonlinear_stiffness")), 0),
        (said(UNKNOWN, finding("kind", kind="restoring")), 0),
        (said(UNKNOWN, finding("look_alikes", "creep")), 0),
        (said(UNKNOWN, finding("family", family="friction")), 0),
        (said(UNKNOWN, finding("unknown")), 0),
        (said("explained"), 0),
        # a right name beside another one does not excuse it
        (said(MISSING, finding("exact", "nonlinear_stiffness"), finding("exact", "creep")), 1),
    ],
)
def test_another_name_is_an_error(content: Mapping[str, Any], errors: int) -> None:
    row = truth("single", effect() | {"names": ["backlash", "nonlinear_stiffness"]})
    found = score_withheld(truths(row), answers(content))
    assert found.rates[MISNAMED] == Rate(errors, 1)
    assert found.gates[0].counted == Rate(errors, 1)


def test_the_gate_is_certified_or_met(tmp_path: Path) -> None:
    honest, other = said(UNKNOWN, finding("kind", kind="slow")), said(
        MISSING, finding("exact", "creep", "k_1")
    )  # fmt: skip
    met = score_withheld(truths(*[BACKLASH] * 59), answers(*[honest] * 59))
    assert met.passed
    assert met.gates[0].certified
    found = score_withheld(truths(*[BACKLASH] * 59), answers(other, *[honest] * 58))
    assert found.passed
    assert found.rates["wrong places, of the places given"] == Rate(1, 59)
    assert found.rates["right kind, of the kinds given"] == Rate(0, 58)
    text = publish_withheld(found, {"tool_commit": "abc"}, tmp_path).read_text("utf-8")
    assert "1/59  1.7 % (0.0-9.1)" in text
    assert "committed: ? at abc" in text
    assert "changed since: the proof's sources" in text
    assert "backlash@k_2 10 | exact creep@k_1 | wrong name, wrong place" in text
    data = json.loads((tmp_path / "withheld.json").read_text(encoding="utf-8"))
    assert data["gates"][0]["state"] == "met, not certified"
    assert withheld_counted(tmp_path) == found.gates


def test_laws_that_contain_the_true_one_are_withheld_too() -> None:
    found = containing("coulomb_friction")
    assert {"coulomb_friction", "stribeck_friction"} <= set(found)
    assert "creep" not in found
