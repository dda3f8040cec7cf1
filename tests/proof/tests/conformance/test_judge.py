"""The judge accepts what is right, whichever storage is dependent, and rejects what is wrong."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
import sympy as sp

from bondgraph.support.errors import UnusableInput
from tests.proof.conformance.answer import Answer
from tests.proof.conformance.case import Case, case, cases
from tests.proof.conformance.check import REFUSED, RIGHT, WRONG, judge
from tests.proof.conformance.implicit import from_relations

WITH_EQUATIONS = [c for c in cases() if c.equations]


def published(c: Case) -> Answer:
    """Return the expected equations as the answer of a tool."""
    relations = [sp.Symbol(k) - e for k, e in c.equations.items()]
    return from_relations(c, relations, {})


@pytest.mark.parametrize("c", WITH_EQUATIONS, ids=lambda c: c.identity)
def test_the_published_equations_are_right(c: Case) -> None:
    judgement = judge(c, published(c))
    assert judgement.verdict == RIGHT, judgement.reason
    assert {"state equations", "bond equations"} <= set(judgement.checked)


@pytest.mark.parametrize("c", WITH_EQUATIONS, ids=lambda c: c.identity)
def test_one_wrong_sign_is_wrong(c: Case) -> None:
    right = published(c)
    for name, e in right.rates.items():
        if e != 0:
            wrong = replace(right, rates={**right.rates, name: -e})
            assert judge(c, wrong).verdict == WRONG, name


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("c", WITH_EQUATIONS, ids=lambda c: c.identity)
def test_the_bond_equations_alone_reject_a_wrong_rate(c: Case) -> None:
    right = published(c)
    silent = replace(c, expected={k: v for k, v in c.expected.items() if k != "state_equations"})
    assert judge(silent, right).verdict == RIGHT
    for name, e in right.rates.items():
        wrong = replace(right, rates={**right.rates, name: e * sp.Rational(1001, 1000) + 1})
        verdict = judge(silent, wrong)
        assert verdict.verdict == WRONG
        assert verdict.reason.startswith(("bond equations", "eigenvalues", "final"))


def _constant(g: sp.Expr, source: str, output: str) -> sp.Expr:
    return g


def changes() -> dict[str, tuple[str, str]]:
    """Fields of an otherwise right answer -> what the reason must name."""
    return {
        "undefined": ("undefined variables", "e_3 is undefined"),
        "missing state": ("undefined variables", "missing"),
        "order": ("order", "2 instead of 1"),
        "dependent": ("state equations", "expected"),
        "unknown rate of an input": ("undefined variables", "du_nobody"),
        "derivative": ("derivative causality", "{r1}"),
        "alternatives": ("derivative causality", "alternatives"),
        "loops": ("algebraic loops", "1, expected 0"),
        "eigenvalues": ("eigenvalues", "expected"),
        "too many eigenvalues": ("eigenvalues", "2 instead of 1"),
        "besides": ("bond equations", "does not hold"),
    }


@pytest.mark.parametrize("change", changes())
def test_each_field_is_judged(change: str) -> None:
    c = case("gs96_lag_r2_removed")
    both = frozenset({frozenset({"c1"}), frozenset({"c2"})})
    rate, follows, q = c.equations["dq_c1"], c.equations["q_c2"], sp.Symbol("q_c1")
    right = Answer(
        rates={"q_c1": rate}, dependent={"q_c2": follows}, order=1,
        derivative=frozenset({"c2"}), alternatives=both, loops=0,
    )  # fmt: skip
    assert judge(c, right).verdict == RIGHT
    mutations: dict[str, dict[str, Any]] = {
        "undefined": {"rates": {"q_c1": rate + sp.Symbol("e_3")}},
        "missing state": {"dependent": {}},
        "order": {"order": 2},
        "dependent": {"dependent": {"q_c2": 2 * follows}},
        "unknown rate of an input": {"rates": {"q_c1": rate + sp.Symbol("du_nobody")}},
        "derivative": {"derivative": frozenset({"r1"})},
        "alternatives": {"alternatives": frozenset({frozenset({"c1"})})},
        "loops": {"loops": 1},
        "eigenvalues": {"eigenvalues": lambda values: np.array([-0.0388889])},
        "too many eigenvalues": {"eigenvalues": lambda values: np.array([-0.03888888889, -1.0])},
        "besides": {"besides": (q - 5,)},
    }
    judgement = judge(c, replace(right, **mutations[change]))
    field, said = changes()[change]
    assert judgement.verdict == WRONG
    assert judgement.reason.startswith(field)
    assert said in judgement.reason


def test_the_other_storage_may_be_the_dependent_one() -> None:
    c = case("gs96_lag_r2_removed")
    q1, q2, c1, c2, r1, r3, u = sp.symbols("q_c1 q_c2 c1 c2 r1 r3 u_v0")
    rate = (u / r1 - q2 / c2 * (1 / r1 + 1 / r3)) * c2 / (c1 + c2)
    other = Answer(rates={"q_c2": rate}, dependent={"q_c1": c1 * q2 / c2}, order=1)
    assert judge(c, other).verdict == RIGHT
    lost = replace(other, rates={"q_c2": rate * (c1 + c2) / c2})  # forgets the dependent storage
    assert judge(c, lost).verdict == WRONG
    assert q1 not in rate.free_symbols


def test_transfer_functions_are_judged() -> None:
    c = case("mtt_rc2")
    (t,) = c.transfers
    right = replace(published(c), transfer=lambda source, output: t.function)
    assert judge(c, right).verdict == RIGHT
    assert "transfer functions" in judge(c, right).checked
    x = sp.Symbol("x")
    for g in (-t.function, t.function / 2, t.function.subs(sp.Symbol("s"), sp.Symbol("s") * 2), x):
        wrong = replace(right, transfer=partial(_constant, g))
        assert judge(c, wrong).reason.startswith("transfer functions")


def test_a_refusal_while_judging_is_a_refusal() -> None:
    def refuse(source: str, output: str) -> sp.Expr:
        raise UnusableInput("no")

    c = case("mtt_rc2")
    assert judge(c, replace(published(c), transfer=refuse)).verdict == REFUSED


def test_an_answer_to_an_impossible_graph_is_wrong() -> None:
    c = case("gs96_two_sources_conflict")
    assert judge(c, Answer(rates={}, dependent={}, order=0)).verdict == WRONG


def test_a_wrong_sign_shows_in_the_final_value() -> None:
    c = case("bgj_driven_rc_const")
    q, u = sp.symbols("q_C u_Sf")
    only = replace(c, expected={k: v for k, v in c.expected.items() if k != "eigenvalues"})
    assert judge(only, Answer(rates={"q_C": u - q}, dependent={}, order=1)).verdict == RIGHT
    assert judge(only, Answer(rates={"q_C": -u - q}, dependent={}, order=1)).verdict == WRONG


def test_relations_are_sorted_into_rates_and_constraints() -> None:
    c = case("bgt_se_on_c")
    q, dq = sp.symbols("q_c dq_c")
    answer = from_relations(c, [dq, q - 1], {})
    assert (answer.order, list(answer.dependent), list(answer.rates)) == (0, ["q_c"], [])
    assert judge(c, answer).verdict == RIGHT
    assert judge(c, from_relations(c, [dq - 1, q - 1], {})).verdict == WRONG
    assert judge(c, from_relations(c, [dq], {})).verdict == WRONG
    assert judge(c, from_relations(c, [], {})).verdict == WRONG
    with pytest.raises(UnusableInput, match="linear in the rates"):
        from_relations(c, [dq**2 - 1], {})


def test_an_implicit_unknown_is_solved() -> None:
    c = case("bgt_reaction_clamped_species")
    answer = published(c)
    assert list(answer.implicit) == ["q_A"]
    point = answer.solution(c, np.random.default_rng(1))
    assert point["q_A"] == pytest.approx(np.exp(1.0), rel=1e-12)
    assert point["dq_A"] == pytest.approx(0.0, abs=1e-12)
