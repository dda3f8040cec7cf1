"""Rates, gates, tables and baselines, counted by hand on a small trial."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from xml.etree import ElementTree

import pytest

from identification.diagnosis.catalogue import CATALOGUE
from tests.proof.tests.trial.made_up import answer, finding, truth
from tests.proof.trial.answers import Answer
from tests.proof.trial.baselines import best_candidate, information_criterion
from tests.proof.trial.leave_one_out import publish_withheld, score_withheld
from tests.proof.trial.oracles import OracleAnswer, repair_ratio
from tests.proof.trial.publishing import publish
from tests.proof.trial.rates import Rate, rate
from tests.proof.trial.scoring import Score, plain, score
from tests.proof.trial.summary import gate_lines
from tests.proof.trial.truths import Truth
from tests.proof.trial.vocabulary import FAMILIES, FAMILY_OF


def repaired(a: Answer, rmse: float) -> Answer:
    from dataclasses import replace

    return replace(a, nominal_rmse={"x_1": 5.0}, repaired_rmse={"x_1": rmse})


def small_trial() -> tuple[dict[str, Truth], dict[str, Answer], dict[str, OracleAnswer]]:
    """Four controls, four singles, two outside, one form, one double, two look-alikes."""
    truths = [
        truth("c1", "control"),
        truth("c2", "control"),
        truth("c3", "control"),
        truth("c4", "control"),
        truth("s1", "single", ("coulomb_friction", "b_1"), strength=22.0),
        truth("s2", "single", ("nonlinear_stiffness", "k_1"), strength=12.0),
        truth("s3", "single", ("saturation", "F"), strength=-8.0),
        truth("s4", "single", ("hysteresis", "k_2"), strength=12.0),
        truth("o1", "outside", ("unknown", "k_1")),
        truth("o2", "outside", ("unknown", "b_1")),
        truth("f1", "form", ("hysteresis", "k_1")),
        truth("d1", "double", ("coulomb_friction", "b_1"), ("saturation", "F")),
        truth("l1", "look_alike", ("coulomb_friction", "b_2"), pair="01", decisive=True),
        truth("l2", "look_alike", ("hysteresis", "k_2"), pair="01", decisive=False),
    ]
    answers = [
        answer("c1"),
        answer("c2", verdict="parameters_only"),
        answer("c3", finding("creep", "k_1", confidence=0.7)),
        answer("c4", error="it broke"),
        repaired(answer("s1", finding("coulomb_friction", "b_1", confidence=0.9)), 1.05),
        repaired(answer("s2", finding("end_stop", "k_1", confidence=0.8)), 1.20),
        answer("s3"),
        answer("s4", finding("unknown", "k_1", family="memory")),
        answer("o1", finding("unknown", "k_1", family="outside")),
        answer("o2", finding("creep", "k_1", confidence=0.6)),
        answer("f1", finding("unknown", "k_1", family="memory")),
        answer("d1", finding("coulomb_friction", "b_1"), finding("saturation", "F")),
        repaired(answer("l1", finding("coulomb_friction", "b_2", confidence=1.0)), 1.0),
        answer("l2", finding("unknown", "k_2", also=("hysteresis", "coulomb_friction"),
                             family="outside")),
    ]  # fmt: skip
    oracles = [
        OracleAnswer("s1", {"x_1": 1.0}, 1.0, 8.0, 20.0),
        OracleAnswer("s2", {"x_1": 1.0}, 1.0, 5.0, 11.0),
        OracleAnswer("s3", {"x_1": 1.0}, 1.0, 9.0, -9.0),
        OracleAnswer("s4", {"x_1": 1.0}, 1.0, 1.0, 11.0),
        OracleAnswer("l1", {"x_1": 1.0}, 1.0, 4.0, 14.0),
        OracleAnswer("l2", {"x_1": 1.0}, 1.0, 0.5, 5.0),
    ]
    return (
        {t.id: t for t in truths},
        {a.id: a for a in answers},
        {o.id: o for o in oracles},
    )


@pytest.fixture(scope="module")
def scored() -> Score:
    return score(*small_trial())


def gate(s: Score, words: str) -> tuple[float, Rate | None, bool | None]:
    (found,) = [g for g in s.gates if words in g.name]
    return found.value, found.counted, found.passed


def test_gates_by_hand(scored: Score) -> None:
    assert gate(scored, "false alarms") == (0.25, Rate(1, 4), False)
    # places: s1 right, s2 right, s4 wrong (k_1 for k_2), o1 right, o2 wrong, f1 right, d1 twice
    # right, l1 right, l2 right
    assert gate(scored, "wrong place") == (0.2, Rate(2, 10), False)
    # names: s1, s4 (family), f1 (family), d1 twice, l1, l2 (set) right; s2 wrong
    assert gate(scored, "wrong name, of") == (0.125, Rate(1, 8), False)
    assert gate(scored, "outside") == (0.5, Rate(1, 2), False)
    # distinguishable: s1 right, s2 place right and name wrong, l1 right; s3 is too weak
    assert gate(scored, "right class of ports and")[1] == Rate(2, 3)
    assert gate(scored, "distinguishable: right name")[1] == Rate(2, 3)
    # not separable: s4 (family) and l2 (set)
    assert gate(scored, "a set that holds it")[1] == Rate(1, 2)
    # repairs over the oracle: 1.05, 1.20, 1.00
    assert gate(scored, "over the oracle's")[0] == pytest.approx(1.05)
    assert gate(scored, "over the oracle's")[2] is True
    assert gate(scored, "without an answer")[1] == Rate(1, 14)
    assert not scored.passed
    assert scored.asked == {
        "no oracle": 0, "below 3 dB": 1, "not separable": 2, "distinguishable": 3,
    }  # fmt: skip


def test_place_gate_alone(scored: Score) -> None:
    (found,) = [g for g in scored.gates if g.name == "distinguishable: right class of ports"]
    assert (found.counted, found.passed) == (Rate(3, 3), True)


def test_nothing_to_count_is_neither_met_nor_failed() -> None:
    truths, answers, _ = small_trial()
    s = score({"c1": truths["c1"]}, {"c1": answers["c1"]})
    assert gate(s, "false alarms") == (0.0, Rate(0, 1), True)
    assert gate(s, "wrong name, of")[2] is None
    # a proof that counted nothing proves nothing
    assert not s.passed


def test_a_missing_answer_is_a_crash() -> None:
    truths, _, _ = small_trial()
    s = score({"s1": truths["s1"]}, {})
    assert s.outcomes[0].name == "crashed"
    assert gate(s, "without an answer")[1] == Rate(1, 1)


def test_intervals_are_wilsons() -> None:
    # (p + z^2/2n -+ z sqrt(p q / n + z^2 / 4 n^2)) / (1 + z^2 / n) with p = 0.02, n = 150
    p, n, z = 3 / 150, 150, 1.959964
    middle, away = p + z * z / 2 / n, z * math.sqrt(p * (1 - p) / n + z * z / 4 / n / n)
    expected = [(middle - away) / (1 + z * z / n), (middle + away) / (1 + z * z / n)]
    assert list(Rate(3, 150).interval) == pytest.approx(expected, rel=1e-5)
    assert str(rate([])) == "0/0"
    assert math.isnan(Rate(0, 0).value)


def test_confusion_power_pairs_and_cells(scored: Score) -> None:
    names = scored.names
    assert names.counts["nonlinear_stiffness"] == {"end_stop": 1}
    assert names.counts["(nothing)"] == {"(nothing)": 2, "creep": 1, "(crash)": 1}
    assert names.right["(nothing)"] == Rate(2, 4)
    assert names.counts["hysteresis (form)"] == {"family memory": 1}
    assert names.counts["hysteresis"] == {"family memory": 1, "look-alikes": 1}
    assert scored.places["chain"].counts["k_2"] == {"k_1": 1, "k_2": 1}
    assert {(p.low, p.high): (p.detected, p.named, p.wrong) for p in scored.power} == {
        (-10.0, -5.0): (Rate(0, 1), Rate(0, 1), Rate(0, 1)),
        (5.0, 10.0): (Rate(1, 1), Rate(0, 1), Rate(0, 1)),
        (10.0, 15.0): (Rate(3, 3), Rate(1, 3), Rate(1, 3)),
        (20.0, 25.0): (Rate(1, 1), Rate(1, 1), Rate(0, 1)),
    }
    assert scored.cells["double"] == {"2 of 2 found": 1}
    assert [(p.decisive, dict(p.outcomes)) for p in scored.pairs] == [
        (False, {"look_alikes": 1}),
        (True, {"right": 1}),
    ]


def test_calibration_by_hand(scored: Score) -> None:
    c = scored.calibration
    # exact names: c3 .7 wrong, s1 .9 right, s2 .8 wrong, o2 .6 wrong, d1 .9 .9 right, l1 1 right
    assert c.names == 7
    assert c.brier == pytest.approx((0.49 + 0.01 + 0.64 + 0.36 + 0.01 + 0.01 + 0.0) / 7)
    by_low = {r.low: r.right for r in c.table}
    assert by_low == {0.6: Rate(0, 1), 0.7: Rate(0, 1), 0.8: Rate(0, 1), 0.9: Rate(3, 3),
                      0.95: Rate(1, 1)}  # fmt: skip


def test_repair_without_a_name_counts_with_the_nominal_error() -> None:
    a = repaired(answer("r"), 1.0)
    oracle = OracleAnswer("r", {"x_1": 1.0, "x_2": 0.0}, 1.0, 5.0, 10.0)
    from dataclasses import replace

    assert repair_ratio(a, oracle) == pytest.approx(1.0)
    assert repair_ratio(replace(a, repaired_rmse={}), oracle) == pytest.approx(5.0)


def fitted(effect: str, element: str, train: float, test: float, k: int) -> dict[str, object]:
    return {"effect": effect, "element": element, "train": train, "test": test, "parameters": k,
            "samples": 1000, "home": True, "family": FAMILY_OF.get(effect, "outside")}  # fmt: skip


def test_baselines_by_hand() -> None:
    nominal = {"train": 1.10, "test": 1.10, "parameters": 5, "samples": 1000}
    trials = [
        fitted("unknown", "k_1", 0.90, 0.90, 20),
        fitted("creep", "k_1", 1.00, 1.08, 8),
        fitted("coulomb_friction", "b_1", 1.02, 1.05, 6),
    ]
    a = answer("r", nominal=nominal, trials=trials)
    assert best_candidate(a) == ("coulomb_friction", "b_1")
    # n log s + k log n: nominal 95.3 + 34.5, creep 0 + 55.3, Coulomb 19.8 + 41.4
    assert information_criterion(a) == ("creep", "k_1")
    costly = [*trials[2:], fitted("creep", "k_1", 1.00, 1.08, 12)]
    assert information_criterion(answer("r", nominal=nominal, trials=costly)) == (
        "coulomb_friction", "b_1",
    )  # fmt: skip
    quiet = answer("r", nominal=nominal | {"train": 1.02, "test": 1.0}, trials=[])
    assert information_criterion(quiet) == best_candidate(quiet) == ("", "")
    assert information_criterion(answer("r", error="it broke")) is None


def test_baselines_are_counted(scored: Score) -> None:
    truths, answers, oracles = small_trial()
    from dataclasses import replace

    nominal = {"nominal_train": 9.0, "nominal_test": 9.0, "nominal_parameters": 5, "samples": 1000}
    told = (fitted("coulomb_friction", "b_1", 1.0, 1.0, 6),)
    answers = {
        i: replace(a, trials=told, **nominal)  # type: ignore[arg-type]
        for i, a in answers.items()
    }
    first = score(truths, answers, oracles).baselines[0]
    # the same name every time: right for s1 (place too), d1; right name at another place for l1
    assert (first.answered, first.alarms, first.outside) == (14, Rate(4, 4), Rate(2, 2))
    assert first.wrong == Rate(5, 8)
    assert first.misplaced == Rate(7, 10)
    assert first.right == Rate(1, 3)


def test_everything_is_published(scored: Score, tmp_path: Path) -> None:
    path = publish(scored, {"date": "today", "tool_commit": "abc"}, tmp_path)
    text = path.read_text(encoding="utf-8")
    assert "**Not all gates are met.**" in text
    assert "1/4 = 25.0 % (4.6 to 69.9)" in text
    with (tmp_path / "trials.csv").open(encoding="utf-8", newline="") as f:
        listed = list(csv.DictReader(f))
    assert [r["id"] for r in listed] == sorted(small_trial()[0])
    assert next(r for r in listed if r["id"] == "s2")["name"] == "wrong"
    assert next(r for r in listed if r["id"] == "c4")["error"] == "it broke"
    data = json.loads((tmp_path / "score.json").read_text(encoding="utf-8"))
    assert data == json.loads(json.dumps(plain(scored)))
    for figure in ("names", "power", "calibration"):
        assert f"{figure}.svg" in text
        assert ElementTree.parse(tmp_path / f"{figure}.svg").getroot().tag.endswith("svg")
    assert "FAILED false alarms" in gate_lines(scored.gates)


def test_truth_withheld_by_hand(tmp_path: Path) -> None:
    truths = {
        f"s{i}": truth(f"s{i}", "single", ("coulomb_friction", "b_1")) for i in range(1, 6)
    } | {"c1": truth("c1", "control")}
    answers = {
        "s1": answer("s1", finding("unknown", "b_1", family="friction")),
        "s2": answer("s2", finding("unknown", "", family="outside")),
        "s3": answer("s3", finding("hysteresis", "k_1")),
        "s4": answer("s4"),
    }
    found = score_withheld(truths, answers)
    rates = [g.counted for g in found.gates]
    # of the three that spoke: two honest, one wrong name at a wrong place; one is silent
    assert rates[:4] == [Rate(2, 3), Rate(2, 3), Rate(1, 3), Rate(3, 4)]
    assert not found.passed
    text = publish_withheld(found, tmp_path).read_text(encoding="utf-8")
    assert "coulomb_friction at b_1 | hysteresis | k_1 | wrong | wrong" in text
    json.loads((tmp_path / "withheld.json").read_text(encoding="utf-8"))


def test_the_vocabulary_holds_the_catalogue() -> None:
    assert len(FAMILY_OF) == sum(map(len, FAMILIES.values()))
    for effect in CATALOGUE:
        assert FAMILY_OF[effect.name] == effect.family
