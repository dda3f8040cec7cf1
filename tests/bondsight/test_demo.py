"""The sealed demonstration: committed first, judged after the verdict."""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from actuators.models.catalogue import stack_on_bench
from actuators.models.plants import plant_model
from bondgraph import BondGraph, UnusableInput
from bondsight.cli import judged as module
from bondsight.cli.demonstration import Wish, begun
from bondsight.cli.demonstration import conceal as conceal_in_plant
from bondsight.cli.judged import (
    Outcome,
    describe,
    judge,
    summary,
)
from bondsight.cli.main import main
from hardware.simulators.generator.accepted import KINDS
from hardware.simulators.generator.native import _library
from hardware.simulators.generator.showing import SHOWN, draw_shown, effects_of
from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth, truth_of
from hardware.simulators.plants import conceal
from hardware.simulators.plants.stack import effects as bench_effects
from identification.diagnosis.catalogue import CATALOGUE

FEW = (
    "quadratic_drag", "coulomb_friction", "asymmetric_damping", "square_root_flow",
    "nonlinear_resistance", "leakage", "saturation", "delay",
)  # fmt: skip
"""Effects that the cheaper demonstration may name."""


def played(words: Sequence[str], effect: str, out: Path, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["demo", "--effect", effect, *words, "--out", str(out)]) == 0
    captured = capsys.readouterr()
    # on a busy machine a line of progress every half minute
    assert all(re.match(r"\d+ s: ", line) for line in captured.err.splitlines())
    text = captured.out
    sealed = re.search(r"truth sealed: +sha256 [0-9a-f]{64}", text)
    assert sealed is not None
    assert sealed.start() < text.index("held-out error") < text.index("seal opened:")
    assert effect not in text[: text.index("recording:")]
    written = {p.name for p in out.iterdir()} - {"repaired.json", "next.csv"}  # where they exist
    assert written == {"recording.csv", "report.html", "verdict.json"}
    return text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plant", "effect", "place"),
    [
        pytest.param("cylinder", "quadratic_drag", "b", marks=pytest.mark.long),
        ("tanks", "square_root_flow", "R_"),
    ],
)
def test_what_is_concealed_in_a_plant_is_found(
    plant: str,
    effect: str,
    place: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    few = [e for e in CATALOGUE if e.name in FEW]
    monkeypatch.setattr("identification.diagnosis.search.candidates.CATALOGUE", tuple(few))
    text = played(("--plant", plant, "--seed", "11"), effect, tmp_path, capsys)
    assert text.startswith(SHOWN[plant])
    assert f"--model {plant}" in text
    assert "the verdict is: right" in text
    v = json.loads((tmp_path / "verdict.json").read_text(encoding="utf-8"))
    assert v["verdict"] == "missing_physics"
    assert v["findings"][0]["effect"] == effect
    assert v["findings"][0]["location"]["element"].startswith(place)
    header = (tmp_path / "recording.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert all(re.fullmatch(r"t_s|\w+\[\S+\]", column) for column in header.split(","))


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = played(("--seed", "12"), "none", tmp_path, capsys)
    assert "nothing was concealed" in text
    assert "the verdict is: right" in text
    v = json.loads((tmp_path / "verdict.json").read_text(encoding="utf-8"))
    assert v["findings"] == []


def test_the_demo_and_the_catalogue_share_their_names() -> None:
    assert set(effects_of()) - {"none"} <= {e.name for e in CATALOGUE}
    for plant in SHOWN:
        assert plant_model(plant).check() == ()


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", bench_effects()[1:])
def test_every_truth_of_the_stack_bench_has_its_kind_and_place(name: str) -> None:
    graph, (effect,) = stack_on_bench(), drawn(name).effects
    assert effect.kinds <= set(KINDS)
    assert effect.kinds
    assert name in effect.names
    assert effect.places <= graph.elements.keys()
    assert describe(drawn(name)).startswith(f"{name} at {min(effect.places)}, ")


def test_without_gcc_it_is_said_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _library.cache_clear()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["demo", "--seed", "1", "--out", str(tmp_path)]) == 2
    assert "demo: no gcc found" in capsys.readouterr().err


@pytest.mark.long
def test_without_gcc_and_wishes_a_recording_that_was_made_beforehand_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["demo", "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert "Made beforehand" in text.splitlines()[0]
    assert "the verdict is: right" in text


@pytest.mark.parametrize("broken", [False, True])
def test_what_was_made_beforehand_is_written_and_sealed(
    broken: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Without gcc, and with one that cannot compile."""
    if broken:
        gcc = tmp_path / "gcc"
        gcc.write_text("#!/bin/sh\necho no headers >&2\nexit 1\n", encoding="utf-8")
        gcc.chmod(0o755)
    _library.cache_clear()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", str(tmp_path))
    made = begun(None, Wish(), tmp_path / "recording.csv")
    said = capsys.readouterr().out
    assert "Made beforehand" in said
    assert ("no headers" if broken else "no gcc found") in said
    assert made.path.read_text(encoding="utf-8").count("\n") > 2000
    assert made.sealed.truth()["plant"] == made.plant == "tanks"
    with pytest.raises(UnusableInput, match="without --seed"):
        begun(1, Wish(), tmp_path / "other.csv")


def test_a_draw_without_a_seed_conceals_something(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    draws = [bool(draw_shown(seed, "stack").effects) for seed in (4, 5, 1)]
    assert draws == [False, False, True]
    seeds = iter((4, 5, 1))
    monkeypatch.setattr(secrets, "randbits", lambda bits: next(seeds))
    made = begun(None, Wish("stack"), tmp_path / "recording.csv")
    assert made.seed == 1
    assert made.sealed.truth()["effects"]


def test_what_nobody_asked_for_is_one_case_that_teaches(tmp_path: Path) -> None:
    made = begun(None, Wish(), tmp_path / "recording.csv")
    (hidden,) = made.sealed.truth()["effects"]
    assert (made.plant, hidden["effect"]) == ("stack", "hysteresis")
    again = conceal_in_plant(made.seed, Wish(*made.again.split()[1::2]), tmp_path / "again.csv")
    assert again.sealed.truth() == made.sealed.truth()
    assert (tmp_path / "again.csv").read_bytes() == made.path.read_bytes()


def drawn(effect: str) -> ExamTruth:
    """What the device bench conceals, as its seal tells it."""
    return truth_of(conceal(3, effect).truth)


# -- judge ------------------------------------------------------------------------------------
def judged(
    monkeypatch: pytest.MonkeyPatch, truth: ExamTruth, graph: BondGraph, kind: str, answer: str,
    named: str = "", place: str = "", same: tuple[str, ...] = (),
    possible: tuple[tuple[str, str], ...] = (),
) -> Outcome:  # fmt: skip
    findings = [
        {
            "answer": answer, "effect": named, "confidence": 0.9,
            "location": {"element": place, "indistinguishable_from": list(same)},
            "also_possible": [{"effect": e, "element": p} for e, p in possible],
        }
    ] if kind in ("missing_physics", "unknown_physics") else []  # fmt: skip
    monkeypatch.setattr(module, "verdict", lambda _: {"verdict": kind, "findings": findings})
    d: Any = SimpleNamespace(nominal=None, repaired=None, seconds=1.0, graph=graph)
    return judge(truth, d)


def on_bench(monkeypatch: pytest.MonkeyPatch, hidden: str, *said: Any, **more: Any) -> Outcome:
    return judged(monkeypatch, drawn(hidden), stack_on_bench(), *said, **more)


@pytest.mark.parametrize(
    ("hidden", "kind", "answer", "named", "place", "result"),
    [
        ("quadratic_drag", "missing_physics", "exact", "quadratic_drag", "b", "right"),
        ("quadratic_drag", "missing_physics", "exact", "quadratic_drag", "k", "wrong"),
        ("quadratic_drag", "missing_physics", "exact", "creep", "C_a", "wrong"),
        ("quadratic_drag", "unknown_physics", "unknown", "unknown", "b", "abstained"),
        ("quadratic_drag", "explained", "", "", "", "missed"),
        ("quadratic_drag", "parameters_only", "", "", "", "missed"),
        ("none", "explained", "", "", "", "right"),
        ("none", "parameters_only", "", "", "", "right"),
        ("none", "missing_physics", "exact", "creep", "C_a", "false alarm"),
        ("none", "unknown_physics", "unknown", "unknown", "C_a", "false alarm"),
    ],
)
def test_judge(
    monkeypatch: pytest.MonkeyPatch, hidden: str, kind: str, answer: str, named: str, place: str,
    result: str,
) -> None:  # fmt: skip
    assert on_bench(monkeypatch, hidden, kind, answer, named, place).result == result


def test_judge_accepts_the_class_and_reports_look_alikes(monkeypatch: pytest.MonkeyPatch) -> None:
    name, place, kind = "quadratic_drag", "b", "missing_physics"
    outcome = on_bench(monkeypatch, name, kind, "exact", name, "k", same=(place,))
    assert outcome.result == "right"
    for k in (kind, "unknown_physics"):
        outcome = on_bench(
            monkeypatch, name, k, "look_alikes", "coulomb_friction", place,
            possible=((name, place),),
        )  # fmt: skip
        assert outcome.result == "look-alikes"
    # a set that leaves the truth out is no excuse, nor is one at another place
    outcome = on_bench(monkeypatch, name, kind, "look_alikes", "creep", place)
    assert outcome.result == "wrong"
    outcome = on_bench(
        monkeypatch, name, kind, "look_alikes", "creep", "C_a", possible=((name, place),)
    )
    assert outcome.result == "wrong"


def test_words(monkeypatch: pytest.MonkeyPatch) -> None:
    assert describe(drawn("none")) == "nothing was concealed"
    assert describe(drawn("quadratic_drag")).startswith("quadratic_drag at b, ")
    effect = ConcealedEffect(
        "leakage", frozenset({"leakage"}), "storage", frozenset(), frozenset({"C_1"}), "leak", 12.3
    )
    truth = ExamTruth("demo-1", "single", "tanks", (effect,), {}, {})
    assert describe(truth) == "leakage at C_1, which moves a reading by 12 times the noise"
    assert describe(replace(truth, effects=())) == "nothing was concealed"
    right = on_bench(monkeypatch, "none", "explained", "")
    text = summary([right, on_bench(monkeypatch, "quadratic_drag", "explained", "")], 2.0)
    assert "right 1" in text
    assert "quadratic_drag" in text
