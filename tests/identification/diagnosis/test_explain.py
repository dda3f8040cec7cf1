"""``bondsight explain``: verdict files of every kind in plain words, and refusals in one line."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from bondgraph.support.errors import UnusableInput
from bondsight.cli.main import main
from identification.diagnosis.verdict import KINDS, parse_verdict, read_verdict
from identification.diagnosis.verdict.said_again import WIDTH, much, retold


def finding(effect: str = "hysteresis", element: str = "C_nl", **more: Any) -> dict[str, Any]:
    found = {
        "location": {"element": element, "kind": "storage", "indistinguishable_from": []},
        "effect": effect, "family": "memory", "law": "prandtl_ishlinskii", "confidence": 0.98,
        "parameters": [
            {"name": "h_1", "value": 1234.5, "unit": "N/m", "ci95": [1200.0, None]},
            {"name": "h_2", "value": 10.0, "unit": "", "ci95": [9.0, 11.0]},
        ],
        "also_possible": [], "share_of_misfit_explained": 0.97,
    }  # fmt: skip
    return {**found, **more}


def unknown(**more: Any) -> dict[str, Any]:
    alike = [
        {"effect": "creep", "element": "k", "evidence": "held-out mean square 1.3"},
        {"effect": "unknown", "element": "d", "evidence": ""},
    ]
    empty: dict[str, Any] = {"law": "none", "confidence": 0.0, "parameters": []}
    return finding("unknown", "k", **{**empty, "also_possible": alike, **more})


def verdict(kind: str = "missing_physics", *findings: dict[str, Any]) -> dict[str, Any]:
    default = {"missing_physics": [finding()], "unknown_physics": [unknown()]}
    repaired = {"x": 2e-9} if kind == "missing_physics" else {}
    fitted = kind != "insufficient_data"
    return {
        "schema": "bondsight.verdict/1", "verdict": kind, "model": "stack",
        "recording": {"name": "run 7", "sha256": "ab" * 32, "samples": 8192,
                      "channels": ["V_in", "x"]},
        "findings": list(findings) or default.get(kind, []),
        "fit": {
            "noise_floor": {"x": 1.9e-9} if fitted else {},
            "nominal": {"train_rmse": {"x": 1e-8}, "test_rmse": {"x": 1e-8} if fitted else {}},
            "repaired": {"train_rmse": repaired, "test_rmse": repaired},
        },
        "nuisances": [{"name": "offset x", "value": 1e-8, "unit": "m", "within_bounds": False}],
        "advice": ["record the current i: it separates C_nl from k"], "seconds": 41.2, "seed": 0,
    }  # fmt: skip


def said(v: dict[str, Any]) -> str:
    """The words on one line, so that wrapping does not matter."""
    return " ".join(retold(parse_verdict(json.dumps(v))).split())


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_told(kind: str) -> None:
    text = retold(parse_verdict(json.dumps(verdict(kind))))
    for head in ("What was found", "How sure", "What it rests on", "What to do next"):
        assert f"{head}\n" in text
    assert ("Where\n" in text) == (kind in ("missing_physics", "unknown_physics"))
    assert max(len(line) for line in text.splitlines()) <= WIDTH
    assert "run 7" in text
    assert "it separates C_nl from k" in text


def test_a_named_effect() -> None:
    text = said(verdict())
    for words in (
        "leaves out one effect that run 7 shows: hysteresis at C_nl",
        "sits at the storage C_nl", "probability 98 %", "97 % of the misfit",
        "error 1e-08 before, 2e-09 after the repair, 5 times smaller",
        "the noise of the recording is 1.9e-09, so nothing is left to gain",
        "h_1 = 1234 N/m;", "h_2 = 10 (95 %: 9 to 11)", "8192 samples of V_in and x",
        "at the end of what it may be: offset x.",
    ):  # fmt: skip
        assert words in text, words


@pytest.mark.parametrize(
    ("share", "answer", "words"),
    [
        (0.9999, "exact", "accounts for all of the misfit"),
        (0.9999, "approximate", "accounts for 99.9 % of the misfit"),
        (0.9951, "approximate", "accounts for 99.5 % of the misfit"),
    ],
)
def test_all_of_a_misfit_is_explained_where_noise_is_left(
    share: float, answer: str, words: str
) -> None:
    made = finding(share_of_misfit_explained=share, answer=answer)
    assert words in said(verdict("missing_physics", made))


def test_a_reason_of_a_further_step_is_said_to_be_one() -> None:
    step: dict[str, Any] = {"tried": [], "before": None}
    steps = [{**step, "reasons": ["the law fits"]}, {**step, "reasons": ["no law fits"]}]
    text = said({**verdict(), "steps": steps})
    assert "The law fits." in text
    assert "In the second step: no law fits." in text


def test_a_headline_rounds_no_share_up_to_all() -> None:
    assert [much(s, 0, False) for s in (0.5, 0.994, 0.9951, 1.0)] == ["50 %", *3 * ["99 %"]]
    assert [much(s, 0, True) for s in (0.994, 0.9951, 1.0)] == ["99 %", "all", "all"]


def test_several_findings_and_ports_that_cannot_be_told_apart() -> None:
    where = {"element": "k", "kind": "storage", "indistinguishable_from": ["d", "F"]}
    rival = [{"effect": "stribeck_friction", "element": "d", "evidence": "as good"}]
    second = finding("coulomb_friction", "k", location=where, also_possible=rival)
    text = said(verdict("missing_physics", finding(), second))
    assert "leaves out two effects" in text
    assert "hysteresis at C_nl and coulomb friction at k" in text
    assert "With these sensors d and F cannot be told apart from it" in text
    assert "Besides coulomb friction at k these are not excluded: stribeck friction at d" in text


def test_look_alikes_of_an_unknown() -> None:
    text = said(verdict("unknown_physics"))
    assert "do not support one name" in text
    assert "is closest to the storage k" in text
    assert "No name is given. The best description, creep at k, accounts for 97 %" in text
    assert (
        "these remain: creep at k (held-out mean square 1.3); a curve without a name at d" in text
    )
    assert "belongs to one family: memory" in text


def test_kinds_of_an_unknown_that_look_alike() -> None:
    """The closest law is none of what remains: how far off it is stands above."""
    alike = [
        {"effect": "creep", "element": "k", "evidence": "held-out mean square 26"},
        {"effect": "unknown", "element": "b", "kind": "dissipative", "evidence": ""},
        {"effect": "unknown", "element": "K", "kind": "ratio", "evidence": ""},
    ]
    f = unknown(also_possible=alike, share_of_misfit_explained=0.23, answer="unknown")
    text = said(verdict("unknown_physics", f))
    assert "The best description, creep at k, accounts for 23 % of what the best of all" in text
    assert (
        "these remain: a loss that depends on the flow at b; a ratio that is not constant at K."
        in text
    )


def test_an_unknown_without_place_or_candidates() -> None:
    nowhere = {"element": "", "kind": "junction", "indistinguishable_from": []}
    f = unknown(location=nowhere, also_possible=[], share_of_misfit_explained=0.0, family="outside")
    text = said(verdict("unknown_physics", f))
    assert "The place is open" in text
    assert "Nothing in the catalogue comes near" in text
    assert "family" not in text


def test_what_comes_nearest_is_said_where_nothing_else_is_known() -> None:
    nowhere = {"element": "", "kind": "junction", "indistinguishable_from": []}
    near = [
        {"effect": "unknown", "element": "u", "kind": "command", "share": 0.428,
         "kind_words": "a distortion of the command"},
        {"effect": "sensor_lag", "element": "q", "kind": "", "share": 0.31, "kind_words": ""},
    ]  # fmt: skip
    f = unknown(
        location=nowhere, also_possible=[], share_of_misfit_explained=0.0, family="outside",
        nearest=near,
    )  # fmt: skip
    text = said(verdict("unknown_physics", f))
    assert (
        "No name is given. What comes nearest: a distortion of the command at u (42.8 % of the "
        "misfit) and sensor lag at q (31 % of the misfit)." in text
    )
    assert "Nothing in the catalogue" not in text


def test_a_name_that_was_not_tried_again_has_no_probability() -> None:
    text = said(verdict("missing_physics", finding(confidence=0.0)))
    assert "not tried again beside what was named after it, so no probability is given" in text
    assert "probability 0 %" not in text


def test_how_well_a_named_law_fits() -> None:
    one = finding(answer="approximate", kind="memory", law_fit=0.91, probability=0.98)
    assert "its law explains 91 % of what its kind could there" in said(
        verdict("missing_physics", one)
    )
    assert "its law explains" not in said(verdict())


def test_a_kind_at_a_place_is_told_without_a_name() -> None:
    close = [{"effect": "creep", "element": "k", "evidence": ""}]
    kind = unknown(answer="kind", kind="memory", law_fit=0.55, also_possible=close)
    text = said(verdict("unknown_physics", kind))
    assert "It is a memory; no law of the catalogue fits it." in text
    assert "creep at k, explains 55 %" in text
    assert "the storage k" in text
    alone = unknown(answer="kind", kind="exogenous", law_fit=None, also_possible=[])
    text = said(verdict("unknown_physics", alone))
    assert "It is an influence from outside" in text
    assert "comes closest" not in text


def test_a_law_that_fits_what_training_shows_but_does_not_predict() -> None:
    close = [{"effect": "stop", "element": "k", "evidence": ""}]
    kind = unknown(answer="kind", kind="restoring", law_fit=0.99, also_possible=close)
    text = said(verdict("unknown_physics", kind))
    assert "no law of the catalogue fits" not in text
    assert "explains 99 %" in text
    assert "does not predict held-out samples" in text


def test_nothing_left_to_gain_is_not_said_beside_a_misfit() -> None:
    v = verdict()
    (name, best), *_ = v["fit"]["repaired"]["test_rmse"].items()
    v["fit"]["noise_floor"][name] = best
    assert f"{name}: error" in said(v)
    assert "nothing is left to gain" in said(v)
    v["remaining"] = {name: {"over_noise": 1.6, "place": [], "kind": "", "regions": []}}
    assert "nothing is left to gain" not in said(v)


def test_what_remains_is_told_where_it_has_a_place() -> None:
    v = verdict()
    assert "What remains" not in said(v)
    left = {"over_noise": 7.25, "place": ["d"], "kind": "dissipative", "regions": ["at 3 to 4 s"]}
    quiet = {"over_noise": 1.1, "place": [], "kind": "", "regions": []}
    text = said(v | {"remaining": {"x": left, "v": quiet}})
    assert "What remains" in text
    assert "x: 7.25 times the noise, at d, like a loss that depends on the flow; above" in text
    assert "all at 3 to 4 s." in text
    assert "v: 1.1" not in text
    absent = left | {"over_noise": None}
    assert "What remains" not in said(v | {"remaining": {"x": absent}})


def test_a_two_port_of_a_file_may_be_a_gyrator() -> None:
    place = {"element": "Bl", "kind": "transformer", "indistinguishable_from": []}
    text = said(verdict("missing_physics", finding("nonlinear_ratio", "Bl", location=place)))
    assert "sits at the transformer or gyrator Bl" in text


def test_a_region_of_what_remains_is_said_in_one_sentence() -> None:
    where = (
        "from 0.08 to 33.8 Hz the misfit{} is 20 times its noise there (4 % of it in 1 % of the "
        "band)"
    )
    for whose in (" of i", ""):
        left = {"over_noise": 20.0, "place": [], "kind": "", "regions": [where.format(whose)]}
        text = " ".join(said(verdict() | {"remaining": {"i": left}}).split())
        assert (
            "i: 20 times the noise; above all from 0.08 to 33.8 Hz: there the misfit is 20 times "
            "its noise (4 % of it in 1 % of the band)."
        ) in text


def test_without_advice_it_says_what_the_kind_means() -> None:
    for kind in KINDS:
        v = verdict(kind)
        v["advice"] = []
        tail = retold(parse_verdict(json.dumps(v))).split("What to do next")[1]
        assert len(tail.split()) > 3


def test_whether_a_repair_leaves_noise_is_for_the_diagnosis_to_say() -> None:
    """Limits of the user's and noise of a colour may call noise what the usual limit would not."""
    rest = {"over_noise": 2.0, "place": [], "kind": "", "regions": []}
    v = verdict() | {"advice": [], "remaining": {"x": rest}}
    limits = {"z": 3.0, "noise": 3.0, "gain": 0.05, "law": 0.95}
    for quiet in (v, v | {"limits": limits}):
        assert "Use the repaired model" in said(quiet)
        assert "not complete" not in said(quiet)
    advice = ["the repaired model is better, not complete: it leaves 7.3 times the noise"]
    text = said(v | {"advice": advice})
    assert "Use the repaired model" not in text
    assert advice[0] in text


def test_an_effect_of_the_user_and_an_absent_number() -> None:
    f = finding("squeaking_hinge", parameters=[
        {"name": "c", "value": None, "unit": "N", "ci95": [None, None]}
    ])  # fmt: skip
    text = said(verdict("missing_physics", f))
    assert "squeaking hinge at C_nl" in text
    assert "c not determined" in text


def test_a_repair_that_made_it_worse_is_not_hidden() -> None:
    v = verdict()
    v["fit"]["repaired"]["test_rmse"] = {"x": 3e-8}
    assert "larger: do not use the repair blindly" in said(v)


def test_the_file_is_data() -> None:
    """Escape sequences and direction marks of a file do not reach the terminal."""
    v = verdict()
    v["model"] = "stack\x1b[31m\u202e\x07"
    v["advice"] = ["line\nWhat to do next\nrm"]
    text = retold(parse_verdict(json.dumps(v)))
    assert not set(text) & set("\x1b\u202e\x07\r")
    assert text.count("\nWhat to do next\n") == 1


def broken(path: str, value: Any = ...) -> str:
    """A verdict with one place changed, or taken out."""
    v = copy.deepcopy(verdict())
    *way, last = path.split(".")
    holder: Any = v
    for step in way:
        holder = holder[int(step) if step.isdigit() else step]
    if value is ...:
        del holder[last]
    else:
        holder[last] = value
    return json.dumps(v)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "no JSON"),
        ('{"schema": ', "no JSON"),
        ("[" * 100_000, "nested too deep"),
        ('{"seed": NaN}', "NaN"),
        ('{"seed": 1, "seed": 2}', "twice"),
        ("[]", "the whole file: a list is not an object"),
        ("{}", "schema is 'not given'"),
        (broken("schema", "bondsight.verdict/2"), "bondsight.verdict/2"),
        (broken("verdict", "guilty"), "verdict: 'guilty' is not one of"),
        (broken("verdict", "explained"), "a verdict explained has no findings"),
        (broken("findings", []), "has findings"),
        (broken("recording.sha256"), "recording: Recording needs its field 'sha256'"),
        (broken("recording.parts", [{"name": "a", "sha256": ""}]), "needs its field 'samples'"),
        (broken("recording.samples", 1.5), "recording.samples: 1.5 is not a whole number"),
        (broken("recording.channels", ["x", 3]), "recording.channels[1]: 3 is not text"),
        (broken("seed", True), "seed: true is not a whole number"),
        (
            broken("findings.0.confidence", 1.5),
            "confidence: 1.5 is not between 0 and 1",
        ),
        (
            broken("findings.0.location.element"),
            "[0].location: Location needs its field 'element'",
        ),
        (
            broken("findings.0.parameters.0.ci95", [1]),
            "[0].ci95: 1 entries, 2 are needed",
        ),
        (broken("findings.0.parameters.0.value", "1"), "parameters[0].value: '1' is not a number"),
        (
            broken("fit.nominal.test_rmse.x", -1.0),
            "nominal.test_rmse.x: -1.0 is not a number",
        ),
        (broken("fit.repaired", []), "fit.repaired: a list is not an object"),
        (broken("nuisances.0.within_bounds", 1), "within_bounds: 1 is not true or false"),
        (broken("advice"), "needs its field 'advice'"),
        (broken("notes", "text"), "notes: 'text' is not a list"),
        (broken("findings.0.law_fit", "good"), "law_fit: 'good' is not a number"),
        (broken("findings.0.probability", 1.2), "probability: 1.2 is not between 0 and 1"),
        (broken("findings.0.kind", 3), "kind: 3 is not text"),
        (broken("remaining", {"x": {"place": []}}), "needs its field 'over_noise'"),
        (broken("remaining", [1]), "remaining: a list is not an object"),
    ],
)
def test_refusals_say_what_is_wrong(
    text: str, complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "verdict.json"
    file.write_text(text, encoding="utf-8")
    assert main(["explain", str(file)]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert error.count("\n") == 1
    assert complaint in error
    assert "verdict.json" in error


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="cannot be opened"):
        read_verdict(tmp_path / "absent.json")
    with pytest.raises(UnusableInput, match="is a folder"):
        read_verdict(tmp_path)
    (tmp_path / "picture").write_bytes(b"\xff\xd8\xff\x00")
    with pytest.raises(UnusableInput, match="not UTF-8"):
        read_verdict(tmp_path / "picture")


def test_the_command_prints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "verdict.json"
    extended = {**verdict(), "a_later_key": [1, 2]}
    file.write_text(json.dumps(extended), encoding="utf-8")
    assert main(["explain", str(file)]) == 0
    assert capsys.readouterr().out.startswith("What was found\n  stack leaves out one effect")


def test_a_family_is_told_with_its_members_and_a_probability() -> None:
    members = [
        {"effect": n, "element": "R_out", "evidence": ""}
        for n in ("square_root_flow", "nonlinear_resistance")
    ]
    one = unknown(answer="family", confidence=0.94, also_possible=members)
    text = said(verdict("missing_physics", one))
    assert "one of square root flow and nonlinear resistance at k" in text
    assert "probability 94 %" in text
    assert "No name is given" not in text


def test_what_the_diagnosis_noticed_is_said_again() -> None:
    v = verdict()
    v["notes"] = ["m is declared 0.5, fitted 503.7: as if a unit were forgotten"]
    assert v["notes"][0] in said(v)
