"""The seal: reproducible, opened only with all answers, tampering detected."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

from bondgraph.support.errors import UnusableInput
from bondsight.cli.main import main
from hardware.simulators.generator.writing import seal
from tests.proof.tests.exam.made_up import MISSING, effect, finding, said, truth
from tests.proof.trial import commitment
from tests.proof.trial.commitment import (
    PROOF,
    changed_since,
    commit,
    read_commitment,
    reveal,
    source_hash,
    tool_commit,
    truths_hash,
    verify,
    with_note,
)
from tests.proof.trial.layout import Layout
from tests.proof.trial.parts import committed

ROWS: list[dict[str, Any]] = [
    truth("control") | {"id": "r0", "control_kind": "plain"},
    truth("single", effect("backlash", "k", 12.5)) | {"id": "r1"},
]


@pytest.fixture
def layout(tmp_path: Path) -> Layout:
    found = Layout(tmp_path / "trial")
    found.recordings.mkdir(parents=True)
    found.folder.mkdir()
    for name in ("r0", "r1"):
        (found.recordings / f"{name}.npz").write_bytes(name.encode() * 50)
    found.public.write_text("{}", encoding="utf-8")
    return found


def answered(layout: Layout) -> None:
    layout.answers.mkdir()
    for name in ("r0", "r1"):
        (layout.answers / f"{name}.json").write_text("{}", encoding="utf-8")


def test_the_hash_is_of_salt_and_canonical_text() -> None:
    text = '[{"a":[1.5,null],"id":"r0"}]'
    by_hand = hashlib.sha256(("ab12" + text).encode()).hexdigest()
    assert truths_hash("ab12", [{"id": "r0", "a": [1.5, None]}]) == by_hand
    assert truths_hash("ab13", [{"id": "r0", "a": [1.5, None]}]) != by_hand
    # the generator's own seal, written independently, agrees
    assert truths_hash("ab12", ROWS) == seal(ROWS, "ab12")


def test_generator_and_judge_belong_to_the_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    tool, proof = source_hash(("hardware",)), source_hash(PROOF)
    monkeypatch.setattr(commitment, "JUDGES", ())
    assert source_hash(("hardware",)) != tool
    assert source_hash(PROOF) == proof


def test_the_commitment_holds_what_must_be_fixed_before_the_run(layout: Layout) -> None:
    path = commit(layout, ROWS, "ab12")
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["truths_sha256"] == truths_hash("ab12", ROWS)
    assert set(content["data_sha256"]) == {"r0.npz", "r1.npz", "public.json"}
    assert content["data_sha256"]["r0.npz"] == hashlib.sha256(b"r0" * 50).hexdigest()
    assert content["thresholds"]["z"] > 0
    assert content["options"]["without"] == []
    assert content["tool_commit"] == tool_commit()
    assert content["source_sha256"] == source_hash()
    # the proof's own sources are hashed apart from the tool's
    assert content["proof_sha256"] == source_hash(PROOF) != content["source_sha256"]
    text = path.read_text(encoding="utf-8")
    assert "ab12" not in text
    assert "backlash" not in text
    # neither salt nor truths lie in the folder that is committed
    assert not any("backlash" in p.read_text() for p in layout.folder.rglob("*") if p.is_file())
    with pytest.raises(UnusableInput, match="committed already"):
        commit(layout, ROWS, "ab12")


def test_without_a_given_salt_every_seal_differs(tmp_path: Path) -> None:
    hashes = set()
    for name in ("a", "b"):
        layout = Layout(tmp_path / name)
        layout.folder.mkdir()
        layout.public.write_text("{}", encoding="utf-8")
        content = json.loads(commit(layout, ROWS).read_text(encoding="utf-8"))
        hashes.add(content["truths_sha256"])
    assert len(hashes) == 2


def test_the_seal_opens_when_every_recording_has_its_answer(layout: Layout) -> None:
    commit(layout, ROWS, "ab12")
    with pytest.raises(UnusableInput, match="2 of 2 recordings have no answer"):
        reveal(layout)
    assert not layout.revealed.exists()
    answered(layout)
    truths = reveal(layout)
    assert truths["r1"].effects[0].family == "restoring"
    assert truths["r1"].effects[0].moved == 12.5
    assert truths["r0"].control == "plain"
    opened = json.loads(layout.revealed.read_text(encoding="utf-8"))
    assert truths_hash(opened["salt"], opened["truths"]) == truths_hash("ab12", ROWS)
    # once opened, the committed folder alone is enough
    layout.truths.unlink()
    assert reveal(layout)["r1"] == truths["r1"]


def test_changed_truths_are_noticed(layout: Layout) -> None:
    commit(layout, ROWS, "ab12")
    answered(layout)
    changed = json.loads(layout.truths.read_text(encoding="utf-8"))
    changed[1]["effects"][0]["place"] = "m"
    layout.truths.write_text(json.dumps(changed), encoding="utf-8")
    with pytest.raises(UnusableInput, match="not those that were committed"):
        reveal(layout)


def test_changed_data_and_settings_are_noticed(layout: Layout) -> None:
    commit(layout, ROWS, "ab12")
    verify(layout)
    (layout.recordings / "r1.npz").write_bytes(b"other")
    with pytest.raises(UnusableInput, match=r"1 files differ from the commitment, first r1\.npz"):
        verify(layout)
    (layout.recordings / "r1.npz").write_bytes(b"r1" * 50)
    content = json.loads(layout.commitment.read_text(encoding="utf-8"))
    content["thresholds"]["z"] += 0.5
    layout.commitment.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(UnusableInput, match="the thresholds differ"):
        verify(layout)
    content["thresholds"]["z"] -= 0.5
    content["source_sha256"] = "0" * 64
    layout.commitment.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(UnusableInput, match="the tool's sources differ"):
        verify(layout)
    # what is being developed may change its sources, never its data
    content["kind"] = "development"
    layout.commitment.write_text(json.dumps(content), encoding="utf-8")
    verify(layout)
    (layout.recordings / "r2.npz").write_bytes(b"one more")
    with pytest.raises(UnusableInput, match=r"first r2\.npz"):
        verify(layout)


def test_a_quick_trial_holds_the_tool_as_well(layout: Layout) -> None:
    commit(layout, ROWS, kind="quick")
    content = read_commitment(layout)
    content["options"]["keep"] += 1
    layout.commitment.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(UnusableInput, match="the options differ"):
        verify(layout)


def test_what_changed_of_the_proof_itself_is_said(
    layout: Layout, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    design = tmp_path / "DESIGN.md"
    monkeypatch.setattr(commitment, "DESIGN", design)
    design.write_text("cells", encoding="utf-8")
    commit(layout, ROWS)
    content = read_commitment(layout)
    assert content["design_sha256"] == hashlib.sha256(b"cells").hexdigest()
    assert changed_since(content) == ()
    design.write_text("other cells", encoding="utf-8")
    assert changed_since(content) == ("the design",)
    # that is told beside the score; what was run is the tool, which is as it was
    verify(layout)
    assert changed_since(content | {"proof_sha256": "0"}) == ("the proof's sources", "the design")
    # of the tool too: a score may be counted with another one than has answered
    assert changed_since(content | {"thresholds": {}, "source_sha256": "0"})[1:] == (
        "the thresholds", "the tool's sources",
    )  # fmt: skip


@pytest.mark.parametrize("step", ["score", "withheld"])
def test_no_oracle_and_no_withheld_law_is_asked_of_a_changed_tool(
    layout: Layout, step: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    row = {"id": "r1", "plant": "chain", "sensors": ["x_1", "x_2"], "hold": "hold", "delay": 0.0}
    layout.public.write_text(json.dumps({"recordings": [row]}), encoding="utf-8")
    commit(layout, ROWS, "ab12")
    answered(layout)
    right = said(MISSING, finding("exact", "backlash", "k")) | {"id": "r1"}
    (layout.answers / "r1.json").write_text(json.dumps(right), encoding="utf-8")
    quiet = said("explained") | {"id": "r0"}
    (layout.answers / "r0.json").write_text(json.dumps(quiet), encoding="utf-8")
    monkeypatch.setattr(commitment, "source_hash", lambda folders=(): "another")
    assert main(["blind", step, "--folder", str(layout.folder), "--jobs", "1"]) == 2
    assert "the tool's sources differ from the commitment" in capsys.readouterr().err
    assert not layout.oracle.exists()
    assert not layout.withheld.exists()


def test_the_score_says_since_when_the_salt_is_public(layout: Layout) -> None:
    commit(layout, ROWS)
    assert "salt public before the end" not in dict(committed(with_note(layout)))
    layout.note.write_text("A note.\nThe salt is public since Friday.\n", encoding="utf-8")
    facts = dict(committed(with_note(layout)))
    assert facts["salt public before the end"] == "The salt is public since Friday."
    verify(layout)


def test_a_trial_without_commitment_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="not committed"):
        verify(Layout(tmp_path))
