"""Drawing a trial: sealed, resumable, nothing of the truth in what is public; the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from bondsight.cli.main import main
from hardware.simulators.generator.parameters import ALL_PLANTS as PLANTS
from hardware.simulators.judging.truths import truth_of
from tests.proof.trial import generating
from tests.proof.trial.commitment import truths_hash, verify
from tests.proof.trial.design import draw_trial
from tests.proof.trial.generating import generate_trial
from tests.proof.trial.layout import Layout
from tests.proof.trial.running import graph_of, recording_of
from tests.proof.trial.truths import read_public


@pytest.fixture(scope="module")
def layout(tmp_path_factory: pytest.TempPathFactory) -> Layout:
    found = Layout(tmp_path_factory.mktemp("drawn") / "trial")
    assert generate_trial(found, "development", count=6, seed=3, jobs=1) == 6
    return found


def test_the_public_list_fits_the_recordings(layout: Layout) -> None:
    verify(layout)
    for public in read_public(layout.public):
        recording = recording_of(layout, public)
        graph = graph_of(public)
        assert graph.check() == ()
        assert 2000 <= recording.n <= 20000
        assert 1 / recording.fs == pytest.approx(PLANTS[public.plant].step)
        assert set(recording.channels) == {PLANTS[public.plant].source[0], *public.sensors}
        assert public.hold in ("hold", "linear")
        assert set(recording.meta["resolution"]) <= set(public.sensors)


def test_nothing_public_tells_the_truth(layout: Layout) -> None:
    rows = json.loads(layout.truths.read_text(encoding="utf-8"))
    truths = {t.id: t for t in map(truth_of, rows)}
    assert len(truths) == 6
    committed = json.loads(layout.commitment.read_text(encoding="utf-8"))
    salt = layout.salt.read_text(encoding="ascii").strip()
    assert committed["truths_sha256"] == truths_hash(salt, rows)
    shown = layout.public.read_text(encoding="utf-8") + json.dumps(committed)
    for truth in truths.values():
        for effect in truth.effects:
            if effect.effect != "unknown":
                assert effect.effect not in shown.replace('"delay": ', "")
            assert effect.law not in shown
    for path in layout.recordings.iterdir():
        with np.load(path, allow_pickle=False) as file:
            extra = set(file.files) - {"time", "plant", "hold"}
            plant = PLANTS[str(file["plant"])]
        declared = {"declared_delay", "declared_resolution"}
        assert extra - declared <= {plant.source[0], *plant.sensors}


def test_a_seal_cannot_be_drawn_twice(layout: Layout) -> None:
    with pytest.raises(UnusableInput, match="committed already"):
        generate_trial(layout, "development", count=6, seed=4, jobs=1)


def test_an_interrupted_draw_goes_on_with_its_salt(layout: Layout) -> None:
    first = json.loads(layout.commitment.read_text(encoding="utf-8"))
    layout.commitment.unlink()
    layout.truths.unlink()
    victim = next(layout.recordings.iterdir())
    victim.unlink()
    with pytest.raises(UnusableInput, match="a development trial of seed 3 was begun here"):
        generate_trial(layout, "development", count=6, seed=99, jobs=1)
    with pytest.raises(UnusableInput, match="a development trial of seed 3 was begun here"):
        generate_trial(layout, "quick", jobs=1)
    assert not layout.commitment.exists()
    generate_trial(layout, "development", count=6, seed=3, jobs=1)
    second = json.loads(layout.commitment.read_text(encoding="utf-8"))
    assert second["truths_sha256"] == first["truths_sha256"]
    assert second["data_sha256"] == first["data_sha256"]


def test_a_sealed_salt_is_of_one_kind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    layout = Layout(tmp_path / "trial")
    monkeypatch.setattr(generating, "draw_trial", lambda kind, salt, count: [])
    generate_trial(layout, "quick", jobs=1)
    layout.commitment.unlink()
    for kind in ("trial", "development"):
        with pytest.raises(UnusableInput, match="a quick trial was begun here"):
            generate_trial(layout, kind, jobs=1)
    layout.drawn.unlink()  # a salt that was brought from another machine
    with pytest.raises(UnusableInput, match="a sealed trial was begun here"):
        generate_trial(layout, "development", jobs=1)
    assert generate_trial(layout, "trial", jobs=1) == 0


def test_the_same_salt_draws_the_same_cases() -> None:
    sixty = draw_trial("quick", "ab" * 32)
    assert sixty == draw_trial("quick", "ab" * 32)
    assert len(sixty) == 60
    assert not {c.seed for c in sixty} & {c.seed for c in draw_trial("quick", "ac" * 32)}
    # a trial and its rehearsal never meet, whatever their salts are
    assert not {c.seed for c in sixty} & {c.seed for c in draw_trial("development", "ab" * 32)}


@pytest.mark.parametrize("kind", ["trial", "quick"])
def test_a_trial_takes_neither_seed_nor_count(tmp_path: Path, kind: str) -> None:
    layout = Layout(tmp_path / "trial")
    with pytest.raises(UnusableInput, match="operating system"):
        generate_trial(layout, kind, seed=1)
    with pytest.raises(UnusableInput, match="operating system"):
        generate_trial(layout, kind, count=3)
    with pytest.raises(UnusableInput, match="no kind of trial"):
        generate_trial(layout, "final")
    assert not layout.data.exists()


def test_a_trial_has_a_design_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generating, "DESIGN", tmp_path / "DESIGN.md")
    with pytest.raises(UnusableInput, match="a trial has a design first"):
        generate_trial(Layout(tmp_path / "trial"), "trial")
    assert not (tmp_path / "trial-data").exists()


def test_the_command_refuses_steps_out_of_order(
    layout: Layout, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["blind", "run", "--folder", str(tmp_path / "none")]) == 2
    assert "bondsight blind generate" in capsys.readouterr().err
    assert main(["blind", "score", "--folder", str(layout.folder)]) == 2
    said = capsys.readouterr().err
    assert "6 of 6 recordings have no answer" in said
    assert said.count("\n") == 1
    assert main(["blind", "withheld", "--folder", str(layout.folder)]) == 2
    assert not layout.revealed.exists()
