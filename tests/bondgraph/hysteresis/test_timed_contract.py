"""What timed and composed operators promise, beside what every operator does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.hysteresis import BadInput
from bondgraph.hysteresis.composed.cascade import inverse_memory_of
from bondgraph.support.ops import NUMPY
from tests.bondgraph.hysteresis.examples import (
    FORWARD,
    STEP,
    WITH_INVERSES,
    invertible,
    step_by_step,
    wander,
    wandered_memory,
)

INVERTIBLE = invertible(FORWARD)
every = pytest.mark.parametrize("operator", WITH_INVERSES.values(), ids=WITH_INVERSES.keys())
each_invertible = pytest.mark.parametrize("operator", INVERTIBLE.values(), ids=INVERTIBLE.keys())


@pytest.mark.sampled(every=3)
@every
def test_run_equals_steps(operator: Any) -> None:
    for seed in range(5):
        memory, _ = wandered_memory(operator, seed)
        x = wander(seed + 100, n=40)
        fast, after_fast = operator.run(x, memory, step=STEP)
        slow, after_slow = step_by_step(operator, x, memory)
        np.testing.assert_allclose(fast, slow, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(after_slow, after_fast, rtol=1e-10, atol=1e-10)


@every
def test_run_in_pieces(operator: Any) -> None:
    x = wander(5, n=2_001)
    whole, after = operator.run(x, step=STEP)
    first, between = operator.run(x[:700], step=STEP)
    second, last = operator.run(x[700:], between, step=STEP)
    np.testing.assert_allclose(whole, np.concatenate((first, second)), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(after, last, rtol=1e-12, atol=1e-12)


@every
def test_a_timed_operator_needs_its_step(operator: Any) -> None:
    if operator.timed:
        for bad in (None, 0.0, -1.0, np.nan):
            with pytest.raises(BadInput, match="give step"):
                operator.run([0.0, 1.0], step=bad)
    else:
        operator.run([0.0, 1.0])


@every
def test_linear_slope_is_the_slope_of_a_small_jump(operator: Any) -> None:
    memory = operator.advance(NUMPY, 0.0, operator.initial_memory(0.0))
    h = 1e-3
    quotient = (operator.value(NUMPY, h, memory) - operator.value(NUMPY, 0.0, memory)) / h
    assert float(quotient) == pytest.approx(operator.linear_slope, rel=1e-9)


@each_invertible
def test_inverse_from_a_memory_with_a_past(operator: Any) -> None:
    for seed in range(12):
        memory, _ = wandered_memory(operator, seed)
        x = wander(seed + 7)
        z, after = operator.run(x, memory, step=STEP)
        before = inverse_memory_of(NUMPY, operator, memory)
        back, after_back = operator.inverse().run(z, before, step=STEP)
        np.testing.assert_allclose(back, x, rtol=0, atol=2e-12 * np.max(np.abs(x)))
        end = inverse_memory_of(NUMPY, operator, after)
        # a rate is a difference over the step, and rounding grows with it
        np.testing.assert_allclose(after_back, end, rtol=1e-9, atol=1e-10)


@each_invertible
def test_inverse_of_the_inverse(operator: Any) -> None:
    x = wander(4)
    again = operator.inverse().inverse()
    np.testing.assert_allclose(
        again.run(x, step=STEP)[0], operator.run(x, step=STEP)[0], atol=1e-11
    )


@every
def test_claims_hold(operator: Any) -> None:
    """Without time: a minor excursion leaves no trace; equal minor loops if congruent."""
    if operator.timed:
        assert not operator.wipes_out
        assert not operator.congruent
        return
    loops = []
    for seed in range(10):
        memory, _ = wandered_memory(operator, seed)
        minor = np.random.default_rng(seed).uniform(-1.0, 1.5, 10)
        _, plain = operator.run([-1.0, 1.5], memory)
        _, detour = operator.run([-1.0, 1.5, *minor, 1.5], memory)
        if operator.wipes_out:
            np.testing.assert_allclose(plain, detour, rtol=1e-14, atol=1e-14)
        up = np.linspace(-1, 1.5, 40)
        loops.append(np.ptp(operator.run([1.5, -1.0, *up, *up[::-1]], memory)[0][2:]))
    if operator.congruent:
        assert np.ptp(loops) < 1e-12
