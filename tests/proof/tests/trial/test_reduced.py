"""A sealed trial from end to end, small: drawn, made, sealed, run, opened, scored."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.proof.trial.answers import read_answers
from tests.proof.trial.commitment import commit, reveal, verify
from tests.proof.trial.generating import write_public
from tests.proof.trial.generator.case import Case
from tests.proof.trial.generator.drawing import draw
from tests.proof.trial.generator.writing import generate
from tests.proof.trial.layout import Layout
from tests.proof.trial.oracles import ask_oracles, read_oracles
from tests.proof.trial.publishing import publish
from tests.proof.trial.running import run_all
from tests.proof.trial.scoring import Score, score
from tests.proof.trial.truths import read_public

COUNTS = {"control": 2, "single": 2, "outside": 1}
"""Recordings of each cell; oracles are asked for the singles."""


def chosen(cases: list[Case]) -> list[Case]:
    """Return the first cases of each cell, as drawn: none is picked for its truth."""
    left, found = dict(COUNTS), []
    for case in cases:
        if left.get(case.cell, 0) > 0:
            left[case.cell] -= 1
            found.append(case)
    return found


@pytest.fixture(scope="module")
def layout(tmp_path_factory: pytest.TempPathFactory) -> Layout:
    found = Layout(tmp_path_factory.mktemp("reduced") / "trial")
    cases = chosen(draw("reduced", 11))
    truths = generate(cases, found.data)
    write_public(found, [c.id for c in cases])
    commit(found, truths, "salt of a test", "reduced")
    return found


@pytest.fixture(scope="module")
def scored(layout: Layout) -> Score:
    public = read_public(layout.public)
    verify(layout)
    assert run_all(layout, public, layout.answers, jobs=1) == len(public)
    truths = reveal(layout)
    ask_oracles(layout, public, truths, jobs=1)
    return score(truths, read_answers(layout.answers), read_oracles(layout.oracle))


@pytest.mark.long
def test_no_crash_no_false_alarm_no_wrong_name(scored: Score) -> None:
    said = [(o.truth, o.named, o.placed) for o in scored.outcomes]
    gates = {g.name: g for g in scored.gates}
    assert [o.answer.error for o in scored.outcomes if o.answer.error] == []
    for words in ("false alarms", "wrong name, of", "wrong place", "outside"):
        (gate,) = (g for n, g in gates.items() if words in n)
        assert gate.passed is not False, said


@pytest.mark.long
def test_oracles_answered_for_the_singles(scored: Score) -> None:
    singles = {o.truth.id for o in scored.outcomes if o.truth.cell == "single"}
    assert set(scored.oracles) == singles
    assert [o.error for o in scored.oracles.values() if o.error] == []


@pytest.mark.long
def test_the_result_is_published(scored: Score, layout: Layout) -> None:
    commitment = json.loads(layout.commitment.read_text(encoding="utf-8"))
    path: Path = publish(scored, commitment, layout.score)
    assert commitment["truths_sha256"] in path.read_text(encoding="utf-8")
    # a second run has nothing left to do
    assert run_all(layout, read_public(layout.public), layout.answers, jobs=1) == 0
