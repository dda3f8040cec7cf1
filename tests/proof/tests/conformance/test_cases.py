"""The data: complete, safe to read, and confirmed by brute force on all bond equations."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from bondgraph.support.errors import UnknownName, UnusableInput
from tests.proof.conformance.brute import eigenvalues, transfer
from tests.proof.conformance.build import build, identifiers
from tests.proof.conformance.case import Case, case, cases
from tests.proof.conformance.check import spectrum_error
from tests.proof.conformance.numbers import evaluate, random_values
from tests.proof.conformance.reader import read_expression

ALL = cases()


def test_the_set_is_complete() -> None:
    assert len(ALL) == 45
    assert len({c.identity for c in ALL}) == 45
    for c in ALL:
        assert c.expected
        assert set(c.published) <= set(c.expected)
        assert "https://github.com/" in c.citation


@pytest.mark.parametrize("c", [c for c in ALL if c.transfers], ids=lambda c: c.identity)
def test_transfer_functions_agree_with_all_bond_equations(c: Case) -> None:
    random = np.random.default_rng(3)
    for t in c.transfers:
        values = random_values(c.parameters, random)
        s = complex(*random.uniform(0.4, 1.9, 2))
        expected = evaluate(t.function, {**values, "s": s})
        assert transfer(c, values, t.input, t.output, s) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    "c", [c for c in ALL if "eigenvalues" in c.expected], ids=lambda c: c.identity
)
def test_eigenvalues_agree_with_all_bond_equations(c: Case) -> None:
    expected = np.array([complex(*pair) for pair in c.expected["eigenvalues"]])
    found = eigenvalues(c, c.values)
    assert len(found) == len(expected)
    assert spectrum_error(found, expected) < 1.0


@pytest.mark.parametrize("c", ALL, ids=lambda c: c.identity)
def test_every_case_can_be_built(c: Case) -> None:
    built = build(c)
    turned = [b for b in c.bonds if c.part(b[0]).law is not None or c.part(b[0]).type == "CF"]
    assert len(built.graph.elements) == len(c.parts) + len(turned)
    bonds = {(b.tail, b.head) for b in built.graph.bonds}
    for tail, head in c.bonds:
        a, b = built.elements[tail], built.elements[head]
        assert ((a, b) in bonds) != ((tail, head) in turned)
        assert ({(f"{a}_turn", a), (f"{a}_turn", b)} <= bonds) == ((tail, head) in turned)
    assert set(built.states.values()) == set(c.stores)


def test_names_become_identifiers_and_stay_apart() -> None:
    assert identifiers(("1a", "j1a", "r")) == {"1a": "j1a_", "j1a": "j1a", "r": "r"}
    with pytest.raises(UnusableInput, match="identifier"):
        identifiers(("a b",))


def test_an_unknown_case_is_answered_with_the_nearest() -> None:
    with pytest.raises(UnknownName, match="mtt_rc2"):
        case("mtt_rc3")


def test_expressions_are_exact() -> None:
    a, b = sp.symbols("a b")
    assert read_expression("-a**2/(0.1*b) + log(2)*exp(a)") == -10 * a**2 / b + sp.log(2) * sp.exp(
        a
    )
    assert read_expression("1e-3") == sp.Rational(1, 1000)
    assert read_expression("a").assumptions0 == sp.Symbol("a").assumptions0


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('x')",
        "a.real",
        "a[0]",
        "lambda: 0",
        "exec(a)",
        "log()",
        "log(a, b)",
        "log(*a)",
        "log(x=a)",
        "(log)(a)(b)",
        "a if b else c",
        "a < b",
        "a and b",
        "not a",
        "~a",
        "a % b",
        "a // b",
        "a @ b",
        "[a]",
        "{a: b}",
        "'a'",
        "True",
        "None",
        "1j",
        "1e999",
        "9**9**9**9",
        "((((2**64)**64)**64)**64)**64",
        "((((2*a)**64)**64)**64)**64",
        "a**(10**6)",
        "1/0",
        "0**-1",
        "a/(b - b)",
        "(a := 1)",
        "f'{a}'",
        "a; b",
        "a = b",
        "",
        "(" * 300 + "a" + ")" * 300,
        "-" * 9000 + "a",
        "a" * 30_000,
        "a\0b",
    ],
)
def test_anything_but_arithmetic_is_refused(text: str) -> None:
    with pytest.raises(UnusableInput):
        read_expression(text)
