"""Information: against closed forms, with the sandwich on coloured noise, and flat directions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from bondgraph.support.errors import UnknownName, UnusableInput
from identification.statistics.blocks import block_rows, block_scores, blocks_for, sandwich
from identification.uncertainty.information import Sensitivities, information
from identification.uncertainty.statements import trade_offs


def line(n: int = 400) -> np.ndarray:
    t = np.linspace(0, 1, n)
    return np.column_stack([np.ones(n), t])


def test_covariance_of_a_straight_line() -> None:
    j = line()
    s = Sensitivities(("a", "b"), np.array([1.0, 2.0]), j * [1.0, 2.0], (False, False))
    info = information(s)
    closed = np.linalg.inv(j.T @ j)
    assert info.standard_errors * s.slopes == pytest.approx(np.sqrt(np.diag(closed)))
    assert info.correlation[0, 1] == pytest.approx(
        closed[0, 1] / np.sqrt(closed[0, 0] * closed[1, 1])
    )
    low, high = info.interval("b")
    assert (high - low) / 2 == pytest.approx(1.959964 * np.sqrt(closed[1, 1]))
    assert not info.null.size


def test_logarithmic_interval_is_a_factor() -> None:
    s = Sensitivities(("k",), np.array([5.0]), np.full((100, 1), 2.0))
    low, high = information(s).interval("k")
    assert low * high == pytest.approx(25.0)
    assert np.log(high / 5.0) == pytest.approx(1.959964 / 20.0)


def test_prior_counts_like_a_measurement() -> None:
    s = Sensitivities(("k",), np.array([5.0]), np.zeros((10, 1)))
    assert np.isinf(information(s).standard_errors[0])
    assert information(s, prior=np.array([4.0])).standard_errors[0] == pytest.approx(0.5)


def test_flat_parameters_have_open_intervals_and_others_not() -> None:
    rng = np.random.default_rng(0)
    j = rng.standard_normal((50, 2)) @ np.array([[1.0, -1.0, 0.0], [0.0, 0.0, 2.0]])
    info = information(Sensitivities(("k", "m", "d"), np.array([2.0, 3.0, 4.0]), j))
    assert info.flat.tolist() == [True, True, False]
    assert info.interval("k") == (0.0, float("inf"))
    assert np.isfinite(info.standard_errors[2])
    assert info.error_of(np.array([1.0, -1.0, 0.0])) < 0.5
    assert np.isnan(info.correlation[0, 1])


def test_dead_and_weak_columns_are_told_apart() -> None:
    rng = np.random.default_rng(1)
    j = rng.standard_normal((60, 3)) * [1e6, 1e-5, 0.0]
    info = information(Sensitivities(("a", "b", "c"), np.ones(3), j))
    assert info.flat.tolist() == [False, False, True]


def test_sandwich_covers_coloured_noise_where_the_plain_one_does_not() -> None:
    j = line(2000)
    rng = np.random.default_rng(2)
    sure = np.linalg.inv(j.T @ j)
    plain, robust = [], []
    for _ in range(150):
        r = lfilter([np.sqrt(1 - 0.81)], [1.0, -0.9], rng.standard_normal(2300))[300:]
        found = sure @ j.T @ r
        left = r - j @ found
        s = Sensitivities(("a", "b"), np.ones(2), j, (False, False))
        plain.append(abs(found[1]) < 1.96 * information(s).standard_errors[1])
        robust.append(abs(found[1]) < 1.96 * information(s, left).standard_errors[1])
    assert np.mean(plain) < 0.65
    assert np.mean(robust) > 0.88


def test_white_residuals_leave_the_plain_covariance_nearly_alone() -> None:
    rng = np.random.default_rng(3)
    j = line(4000)
    s = Sensitivities(("a", "b"), np.ones(2), j, (False, False))
    robust = information(s, rng.standard_normal(4000)).standard_errors
    plain = information(s).standard_errors
    assert (robust >= plain * (1 - 1e-12)).all()
    assert (robust < 1.5 * plain).all()


def test_blocks_grow_with_the_memory_of_the_residuals() -> None:
    rng = np.random.default_rng(4)
    white = rng.standard_normal(4000)
    slow = lfilter([1.0], [1.0, -0.98], white)
    assert blocks_for(white) == 40
    assert blocks_for(slow) < 25


def test_two_channels_are_cut_at_the_same_times() -> None:
    rows = block_rows(20, (10, 10), 5)
    assert len(rows) == 5
    assert rows[0].tolist() == [0, 1, 10, 11]
    assert sorted(np.concatenate(rows).tolist()) == list(range(20))
    with pytest.raises(UnusableInput, match="do not add up"):
        block_rows(20, (10, 9))


def test_windows_are_blocks_and_only_the_readings_of_one_are_cut_together() -> None:
    # two windows of two readings each, of equal length: cut within each window alone
    rows = block_rows(40, (10, 10, 10, 10), 4, readings=(2, 2))
    assert [sorted(r.tolist()) for r in rows[:2]] == [
        [*range(5), *range(10, 15)], [*range(5, 10), *range(15, 20)]
    ]  # fmt: skip
    # many windows stay whole, neighbours in one block
    rows = block_rows(480, (20,) * 24, 12, readings=(1,) * 24)
    assert [r.tolist() for r in rows] == [list(range(a, a + 40)) for a in range(0, 480, 40)]
    with pytest.raises(UnusableInput, match="readings"):
        block_rows(40, (20, 20), 4, readings=(1,))


def test_the_sandwich_on_windows_covers_coloured_noise() -> None:
    """The variance of a slope under slow noise, with the record cut into short windows."""
    rng, n, length = np.random.default_rng(0), 1920, 24
    x = lfilter([1.0], [1.0, -0.95], rng.standard_normal(n))[:, None]
    v, sizes, one = np.linalg.inv(x.T @ x), (length,) * (n // length), (1,) * (n // length)
    true, told = [], []
    for _ in range(60):
        e = lfilter([1.0], [1.0, -0.9], rng.standard_normal(n + 200))[200:]
        true.append((v @ x.T @ e)[0])
        rows = block_rows(n, sizes, blocks_for(e, sizes, one), readings=one)
        told.append(float((v @ (s := block_scores(x, e, rows, v)).T @ s @ v)[0, 0]))
    assert np.mean(told) == pytest.approx(np.var(true), rel=0.45)


def test_jackknifed_scores_of_a_mean_are_those_of_leaving_blocks_out() -> None:
    r = np.random.default_rng(5).standard_normal(40)
    r -= r.mean()
    j, v = np.ones((40, 1)), np.array([[1 / 40]])
    scores = block_scores(j, r, block_rows(40, (), 4), v)
    # leaving block b out moves the mean by minus the covariance times its score
    left = [np.delete(r, p).mean() for p in block_rows(40, (), 4)]
    assert -scores[:, 0] / 40 == pytest.approx(left)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.floats(1e-6, 1e6))
def test_standard_errors_do_not_depend_on_the_unit(seed: int, factor: float) -> None:
    rng = np.random.default_rng(seed)
    j = rng.standard_normal((30, 3))
    values = rng.uniform(0.5, 2.0, 3)
    one = information(Sensitivities(("a", "b", "c"), values, j))
    # a linear parameter in another unit: value and scale change, the column per scale does not
    other = information(
        Sensitivities(("a", "b", "c"), values * [1, 1, factor], j, (True, True, False))
    )
    assert other.standard_errors == pytest.approx(one.standard_errors)
    si = [i.standard_errors * i.sensitivities.slopes for i in (one, other)]
    assert si[1][2] == pytest.approx(si[0][2] * factor)


def test_bad_shapes_and_names_are_said() -> None:
    with pytest.raises(UnusableInput, match="one value and one column"):
        Sensitivities(("a",), np.ones(2), np.ones((3, 1)))
    with pytest.raises(UnusableInput, match="column of b"):
        Sensitivities(("a", "b"), np.ones(2), np.array([[1.0, np.nan]]))
    with pytest.raises(UnknownName, match="no free parameter"):
        information(Sensitivities(("a",), np.ones(1), np.ones((3, 1)))).interval("did_not")


def test_what_only_a_prior_tells_keeps_the_error_of_the_prior() -> None:
    """Student's factor is for the few blocks, of which a prior has none."""
    j = np.column_stack([np.random.default_rng(5).standard_normal(400), np.zeros(400)])
    residual, prior = np.random.default_rng(6).standard_normal(400), np.array([0.0, 4.0])
    inverse = np.diag(1.0 / (np.sum(j**2, axis=0) + prior))
    assert sandwich(j, residual, inverse, prior)[1, 1] == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("form", "said"), [("sum", "b_m + b_l is known to"), ("reciprocals", "1/b_m + 1/b_l is known")]
)
def test_two_of_one_unit_that_make_up_for_each_other_are_told_as_their_sum(
    form: str, said: str
) -> None:
    rng, values = np.random.default_rng(4), np.array([27e-6, 111e-6])
    each = values if form == "sum" else 1.0 / values
    j = rng.standard_normal((300, 1)) * each / each.sum() * 100.0
    j += 0.3 * rng.standard_normal((300, 2)) * [1.0, -0.5]
    s = Sensitivities(("b_m", "b_l"), values, j, units=("N*m*s/rad", "N*m*s/rad"))
    (pair,) = trade_offs(information(s), s, 0.98, set())
    assert said in pair.text
