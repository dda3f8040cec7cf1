"""Weights of plays from records: recovery, unexcited plays, unknown past, errors, speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    BadInput,
    BadMemory,
    BadParameter,
    PrandtlIshlinskii,
)
from bondgraph.hysteresis.fitting import fit_weights
from bondgraph.hysteresis.fitting.starting import forgotten_at
from tests.counted import calls

quick = settings(max_examples=20, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)


def random_truth(rng: np.random.Generator, n: int) -> PrandtlIshlinskii:
    """Weights of either sign with slopes in [0.3, 3], thresholds below 4."""
    slopes = rng.uniform(0.3, 3.0, n + 1)
    thresholds = np.append(0.0, np.cumsum(rng.uniform(0.5, 1.0, n)) * 4.0 / max(n, 1))
    return PrandtlIshlinskii(tuple(thresholds), tuple(np.diff(slopes, prepend=0.0)))


def sweep(n_samples: int = 3000, amplitude: float = 5.0) -> np.ndarray:
    """A sine of growing amplitude: it moves every play below the amplitude."""
    t = np.linspace(0.0, 1.0, n_samples)
    return amplitude * t * np.sin(40.0 * t)


@quick
@given(seed=seeds, n=st.integers(0, 12))
def test_exact_records_give_the_weights_back(seed: Any, n: Any) -> None:
    rng = np.random.default_rng(seed)
    truth = random_truth(rng, n)
    memory = truth.initial_memory(0.0, tuple(rng.uniform(-2, 2, n)))
    y, _ = truth.run(sweep(), memory)
    fit = fit_weights(truth, sweep(), y + 7.0, memory=memory, offset=True)
    np.testing.assert_allclose(fit.weights, truth.weights, atol=1e-8)
    assert fit.offset == pytest.approx(7.0, abs=1e-8)
    assert fit.operator.thresholds == truth.thresholds
    assert fit.rms < 1e-11


@quick
@given(seed=seeds)
def test_noisy_records_give_the_weights_within_their_errors(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    truth = random_truth(rng, 8)
    y = truth.run(sweep())[0] + rng.normal(0.0, 0.02, 3000)
    fit = fit_weights(truth.thresholds, sweep(), y)
    assert fit.active == ()
    assert np.any(fit.weights < 0.0)
    assert np.max(np.abs(fit.weights - truth.weights) / fit.standard_errors) < 5.0
    assert fit.rms == pytest.approx(0.02, rel=0.06)
    fit.operator.check_invertible()


def test_prefix_sums_keep_a_falling_branch_invertible() -> None:
    """The truth has a slope of -0.2: the fit stops at the smallest slope, and has an inverse."""
    truth = PrandtlIshlinskii((0.0, 1.0, 2.0), (1.0, -1.2, 1.0))
    y, _ = truth.run(sweep())
    fit = fit_weights(truth, sweep(), y, minimum=0.05)
    assert fit.active == (1,)
    assert np.cumsum(fit.weights)[1] == pytest.approx(0.05)
    z, _ = fit.operator.run(sweep())
    np.testing.assert_allclose(fit.operator.inverse().run(z)[0], sweep(), atol=1e-10)
    free = fit_weights(truth, sweep(), y, "none")
    np.testing.assert_allclose(free.weights, truth.weights, atol=1e-9)
    assert free.rms < 1e-12 < fit.rms


def test_the_default_minimum_is_a_thousandth_of_the_mean_slope() -> None:
    truth = PrandtlIshlinskii((0.0, 1.0, 2.0), (1.0, -1.2, 1.0))
    y, _ = truth.run(sweep())
    fit = fit_weights(truth, sweep(), y)
    assert np.cumsum(fit.weights)[1] == pytest.approx(1e-3 * np.ptp(y) / np.ptp(sweep()))


def test_constraints_from_loose_to_tight() -> None:
    """On noisy data of an operator with a small negative weight."""
    rng = np.random.default_rng(0)
    truth = PrandtlIshlinskii((0.0, 0.5, 1.0, 2.0, 3.0), (1.0, 0.4, -0.3, 0.3, 0.2))
    y = truth.run(sweep())[0] + rng.normal(0.0, 0.02, 3000)
    free, sums, positive = (
        fit_weights(truth, sweep(), y, c) for c in ("none", "prefix_sums", "non_negative")
    )
    np.testing.assert_allclose(sums.weights, free.weights, atol=1e-9)
    assert free.rms == pytest.approx(sums.rms, rel=1e-9)
    assert positive.rms > 1.1 * sums.rms
    assert 2 in positive.active
    assert np.all(positive.weights >= 0.0)
    assert positive.weights[0] > 0.0


def test_scales_do_not_matter() -> None:
    """Volts in, nanometres out."""
    truth = Ang.stack_2hz().play
    x = 60.0 * np.sin(np.linspace(0.0, 15.0, 2000)) * np.linspace(0.2, 1.0, 2000)
    fit = fit_weights(truth, x, truth.run(x)[0])
    np.testing.assert_allclose(fit.weights, truth.weights, atol=1e-10 * max(truth.weights))


def unipolar(periods: int = 3, samples: int = 1000) -> np.ndarray:
    """0..100 from 0."""
    return 50.0 - 50.0 * np.cos(2.0 * np.pi * np.arange(periods * samples + 1) / samples)


def test_what_a_unipolar_record_says() -> None:
    """r < 50 move in the loops, 50 <= r < 100 in the virgin ramp only, r >= 100 never."""
    thresholds = (0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 120.0)
    truth = PrandtlIshlinskii(thresholds, (1.0, 0.5, 0.4, 0.3, 0.2, 0.1, 0.1))
    x = unipolar()
    fit = fit_weights(thresholds, x, truth.run(x)[0])
    np.testing.assert_allclose(fit.weights, (1.0, 0.5, 0.4, 0.3, 0.2, 0.0, 0.0), atol=1e-10)
    found = {s.index: s for s in fit.unexcited}
    assert {i: s.action for i, s in found.items()} == {
        3: "kept",
        4: "kept",
        5: "dropped",
        6: "dropped",
    }
    assert "virgin ramp" in found[3].reason
    assert "r < 50" in found[3].reason
    assert found[6].name == "play 6 (r = 120)"
    assert "never moves" in found[6].reason
    assert "r < 50 move in a loop" in str(found[6])
    assert np.isinf(fit.standard_errors[5:]).all()


def test_a_steady_loop_alone_moves_only_small_plays() -> None:
    thresholds = (0.0, 20.0, 40.0, 60.0, 80.0)
    truth = PrandtlIshlinskii(thresholds, (1.0, 0.5, 0.4, 0.3, 0.2))
    x = unipolar()
    y, _ = truth.run(x)
    fit = fit_weights(thresholds, x[1000:], y[1000:], memory="unknown", offset=True)
    np.testing.assert_allclose(fit.weights, (1.0, 0.5, 0.4, 0.0, 0.0), atol=1e-9)
    assert [s.index for s in fit.unexcited] == [3, 4]
    assert "unknown past" in fit.unexcited[0].reason
    # The standing plays of 60 and 80 hold x_max - r each.
    assert fit.offset == pytest.approx(0.3 * 40.0 + 0.2 * 20.0)


def test_forgetting_is_complete_and_not_too_late() -> None:
    """From the stated sample on, plays started high and low agree; one sample before, not."""
    rng = np.random.default_rng(5)
    x = np.cumsum(rng.normal(size=400))
    r = np.linspace(0.3, np.ptp(x), 30)
    bank = PrandtlIshlinskii((0.0, *r), (1.0,) * 31)
    high, low = (
        bank.regressors(x, tuple(x[0] + side * np.array(bank.thresholds[1:])))[:, 1:]
        for side in (1.0, -1.0)
    )
    differ = ~np.isclose(high, low, rtol=0.0, atol=1e-12)
    expected = np.where(differ.any(axis=0), x.size - np.argmax(differ[::-1], axis=0), 0)
    np.testing.assert_array_equal(forgotten_at(x, r), expected)
    assert np.any(expected == x.size)
    assert np.any(expected < 100)


@quick
@given(seed=seeds)
def test_unknown_past_does_not_bias(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    truth = random_truth(rng, 6)
    x = 5.0 * np.sin(np.linspace(0.0, 30.0, 2000)) * np.linspace(1.0, 0.3, 2000)
    memory = truth.initial_memory(0.0, tuple(rng.uniform(-5, 5, 6)))
    y, _ = truth.run(x, memory)
    fit = fit_weights(truth, x, y, memory="unknown")
    assert 0 < fit.start < 1000
    np.testing.assert_allclose(fit.weights, truth.weights, atol=1e-8)
    modelled = fit.operator.run(x[fit.start :], fit.memory)[0]
    np.testing.assert_allclose(modelled, y[fit.start :], atol=1e-9)


def test_plays_that_forget_too_late_are_given_up() -> None:
    x = np.concatenate((unipolar(8, 100), [140.0, 0.0]))
    truth = PrandtlIshlinskii((0.0, 20.0, 60.0), (1.0, 0.5, 0.2))
    y, _ = truth.run(x)
    fit = fit_weights(truth, x, y, memory="unknown", offset=True)
    assert fit.start < 100
    assert fit.weights[2] == 0.0
    assert [s.index for s in fit.unexcited] == [2]
    assert "unknown past" in fit.unexcited[0].reason


@pytest.mark.parametrize("constraint", ["prefix_sums", "non_negative", "none"])
@pytest.mark.parametrize("past", [None, "unknown"])
def test_the_stated_misfit_is_the_one_of_the_operator(constraint: Any, past: Any) -> None:
    """Plays fitted to the loop of another operator, over several blocks of samples."""
    x = np.resize(unipolar(1, 20000)[:-1], 70001)
    y = 1e9 * AlJanaideh.stack_2hz().run(x)[0]
    fit = fit_weights(np.linspace(0.0, 48.0, 13), x, y, constraint, memory=past, offset=True)
    modelled = fit.operator.run(x[fit.start :], fit.memory)[0] + fit.offset
    misfit = np.sqrt(np.mean((modelled - y[fit.start :]) ** 2))
    assert fit.rms == pytest.approx(misfit, rel=1e-9)
    assert fit.rms < 0.02 * np.ptp(y)


def test_forty_weights_on_a_long_record_take_blocks_and_not_samples() -> None:
    truth = random_truth(np.random.default_rng(0), 39)

    def work(n: int) -> int:
        x = sweep(n)
        y, _ = truth.run(x)
        found = []
        count = calls(lambda: found.append(fit_weights(truth, x, y)))
        assert found[0].rms < 1e-9 * np.ptp(y)
        return count

    work(1024)
    assert work(32768) < 4 * work(4096)


RISE = [0.0, 1.0, 2.0, 3.0, 1.0]


@pytest.mark.parametrize(
    ("thresholds", "x", "y", "options", "error", "words"),
    [
        ((0, 1), [0, np.nan, 1, np.nan], [0, 1, 2, 3], {}, BadInput, r"x\[1\] = nan"),
        ((0, 1), RISE, [0, 1, 2, np.nan, 1], {}, BadInput, r"y\[3\] = nan"),
        ((0, 1), RISE, [0, 1], {}, BadInput, "x has 5 samples but y has 2"),
        ((0, 1), [2.0] * 5, RISE, {}, BadInput, "x is constant at 2"),
        ((0, 1), RISE, [3.0] * 5, {}, BadInput, "y is constant at 3"),
        ((0, 1), [], [], {}, BadInput, "x must have shape"),
        ((0, 1), [RISE], [RISE], {}, BadInput, "x must have shape"),
        ((0, 2, 1), RISE, RISE, {}, BadParameter, r"thresholds\[2\] = 1.0 is not above"),
        ((0, -1), RISE, RISE, {}, BadParameter, r"thresholds\[1\] = -1"),
        ((1, 2), RISE, RISE, {}, BadParameter, r"thresholds\[0\] = 1.0 must be 0"),
        ((), RISE, RISE, {}, BadParameter, "missing"),
        ("01", RISE, RISE, {}, BadParameter, "sequence of numbers"),
        (1.0, RISE, RISE, {}, BadParameter, "thresholds = 1.0 must be a sequence"),
        (range(9), RISE, RISE, {}, BadInput, "5 samples cannot determine 9 weights"),
        ((0, 1), RISE, [-v for v in RISE], {}, BadInput, "y falls where x rises"),
        ((0, 1), RISE, RISE, {"memory": (0, 0)}, BadMemory, "1 memory states"),
        ((0, 1), RISE, RISE, {"memory": "none"}, BadParameter, "'none'"),
        ((0, 9), RISE, RISE, {"memory": "unknown"}, BadInput, "smallest, r = 9"),
        ((0, 1), RISE, RISE, {"scored_share": 1.0}, BadParameter, "scored_share = 1.0"),
        ((0, 1), RISE, RISE, {"minimum": -1.0}, BadParameter, "minimum = -1"),
        ((0, 1), RISE, RISE, {"constraint": "sums"}, BadParameter, "'sums'"),
    ],
)
def test_bad_input_is_named(
    thresholds: Any, x: Any, y: Any, options: Any, error: Any, words: Any
) -> None:
    with pytest.raises(error, match=words):
        fit_weights(thresholds, x, y, **options)
