"""Determined combinations: known answers, and nothing printed that does not hold."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.uncertainty.combinations import (
    FORMS,
    Combination,
    FlatBlock,
    flat_blocks,
    monomial,
    null_space,
)


def blocks(rows: list[list[float]], names: str, values: list[float]) -> tuple[FlatBlock, ...]:
    """Flat blocks of sensitivities whose row space is `rows` (relative changes)."""
    j = np.random.default_rng(0).standard_normal((25, len(rows))) @ np.array(rows, float)
    return flat_blocks(names.split(), [np.array(values)], [null_space(j)])


def said(found: tuple[FlatBlock, ...]) -> list[str]:
    return [str(c) for b in found for c in b.determined]


def test_ratios_of_a_gauge() -> None:
    found = blocks([[1, -1, 0], [0, 1, -1]], "m d k", [0.51, 2.03, 197.0])
    assert said(found) == ["d/m", "k/m"]
    assert found[0].missing == 1
    assert found[0].complete


def test_powers() -> None:
    assert said(blocks([[2, -1, 0], [0, 0, 1]], "T k c", [3.52, 65.3, 1.7])) == ["T^2/k"]


def test_sums_and_reciprocals() -> None:
    assert said(blocks([[2.3, 3.7]], "R_1 R_2", [2.3, 3.7])) == ["R_1 + R_2"]
    assert said(blocks([[1 / 2.3, 1 / 3.7]], "k_1 k_2", [2.3, 3.7])) == ["1/k_1 + 1/k_2"]


def test_only_parameters_of_one_unit_are_added() -> None:
    rows = np.random.default_rng(0).standard_normal((25, 1)) @ np.array([[2.3, 3.7]])
    for units, known in ((("N", "mN"), ["R_1 + R_2"]), (("N", "m"), [])):
        null = [null_space(rows)]
        found = flat_blocks(["R_1", "R_2"], [np.array([2.3, 3.7])], null, units=units)
        assert said(found) == known


def test_a_block_may_mix_forms() -> None:
    found = blocks([[2.3, 3.7, 0], [1, 0, 1]], "R_1 R_2 c", [2.3, 3.7, 5.1])
    assert sorted(said(found)) == ["R_1 + R_2", "R_1*c"]


def test_blocks_are_taken_apart_and_dead_parameters_named() -> None:
    rows = [[1.0, -1, 0, 0, 0], [0.0, 0, 1, 1, 0]]
    found = blocks(rows, "a b c d e", [1.3, 2.1, 0.7, 3.3, 1.1])
    assert [b.names for b in found] == [("a", "b"), ("c", "d"), ("e",)]
    assert found[2].dead
    assert str(found[2]) == "e: no output depends on it"


def test_what_has_no_short_form_is_said_and_not_printed() -> None:
    found = blocks([[1.0, np.pi, np.sqrt(2)]], "a b c", [1.3, 2.1, 0.7])
    assert said(found) == []
    assert not found[0].complete
    assert "none a short product or sum" in str(found[0])


def test_a_product_that_holds_at_one_point_only_is_dropped() -> None:
    names, rows = ("R_1", "R_2"), np.random.default_rng(0).standard_normal((9, 1))
    points = [np.array([2.0, 4.0]), np.array([3.0, 2.5])]
    nulls = [null_space(rows * p) for p in points]
    (one,) = flat_blocks(names, points[:1], nulls[:1], forms=("product",))
    assert [str(c) for c in one.determined] == ["R_1*R_2^2"]  # true at (2, 4) only
    (both,) = flat_blocks(names, points, nulls, forms=("product",))
    assert both.determined == ()
    (right,) = flat_blocks(names, points, nulls)
    assert [str(c) for c in right.determined] == ["R_1 + R_2"]


def test_weak_parameters_are_not_dead() -> None:
    j = np.random.default_rng(0).standard_normal((30, 3)) * [1e5, 1.0, 1e-4]
    assert null_space(j).shape == (3, 0)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 10_000),
    st.lists(st.lists(st.integers(-2, 2), min_size=4, max_size=4), min_size=1, max_size=3),
)
def test_every_combination_holds_and_they_span(seed: int, rows: list[list[int]]) -> None:
    rng = np.random.default_rng(seed)
    values = [rng.uniform(0.5, 3.0, 4), rng.uniform(0.5, 3.0, 4)]
    jacobian = rng.standard_normal((20, len(rows))) @ np.array(rows, float)
    if not jacobian.any():
        return
    null = null_space(jacobian)
    if not null.shape[1]:
        return
    names = ("a", "b", "c", "d")
    for b in flat_blocks(names, values, [null, null]):
        for c in b.determined:
            assert c.form in FORMS
            # along every flat direction the value stays, to second order of a small step
            for direction in null.T:
                for v in values:
                    moved = v * np.exp(1e-4 * direction)
                    a = c.value(dict(zip(names, v.tolist(), strict=True)))
                    z = c.value(dict(zip(names, moved.tolist(), strict=True)))
                    assert z == pytest.approx(a, rel=1e-6)
        # integer row spaces with small entries are recovered whole
        if np.abs(rows).max() <= 1:
            assert b.dead or b.complete


def test_words_and_values() -> None:
    assert monomial(("a", "b", "c", "d"), (2, 1, -1, -1)) == "a^2*b/(c*d)"
    assert monomial(("a",), (-1,)) == "1/a"
    c = Combination("sum", ("a", "b"), (2, -1))
    assert str(c) == "2*a - b"
    assert c.value({"a": 3.0, "b": 1.0}) == 5.0
    p = Combination("product", ("a", "b"), (2, -1))
    assert p.value({"a": 3.0, "b": 4.5}) == pytest.approx(2.0)
    slopes = {"a": 3.0, "b": 4.5}
    assert p.gradient({"a": 3.0, "b": 4.5}, slopes) == pytest.approx({"a": 2.0, "b": -1.0})
