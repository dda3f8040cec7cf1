"""Running: one file an answer, nothing lost, nothing done twice; reading what a recording holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording_file import sha256_of
from bondgraph.support.errors import UnusableInput
from tests.proof.exam.__main__ import main as exam
from tests.proof.exam.answering import exam_answer
from tests.proof.exam.said import read_exam_answers
from tests.proof.tests.exam.made_up import truth
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import recording_of, require_own, run_all
from tests.proof.trial.truths import Public, read_public

PUBLIC = tuple(Public(f"r{i}", "probe", ("x",)) for i in range(5))
seen: list[str] = []
stop_at = [3]


def pretend(layout: Layout, public: Public, seed: int) -> dict[str, Any]:
    """Stand for the diagnosis; interrupted at the third recording, as by a keyboard."""
    seen.append(public.id)
    if len(seen) == stop_at[0]:
        raise KeyboardInterrupt
    return {"id": public.id, "verdict": {"verdict": "explained", "findings": []}, "seed": seed}


@pytest.fixture
def layout(tmp_path: Path) -> Layout:
    found = Layout(tmp_path / "trial")
    found.recordings.mkdir(parents=True)
    t = np.arange(300) * 2e-3
    for p in PUBLIC:
        file = found.recordings / f"{p.id}.npz"
        np.savez(file, time=t, F=np.sin(9 * t), x=np.cos(9 * t), v_f=t, plant="probe")
    return found


def test_an_interrupted_run_goes_on_where_it_stopped(layout: Layout) -> None:
    seen.clear()
    stop_at[0] = 3
    with pytest.raises(KeyboardInterrupt):
        run_all(layout, PUBLIC, layout.answers, pretend, jobs=1)
    kept = {p.name: p.stat().st_mtime_ns for p in layout.answers.iterdir()}
    assert len(kept) == 2
    stop_at[0] = 0
    seen.clear()
    told: list[tuple[str, float]] = []
    done = run_all(
        layout, PUBLIC, layout.answers, pretend, jobs=1, seed=7,
        progress=lambda text, part: told.append((text, part)),
    )  # fmt: skip
    assert done == 3
    assert len(seen) == 3
    assert not {f"{n}.json" for n in seen} & kept.keys()
    for name, when in kept.items():
        assert (layout.answers / name).stat().st_mtime_ns == when
    assert [round(part, 6) for _, part in told] == [0.6, 0.8, 1.0]
    assert set(read_exam_answers(layout.answers)) == {p.id for p in PUBLIC}
    assert run_all(layout, PUBLIC, layout.answers, pretend, jobs=1) == 0


def test_answers_of_an_older_draw_are_refused(
    layout: Layout, capsys: pytest.CaptureFixture[str]
) -> None:
    file = layout.recordings / "r1.npz"
    told = {"verdict": "explained", "findings": [], "recording": {"sha256": sha256_of(file)}}
    layout.answers.mkdir(parents=True)
    answer = layout.answers / "r1.json"
    answer.write_text(json.dumps({"id": "r1", "verdict": told}), encoding="utf-8")
    stop_at[0] = 0
    assert run_all(layout, PUBLIC, layout.answers, pretend, jobs=1) == 4
    np.savez(file, time=np.arange(300.0), F=np.ones(300), x=np.ones(300))
    with pytest.raises(UnusableInput, match=r"r1\.json: the answer to another recording"):
        run_all(layout, PUBLIC, layout.answers, pretend, jobs=1)
    rows = [truth("control") | {"id": p.id} for p in PUBLIC]
    layout.truths.parent.mkdir()
    layout.truths.write_text(json.dumps(rows), encoding="utf-8")
    for step in ("score", "certify"):
        assert exam([step, "--folder", str(layout.folder)]) == 2
        said = capsys.readouterr().err
        assert "of an older draw" in said
        assert said.count("\n") == 1
    # of a trial the commitment says what the recordings are, though they are no longer there
    sealed = {"data_sha256": {"r1.npz": "0" * 64}}
    layout.commitment.write_text(json.dumps(sealed), encoding="utf-8")
    file.unlink()
    with pytest.raises(UnusableInput, match="of an older draw"):
        require_own(layout, layout.answers)


def test_a_missing_recording_is_refused_before_anything_runs(layout: Layout) -> None:
    seen.clear()
    (layout.recordings / "r4.npz").unlink()
    with pytest.raises(UnusableInput, match="r4 is not there"):
        run_all(layout, PUBLIC, layout.answers, pretend, jobs=1)
    assert not seen


def test_a_recording_shows_the_command_and_its_sensors_only(layout: Layout) -> None:
    recording = recording_of(layout, PUBLIC[0])
    assert dict(recording.units) == {"F": "N", "x": "m"}
    assert recording.n == 300
    assert recording.fs == pytest.approx(500.0)
    assert len(recording.sha256) == 64


def test_what_stops_the_diagnosis_is_an_answer(layout: Layout) -> None:
    (layout.recordings / "r1.npz").write_bytes(b"no archive")
    found = exam_answer(layout, PUBLIC[1])
    assert found["verdict"] is None
    assert found["error"]
    assert found["seconds"] >= 0
    # a refusal in one line as well
    found = exam_answer(layout, Public("r0", "nowhere", ("x",)))
    assert "nowhere" in found["error"]
    assert "\n" not in found["error"]


def test_a_constant_recording_is_answered(layout: Layout) -> None:
    flat = np.zeros(300)
    np.savez(layout.recordings / "r2.npz", time=np.arange(300) * 2e-3, F=flat, x=flat)
    found = exam_answer(layout, PUBLIC[2])
    assert found["error"] is None
    assert found["verdict"]["verdict"] == "insufficient_data"
    assert found["evidence"] == []
    assert found["nominal_rms"] is None
    json.dumps(found, allow_nan=False)


def test_damaged_lists_and_answers_are_named(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="no trial here"):
        read_public(tmp_path / "public.json")
    (tmp_path / "public.json").write_text('{"recordings": [{"id": "r0"}]}', encoding="utf-8")
    with pytest.raises(UnusableInput, match="no list of recordings"):
        read_public(tmp_path / "public.json")
    (tmp_path / "public.json").unlink()
    (tmp_path / "r0.json").write_text("{", encoding="utf-8")
    with pytest.raises(UnusableInput, match=r"r0\.json: no answer"):
        read_exam_answers(tmp_path)
