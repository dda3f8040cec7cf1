"""The stand-alone scorer beside ours, and what an entrant gets."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from actuators.models.plants import plant_model
from bondgraph.export.graph_json.read_graph import from_json
from hardware.simulators.generator.families import FAMILIES, FAMILY_OF
from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.truths import truth_of
from tests.proof.benchmark import scorer
from tests.proof.benchmark.__main__ import main
from tests.proof.benchmark.converting import entry_of
from tests.proof.benchmark.exporting import HERE, open_truths, truth_row
from tests.proof.exam.counting import score_exam, stated
from tests.proof.exam.generating import generate_exam
from tests.proof.trial.layout import Layout
from tests.proof.trial.rates import Rate
from tests.proof.trial.running import recording_of
from tests.proof.trial.truths import read_public

EFFECTS = ("backlash", "coulomb_friction", "stribeck_friction", "creep")
KINDS = ("restoring", "dissipative", "slow")
PLACES = ("k_1", "k_2", "b_1")
CELLS = ("control", "single", "outside", "two", "three", "weak_further", "mixed_up")
PORTS = [*PLACES, "m_1", "m_2", "F", "x_1", "x_2"]
NOISE = {"x_1": 1e-6, "x_2": 2e-6}


def drawn_truth(rng: np.random.Generator, name: str) -> dict[str, Any]:
    cell = str(rng.choice(CELLS))
    count = {"control": 0, "two": 2, "three": 3, "weak_further": 2}.get(cell, 1)

    def effect() -> dict[str, Any]:
        called = [] if cell == "outside" else [*rng.choice(EFFECTS, rng.integers(1, 3), False)]
        moved = float(rng.choice([0.5, 2.0, 8.0, 30.0])) * float(rng.uniform(0.9, 1.1))
        return {
            "effect": called[0] if called else "unknown", "names": called,
            "family": FAMILY_OF[called[0]] if called else "outside", "law": "law",
            "kinds": [*rng.choice(KINDS, rng.integers(1, 3), False)],
            "places": [*rng.choice(PLACES, rng.integers(1, 3), False)],
            "moved": {"x_1": moved, "x_2": 0.1},
        }  # fmt: skip

    effects = [effect() for _ in range(count)]
    moved = max((e["moved"]["x_1"] for e in effects), default=0.0)
    return {
        "id": name, "cell": cell, "plant": "chain", "effects": effects, "noise_std": NOISE,
        "moved": {"x_1": moved, "x_2": 0.1 * moved},
    }  # fmt: skip


def drawn_content(rng: np.random.Generator, truth: dict[str, Any]) -> dict[str, Any]:
    """Answer at random; half of its findings are what is true."""

    def finding() -> dict[str, Any]:
        if truth["effects"] and rng.uniform() < 0.5:
            e = truth["effects"][rng.integers(len(truth["effects"]))]
            name = e["names"][0] if e["names"] else "creep"
            return {
                "answer": "exact", "effect": name, "family": FAMILY_OF[name], "kind": e["kinds"][0],
                "probability": 0.9, "location": {"element": e["places"][0]},
            }  # fmt: skip
        answer = str(rng.choice(scorer.ANSWERS))
        effect = str(rng.choice(EFFECTS)) if answer in scorer.NAMES else "unknown"
        same = [*rng.choice(PORTS, rng.choice([0, 1, 5]), False)]
        return {
            "answer": answer, "effect": effect, "kind": str(rng.choice([*KINDS, ""])),
            "family": FAMILY_OF.get(effect, "") if effect != "unknown" else "friction",
            "probability": float(rng.uniform()) if answer in scorer.NAMES[:2] else None,
            "location": {
                "element": str(rng.choice(PLACES)), "indistinguishable_from": same
            } if rng.uniform() < 0.8 else {},
            "also_possible": [
                {"effect": str(e), "element": str(rng.choice(PLACES))}
                for e in rng.choice(EFFECTS, rng.integers(0, 3), False)
            ],
        }  # fmt: skip

    verdict = str(
        rng.choice(["missing_physics"] * 4 + ["unknown_physics", "explained", "insufficient_data"])
    )
    findings = [finding() for _ in range(rng.integers(1, 4))] if "physics" in verdict else []
    over = float(rng.choice([0.1, 0.5, 2.0, 5.0]))
    content: dict[str, Any] = {
        "id": truth["id"], "ports": PORTS, "error": None,
        "verdict": {
            "verdict": verdict, "findings": findings,
            "advice": ["correct the recording and diagnose again"] * (rng.uniform() < 0.2),
        },
        "nominal_rms": {"x_1": 1e-6, "x_2": 2e-6 * np.hypot(1, over)},
        "evidence": [{
            "floors": NOISE,
            "laws": [
                {"effect": e, "element": str(rng.choice(PLACES)), "simpler": [],
                 "kind": str(rng.choice(KINDS))} for e in EFFECTS
            ],
            # of the model as it is and of four laws, in eight stretches of two readings
            "stretches": (1 + rng.choice([0.0, 3.0], (5, 1, 1), p=[0.2, 0.8])
                          + 0.1 * rng.uniform(size=(5, 8, 2))).tolist(),
        }],
    }  # fmt: skip
    if rng.uniform() < 0.05:
        content |= {"verdict": None, "error": "boom", "nominal_rms": None}
    return content


@pytest.fixture(scope="module")
def drawn() -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    rng = np.random.default_rng(11)
    names = [f"e{i:03d}" for i in range(600)]
    truths = [drawn_truth(rng, n) for n in names]
    return truths, [drawn_content(rng, t) for t in truths]


def plain(value: Any) -> Any:
    """Return what a reader of the file would get."""
    return json.loads(json.dumps(value, allow_nan=False))


def test_the_same_counts_as_ours(drawn: tuple[list[dict[str, Any]], list[dict[str, Any]]]) -> None:
    truths = {str(r["id"]): truth_of(r) for r in drawn[0]}
    answers = {str(c["id"]): exam_answer_of(c) for c in drawn[1]}
    ours = score_exam(truths, answers)
    rows = [truth_row(truths[i], len(PORTS), answers[i]) for i in truths]
    opened = plain({"families": {k: list(v) for k, v in FAMILIES.items()}, "recordings": rows})
    outcomes = scorer.judge(opened, [plain(entry_of(c)) for c in drawn[1]])
    counts = scorer.count(outcomes)
    assert counts == {name: (r.hits, r.total) for name, r in ours.rates.items()}
    assert scorer.cells(outcomes) == ours.cells
    # none of them is trivially the same
    assert {k: v for k, v in counts.items() if not 0 < v[0] < v[1]} == {}
    points = stated(ours.outcomes)
    score, names = scorer.log_score(outcomes)
    assert names == len(points)
    assert np.isclose(score, np.mean([np.log(max(p if ok else 1 - p, 1e-12)) for p, ok in points]))


def test_every_entry_of_ours_fits_the_schema(
    drawn: tuple[list[dict[str, Any]], list[dict[str, Any]]],
) -> None:
    schema = json.loads((HERE / "answer.schema.json").read_text())
    check = jsonschema.Draft202012Validator(schema)
    assert all(check.is_valid(plain(entry_of(c))) for c in drawn[1])
    example = (HERE / "ENTER.md").read_text().split("    {", 1)[1].split("\n\n")[0]
    assert check.is_valid(json.loads("{" + example))
    assert not check.is_valid({"id": "e0", "alarm": "yes"})
    assert not check.is_valid({"id": "e0", "alarm": True, "findings": [{"name": "creep"}]})


@pytest.mark.parametrize(
    ("row", "answer"),
    [
        ({"names": ["creep"], "kind": "slow"}, "exact"),
        ({"names": ["creep"], "answer": "approximate"}, "approximate"),
        ({"names": ["creep", "hysteresis"]}, "look_alikes"),
        ({"family": "friction", "kind": "dissipative"}, "family"),
        ({"kind": "slow", "places": ["k_1"]}, "kind"),
        ({"places": ["k_1"]}, "unknown"),
    ],
)
def test_what_is_claimed_follows_from_what_is_said(row: dict[str, Any], answer: str) -> None:
    assert scorer.finding_of(row)["answer"] == answer


@pytest.mark.parametrize(("hits", "total"), [(0, 7), (1, 300), (12, 40), (39, 40), (5, 5), (0, 0)])
def test_interval_is_the_exact_one(hits: int, total: int) -> None:
    assert scorer.interval(hits, total) == pytest.approx(Rate(hits, total).exact, abs=1e-9)


def test_scorer_imports_numpy_and_the_standard_library_only() -> None:
    tree = ast.parse((HERE / "scorer.py").read_text())
    modules = {
        (n.module if isinstance(n, ast.ImportFrom) else n.names[0].name).split(".")[0]  # type: ignore[union-attr]
        for n in ast.walk(tree)
        if isinstance(n, ast.Import | ast.ImportFrom)
    }
    assert modules - {"numpy"} <= set(sys.stdlib_module_names)


TRUTHS = {
    "families": {"memory": ["creep"], "friction": ["coulomb_friction"]},
    "recordings": [
        {
            **truth_row(truth_of({
                "id": "e0", "cell": "single", "plant": "chain", "noise_std": NOISE,
                "moved": {"x_1": 9.0},
                "effects": [{
                    "effect": "creep", "names": ["creep"], "family": "memory", "law": "creep",
                    "kinds": ["slow"], "places": ["k_1"], "moved": {"x_1": 9.0},
                }],
            }), 8, None)
        }
    ],
}  # fmt: skip
RIGHT = {"id": "e0", "alarm": True, "findings": [{"names": ["creep"], "places": ["k_1"]}]}


def test_scorer_stands_alone(tmp_path: Path) -> None:
    shutil.copyfile(HERE / "scorer.py", tmp_path / "scorer.py")
    (tmp_path / "truths.json").write_text(json.dumps(TRUTHS))
    (tmp_path / "e0.csv").write_text("time [s],x_1 [m]\n0,1e-6\n1,3e-6\n")
    made = {**RIGHT, "prediction": {"x_1": [0.0, 4e-6]}}
    (tmp_path / "answers.jsonl").write_text(json.dumps(made) + "\n")
    words = ["scorer.py", "truths.json", "answers.jsonl", "--recordings", "."]
    done = subprocess.run(
        [sys.executable, "-I", *words], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "sharp: right name at the right place" in done.stdout
    assert "1/1  100.0 % (2.5-100.0)" in done.stdout
    # both samples are off by the noise
    assert done.stdout.splitlines()[-1].split()[-1] == "1"


@pytest.mark.parametrize(
    ("answers", "line"),
    [
        ([{**RIGHT, "findings": [{"names": ["crep"]}]}], "no effect is called 'crep'; near: creep"),
        ([RIGHT, RIGHT], "e0: answered twice"),
        ([{**RIGHT, "alarm": "yes"}], "alarm is true, false or null, not 'yes'"),
        ([{**RIGHT, "findings": [{"answer": "sure"}]}], "answer 'sure' is none of exact"),
        ([{"alarm": True}], "there is no 'id'"),
    ],
)
def test_bad_entries_end_in_a_line(
    answers: list[Any], line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "t.json").write_text(json.dumps(TRUTHS))
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, answers)))
    words = ["--truths", str(tmp_path / "t.json"), "--answers", str(tmp_path / "a.jsonl")]
    assert main(["score", *words]) == 2
    said = capsys.readouterr().err
    assert line in said
    assert said.count("\n") == 1


def test_curves_of_what_our_answers_keep(
    drawn: tuple[list[dict[str, Any]], list[dict[str, Any]]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    answers, truths = tmp_path / "answers", tmp_path / "truths.json"
    answers.mkdir()
    truths.write_text(json.dumps(drawn[0][:40]))
    for c in drawn[1][:40]:
        kept = {"trials": [], "plain": {}, "sparse": {"STLSQ": [["creep", "k_1", 0.5]]}}
        bare = {**c, "evidence": [], "baselines": kept}
        (answers / f"{c['id']}.json").write_text(json.dumps(plain(bare)))
    words = ["--truths", str(truths), "--answers", str(answers)]
    assert main(["curves", *words, "--out", str(tmp_path / "curves.svg")]) == 0
    assert "| sparse regression, STLSQ | " in capsys.readouterr().out
    assert "<svg" in (tmp_path / "curves.svg").read_text()


def test_what_an_entrant_gets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    layout, out = Layout(tmp_path / "exam"), tmp_path / "out"
    generate_exam(layout, count=2, seed=5, jobs=1)
    assert main(["export", "--folder", str(layout.folder), "--out", str(out)]) == 0
    assert not (out / "truths.json").exists()  # it stays closed
    public = read_public(layout.public)
    asked = json.loads((out / "recordings.json").read_text())["recordings"]
    for p, row in zip(public, asked, strict=True):
        recording = recording_of(layout, p)
        path = out / "recordings" / f"{p.id}.csv"
        heads = path.read_text().splitlines()[0].split(",")
        assert heads[0] == "time [s]"
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        for k, head in enumerate(heads[1:], start=1):
            name, unit = head.rstrip("]").split(" [")
            assert unit == recording.units[name]
            assert table[:, k] == pytest.approx(recording[name], rel=1e-9)
        assert set(p.sensors) <= set(row["elements"])
        model = out / "models" / f"{p.plant}.json"
        assert from_json(model).elements.keys() == plant_model(p.plant).elements.keys()
        assert "/dt := " in model.with_suffix(".txt").read_text()
        assert (out / "models" / f"{p.plant}.fmu").stat().st_size > 10_000
    told = json.loads((out / "vocabulary.json").read_text())
    assert set(told["effects"]) == set(FAMILY_OF) - {"unknown"}
    truths = {t["id"]: truth_of(t) for t in json.loads(layout.truths.read_text())}
    opened = open_truths(truths, public, {})
    assert [t["ports"] for t in opened["recordings"]] == [len(r["elements"]) for r in asked]
    (tmp_path / "revealed.json").write_text(
        json.dumps({"salt": "ab", "truths": json.loads(layout.truths.read_text())})
    )
    again = ["--folder", str(layout.folder), "--out", str(out)]
    assert main(["export", *again, "--truths", str(tmp_path / "revealed.json")]) == 0
    assert json.loads((out / "truths.json").read_text()) == plain(opened)
    assert main(["export", *again, "--truths", str(tmp_path / "none.json")]) == 2
    answers = tmp_path / "answers"
    answers.mkdir()
    said = {"id": public[0].id, "verdict": {"verdict": "explained", "findings": []}}
    (answers / "a.json").write_text(json.dumps(said))
    entry = tmp_path / "ours.jsonl"
    assert main(["convert", "--answers", str(answers), "--out", str(entry)]) == 0
    capsys.readouterr()
    assert main(["score", "--truths", str(out / "truths.json"), "--answers", str(entry)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].split() == ["not", "answered", "1"]
