"""Rules on answers made by hand, their curves counted by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from hardware.simulators.generator.families import FAMILY_OF
from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth
from tests.proof.trial.curve_figure import draw_curves
from tests.proof.trial.curves import (
    FOREST,
    TOOL,
    Curve,
    ahead_lines,
    at_equal_coverage,
    baseline_curves,
    curve,
    statement,
)
from tests.proof.trial.forest import forest
from tests.proof.trial.rivals import RULES, Pick, fit_line, fits_beside, held_out, tool


def truth(name: str, effect: str = "", place: str = "k_1") -> ExamTruth:
    """Truth of one effect; ``unknown`` is physics without a name, nothing a control."""
    hidden = ConcealedEffect(
        effect, frozenset({effect} - {"unknown"}), FAMILY_OF.get(effect, ""), frozenset(),
        frozenset({place}), "", 9.0,
    )  # fmt: skip
    return ExamTruth(name, "single", "chain", (hidden,) if effect else (), {}, {})


def law(
    effect: str, element: str, train: float, test: float, parameters: int = 3
) -> dict[str, Any]:
    return {
        "effect": effect, "element": element, "train": train, "test": test,
        "parameters": parameters, "samples": 1000,
    }  # fmt: skip


PLAIN = {"train": 4.0, "test": 4.0, "parameters": 2, "samples": 1000}
LAWS = [
    law("backlash", "k_1", 1.0, 1.2),
    law("backlash", "k_2", 1.05, 1.3),
    law("hysteresis", "k_1", 0.99, 2.4, parameters=8),
]


def asked(**more: Any) -> dict[str, Any]:
    return {"id": "e0", "baselines": {"plain": PLAIN, "trials": LAWS, **more}}


def test_best_law_by_its_held_out_misfit() -> None:
    by_lead, by_gain = held_out(asked()), held_out(asked(), gain=True)
    # the second of its own name is no rival
    assert by_lead == Pick("backlash", frozenset({"k_1"}), (pytest.approx(math.log(2.0)),))  # type: ignore[arg-type]
    assert by_gain is not None
    assert by_gain.knob[0] == pytest.approx(math.log(4.0 / 1.2))
    assert held_out({"id": "e0"}) is None


def test_every_rule_has_the_shared_clock_where_truths_have_it() -> None:
    skew = law("clock_skew", "F", 1.0, 1.2)
    terms = {"STLSQ": [["clock_skew", "F", 0.7]]}
    content = asked(trials=[skew], sparse=terms) | {"nominal_rms": {"x": 1.0}}
    for rule in (held_out, RULES["Akaike's criterion"], RULES["sparse regression, STLSQ"]):
        found = rule(content)
        assert found is not None
        assert found.places == {"clock"}
    kept = answer("clock_skew", "clock")
    kept["evidence"][0]["laws"][0] |= {"element": "F"}
    told = tool(kept)
    assert told is not None
    assert math.isfinite(told.knob[1])


def test_older_answers_have_the_misfits_in_their_evidence() -> None:
    rows = [{**x, "effect": e} for x, e in zip(LAWS, ("unknown", "creep", "coulomb"), strict=True)]
    found = held_out({"id": "e0", "evidence": [{"laws": rows, "nominal": 2.0, "trained": 2.0}]})
    assert found is not None
    assert found.name == "creep"  # the unnamed curve is no name
    assert found.knob[0] == pytest.approx(math.log(2.0 / 1.3))


def test_information_criteria_by_hand() -> None:
    akaike, bayes = RULES["Akaike's criterion"](asked()), RULES["Bayesian criterion"](asked())
    assert akaike is not None
    assert bayes is not None
    # 1000 log 0.99 + 2 * 8 = 5.95 beside 1000 log 1 + 2 * 3 = 6
    assert akaike.name == "hysteresis"
    assert akaike.knob[0] == pytest.approx(6.0 - (1000 * math.log(0.99) + 16))
    # 1000 log 0.99 + 6.908 * 8 = 45.2 beside 6.908 * 3 = 20.7
    assert bayes.name == "backlash"
    assert bayes.knob[0] == pytest.approx(1000 * math.log(0.99) + 5 * math.log(1000))


def test_the_model_as_it_is_is_a_rival() -> None:
    content = asked(trials=[law("backlash", "k_1", 4.0, 4.4)])
    for name in ("Akaike's criterion", "best held-out law, by its lead"):
        found = RULES[name](content)
        assert found is not None
        assert found.knob[0] < 0


def test_strongest_term_of_a_sparse_regression() -> None:
    terms = {"STLSQ": [["creep", "C_a", 0.7], ["leakage", "C_a", 0.2]], "SR3": []}
    assert RULES["sparse regression, STLSQ"](asked(sparse=terms)) == Pick(
        "creep", frozenset({"C_a"}), (0.7,)
    )
    assert RULES["sparse regression, SR3"](asked(sparse=terms)) is None
    assert RULES["sparse regression, FROLS"](asked(sparse=None)) is None


def answer(effect: str, place: str = "k_1", sure: float = 0.9, lead: float = 5.0) -> dict[str, Any]:
    """Answer of the tool whose decision has one rival that lost by `lead` standard errors."""
    table = np.zeros((3, 3))
    table[0, 1], table[2, 1] = 9.0, lead
    return {
        "id": "e0", "ports": list("abcdefgh"),
        "verdict": {"verdict": "missing_physics", "findings": [{
            "answer": "exact", "effect": effect, "family": FAMILY_OF[effect], "probability": sure,
            "location": {"element": place},
        }]},
        "evidence": [{
            "laws": [law(effect, place, 1.0, 1.0), law("creep", place, 1.0, 1.1)],
            "loss": [3.0, 1.0, 1.1], "apart": table.tolist(), "paired": (0.5 * table).tolist(),
            "nominal": 4.0, "trained": 4.0, "floors": {"x": 1.0, "y": 2.0},
        }],
    }  # fmt: skip


def test_the_tool_is_as_sure_as_it_says_then_as_its_decision_was() -> None:
    assert tool(answer("backlash")) == Pick("backlash", frozenset({"k_1"}), (0.9, 5.0))
    assert tool(answer("backlash", lead=20.0)) == Pick("backlash", frozenset({"k_1"}), (0.9, 9.0))
    silent: dict[str, Any] = {"id": "e0", "verdict": {"verdict": "explained", "findings": []}}
    assert tool(silent) is None


def test_a_curve_is_counted_at_every_setting() -> None:
    def pick(name: str, knob: float, place: str = "k_1") -> Pick:
        return Pick(name, frozenset({place}), (knob,))

    found = curve(
        "rule",
        [
            (truth("a", "backlash"), pick("backlash", 4.0)),
            (truth("b", "backlash"), pick("creep", 2.0)),
            (truth("c", "creep"), pick("creep", 2.0, "k_2")),
            (truth("d", "creep"), None),
            (truth("e"), pick("creep", 3.0)),
            (truth("f", "unknown"), pick("creep", 1.0)),
        ],
    )
    assert found.points == ((0.25, 0.0), (0.25, 0.0), (0.75, 1 / 3), (0.75, 1 / 3))
    assert found.alarms == ((0.25, 0.0), (0.25, 0.5), (0.75, 0.5), (0.75, 1.0))
    assert [c.misplaced.hits for c in found.counts] == [0, 0, 1, 1]
    assert found.at(0.5).wrong.hits == 1
    assert found.at(0.9) == found.counts[-1]


def trial(wrong: int) -> tuple[dict[str, ExamTruth], dict[str, Mapping[str, Any]]]:
    """Forty effects and ten controls; the tool names all, the best law is wrong in the last."""
    truths = {f"t{i:02d}": truth(f"t{i:02d}", "backlash" if i < 40 else "") for i in range(50)}
    contents: dict[str, Mapping[str, Any]] = {}
    for i, name in enumerate(truths):
        said = answer("backlash", lead=3.0 + i) if i < 40 else {"verdict": {}, "evidence": []}
        best = "hysteresis" if 40 - wrong <= i < 40 else "backlash"
        laws = [law(best, "k_1", 1.0, 1.0)] if i < 40 else []
        # every other one is surer than it should be
        plain = {**PLAIN, "test": 2.0 + i % 2}
        contents[name] = {**said, "id": name, "baselines": {"plain": plain, "trials": laws}}
    return truths, contents


def test_the_tool_beside_a_baseline_at_equal_coverage() -> None:
    own, *others = baseline_curves(*trial(20))
    assert own.name == TOOL
    assert own.points[-1] == (1.0, 0.0)
    assert {c.name for c in others} <= set(RULES)
    first, half = (
        e for e in at_equal_coverage((own, *others)) if e.name == "best held-out law, by its gain"
    )
    assert (first.coverage, first.baseline.wrong.hits, first.baseline.wrong.total) == (1.0, 20, 40)
    assert (half.coverage, half.baseline.wrong.total) == (0.5, 20)
    assert first.ahead
    assert first.surely  # 0/40 is below 8.8 %, 20/40 above 33 %
    assert "surely" in ahead_lines([first])[-1]
    said = statement([first, half])
    assert said.startswith("at equal coverage the tool is ahead of 1 of 1 baselines")
    assert said.endswith("do not meet of 1")


def test_one_error_less_is_ahead_but_not_surely() -> None:
    own, *others = baseline_curves(*trial(1))
    first = at_equal_coverage((own, *others))[0]
    assert first.ahead
    assert not first.surely
    own, *others = baseline_curves(*trial(0))
    level = at_equal_coverage((own, *others))[0]
    assert not level.ahead
    assert ahead_lines([level])[-1].endswith("| level |")
    assert statement([level]).endswith(f"of 0; not of {level.name}")


def test_a_tool_that_names_nothing_has_a_curve_and_nothing_equal() -> None:
    nothing = Curve(TOOL, curve(TOOL, [(truth("a", "creep"), None)]).counts)
    other = curve("rule", [(truth("a", "creep"), Pick("creep", frozenset(), (1.0,)))])
    assert nothing.points == ()
    assert at_equal_coverage((nothing, other)) == ()


def screened(effect: str, place: str, rng: np.random.Generator) -> dict[str, Any]:
    """Answer of which the screening likes one effect at one place best."""
    rows = [
        [e, p, "storage", 0.9 if (e, p) == (effect, place) else float(rng.uniform(0, 0.5)), 3.0]
        for e in ("backlash", "creep")
        for p in ("k_1", "k_2")
    ]
    kept = {"plain": PLAIN, "trials": [], "screening": rows, "residual": {"skew": 0.1}}
    return {"id": "e0", "baselines": kept}


def test_a_forest_learns_what_the_screening_tells() -> None:
    pytest.importorskip("sklearn")
    rng = np.random.default_rng(2)
    pairs = [(e, p) for e in ("backlash", "creep") for p in ("k_1", "k_2")] * 10
    truths = {f"d{i}": truth(f"d{i}", e, p) for i, (e, p) in enumerate(pairs)}
    contents = {f"d{i}": screened(e, p, rng) for i, (e, p) in enumerate(pairs)}
    rule = forest(truths, contents)
    assert rule is not None
    found = rule(screened("creep", "k_2", rng))
    assert found is not None
    assert found.name == "creep"
    assert found.places == {"k_2"}
    assert found.knob[0] > 0.8
    assert rule({"id": "e1", "baselines": None}) is None
    assert forest(truths, {}) is None
    new = {"n0": screened("backlash", "k_1", rng)}
    curves = baseline_curves({"n0": truth("n0", "backlash")}, new, (truths, contents))
    assert curves[-1].name == FOREST
    assert curves[-1].points == ((1.0, 0.0),)


def test_fits_beside_the_black_box() -> None:
    content = {
        **answer("backlash"), "nominal_rms": {"x": 4.0, "y": 2.0},
        "repaired_rms": {"x": 1.0, "y": 2.0}, "baselines": {"black_box": {"x": 2.0, "y": 4.0}},
    }  # fmt: skip
    (found,) = fits_beside({"e0": content, "e1": answer("creep")})
    assert found == pytest.approx((math.sqrt(8.5), 1.0, 2.0))
    line = fit_line({"e0": content})
    assert (
        "as it is 2.92, with a black box 2, repaired 1; the repair's is the lower one in 1" in line
    )
    assert fit_line({}) == "no recording that was repaired has a black box beside it"


def test_the_picture_shows_every_curve() -> None:
    curves = baseline_curves(*trial(20))
    left, right = draw_curves(curves).axes
    legend = left.get_legend()
    assert legend is not None
    assert [t.get_text() for t in legend.get_texts()] == [c.name for c in curves]
    assert len(right.lines) == len(curves) + 1  # and the tool's default
