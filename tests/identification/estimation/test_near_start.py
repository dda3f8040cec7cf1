"""Where a fit begins: near the noise, if only nuisances and initial states are wrong."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest

from bondgraph.laws import EndStop
from bondgraph.signals.recording import Recording
from identification.estimation import FitStatus, estimate
from identification.estimation.near_start import near_start
from identification.study.study import Study
from tests.settled import simulate
from tests.spring import spring

NOISE = 1e-4


def study(k: float) -> Study:
    """Of a spring with a stop, seen from a moment on at which it moves, with an offset."""
    rng, t = np.random.default_rng(3), np.asarray(5e-3 * np.arange(1600), np.float64)
    force = np.repeat(4.0 * rng.normal(size=80), 20)
    true = spring(0.5, 8.0, 200.0, EndStop(2e3, -0.02, 0.02))
    x = np.asarray(simulate(true, t, {"F": force}, hold="hold")["x"]) + 3e-3
    x += NOISE * rng.standard_normal(t.size)
    cut = slice(210, None)
    recording = Recording("run", t[cut], {"F": force[cut], "x": x[cut]}, {"F": "N", "x": "m"})
    declared = spring(0.5, 8.0, k, EndStop(2e3, -0.02, 0.02))
    return Study(declared, [recording], noise={"x": NOISE}, hold="hold", n_sub=4)


def test_values_that_are_right_stay_where_they_are() -> None:
    stack = study(200.0).stack()
    plain, (begun, found) = stack.start(), near_start(stack)
    assert stack.cost(stack.evaluate(plain, scored=True), plain) > 100
    assert stack.cost(stack.evaluate(begun, scored=True), begun) < 1.5
    assert found is None
    own = list(stack.of_model)
    np.testing.assert_array_equal(begun.theta[own], plain.theta[own])


@pytest.mark.parametrize("k", [120.0, 400.0])
def test_values_that_are_wrong_are_no_place_to_begin_with_nuisances(k: float) -> None:
    stack = study(k).stack()
    plain, (begun, found) = stack.start(), near_start(stack)
    assert found is not None  # not simulated again
    np.testing.assert_array_equal(begun.theta, plain.theta)
    for a, b in zip(begun.states, plain.states, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_stop_before_the_first_step_keeps_the_start_values(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(import_module("identification.estimation.estimate"), "near_start", stopped)
    found = estimate(study(150.0))
    assert found.status is FitStatus.CANCELLED
    assert found.values["k"] == 150.0


def test_no_iteration_is_no_step_of_nuisances() -> None:
    stack = study(200.0).stack()
    begun, found = near_start(stack, 0)
    assert found is None
    np.testing.assert_array_equal(begun.theta, stack.start().theta)
    for a, b in zip(begun.states, stack.start().states, strict=True):
        np.testing.assert_array_equal(a, b)
