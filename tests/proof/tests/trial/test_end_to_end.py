"""A sealed trial from end to end, small: made, sealed, run, opened, scored; by dask as well."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import joblib
import pytest

from bondsight.cli.main import main
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.making_exam import exam_record
from tests.proof.exam.answering import exam_answer
from tests.proof.exam.cells import draw_exam
from tests.proof.exam.said import read_exam_answers
from tests.proof.trial import generating
from tests.proof.trial.commitment import commit, verify
from tests.proof.trial.generating import make_all
from tests.proof.trial.layout import Layout
from tests.proof.trial.oracles import read_oracles
from tests.proof.trial.running import run_all
from tests.proof.trial.truths import read_public


def two(kind: str = "", salt: str = "") -> list[DrawnCase]:
    """Return the shortest control and the shortest single effect that has few readings."""
    drawn = sorted(draw_exam(11, 120), key=lambda c: c.samples)
    single = next(c for c in drawn if c.cell == "form" and len(c.sensors) == 1)
    return [next(c for c in drawn if c.cell == "control"), single]


@pytest.fixture(scope="module")
def layout(tmp_path_factory: pytest.TempPathFactory) -> Layout:
    found = Layout(tmp_path_factory.mktemp("small") / "trial")
    truths = make_all(two(), found, exam_record, 1, None)
    commit(found, truths, "salt of a test", "development")
    verify(found)
    assert main(["blind", "run", "--folder", str(found.folder), "--jobs", "1"]) == 0
    return found


def content(path: Path) -> dict[str, Any]:
    """Return an answer without what it cost."""
    kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    kept["verdict"].pop("seconds")
    kept["baselines"].pop("cpu_seconds")
    return {k: v for k, v in kept.items() if "seconds" not in k}


def test_opened_and_scored(layout: Layout, capsys: pytest.CaptureFixture[str]) -> None:
    # two recordings certify nothing: the command says so by its status
    assert main(["blind", "score", "--folder", str(layout.folder), "--jobs", "1"]) == 1
    said = capsys.readouterr().out
    assert "false alarms, of the controls: 0/1" in said
    assert "none seen          called explained, of those where an effect shows: 0/1" in said
    assert "Open until bondsight blind withheld has counted it" in said
    data = json.loads((layout.score / "score.json").read_text(encoding="utf-8"))
    assert [r["wrong"] for r in data["each"]] == [[], []]
    assert len(read_oracles(layout)) == 1
    for path in layout.oracle.iterdir():
        reached = json.loads(path.read_text(encoding="utf-8"))
        assert reached["error"] is None
        assert reached["rms"]
    # told the truth, a fit leaves the noise
    (single,) = (r for r in data["each"] if r["cell"] == "form")
    assert single["oracle_over_noise"] == pytest.approx(1.0, abs=0.3)
    assert single["error_over_oracle"] == pytest.approx(1.0, abs=0.1)
    assert (layout.score / "report.html").is_file()
    # nothing is left to be done
    assert main(["blind", "run", "--folder", str(layout.folder), "--jobs", "1"]) == 0
    assert "0 recordings diagnosed, 2 were there" in capsys.readouterr().out


@pytest.mark.long
def test_without_the_true_law(layout: Layout, capsys: pytest.CaptureFixture[str]) -> None:
    # one recording certifies nothing, whatever was said of it
    assert main(["blind", "withheld", "--folder", str(layout.folder), "--jobs", "1"]) == 1
    said = capsys.readouterr().out
    assert "another name than the true one, of the withheld laws: " in said
    answers = [json.loads(p.read_text(encoding="utf-8")) for p in layout.withheld.iterdir()]
    assert len(answers) == 1
    assert f"/{len(answers)}  " in said
    for answer in answers:
        named = {f["effect"] for f in answer["verdict"]["findings"]}
        assert answer["without"]
        assert not named & set(answer["without"])


def test_a_quick_trial_in_one_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(generating, "draw_trial", lambda kind, salt, count: two()[:1])
    folder = tmp_path / "quick"
    assert main(["blind", "quick", "--folder", str(folder), "--jobs", "1"]) == 0
    said = capsys.readouterr().out
    assert "false alarms, of the controls: 0/1" in said
    assert json.loads((folder / "commitment.json").read_text())["kind"] == "quick"
    assert (folder / "revealed.json").is_file()


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_dask_gives_the_same_answers(layout: Layout, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    public = read_public(layout.public)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
            host="127.0.0.1", silence_logs=50,
        ) as cluster,
        distributed.Client(cluster),
        joblib.parallel_config(backend="dask"),
    ):  # fmt: skip
        assert run_all(layout, public, tmp_path, exam_answer, jobs=2) == 2
    assert set(read_exam_answers(tmp_path)) == {p.id for p in public}
    for p in public:
        assert content(tmp_path / f"{p.id}.json") == content(layout.answers / f"{p.id}.json")


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_ray_gives_the_same_answers(layout: Layout, tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    pytest.importorskip("ray.util.joblib").register_ray()
    public = read_public(layout.public)
    ray.init(num_cpus=2, include_dashboard=False, logging_level="ERROR")
    try:
        with joblib.parallel_config(backend="ray"):
            assert run_all(layout, public, tmp_path, exam_answer, jobs=2) == 2
    finally:
        ray.shutdown()
    for p in public:
        assert content(tmp_path / f"{p.id}.json") == content(layout.answers / f"{p.id}.json")
