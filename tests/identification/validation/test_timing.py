"""Delay, gain and offset come back with errors of the right size."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.validation.timing import timing

from .made import coloured

DT = 1e-3
T = DT * np.arange(4000)


def reading(delay: float) -> np.ndarray:
    t = T - delay
    return np.asarray(np.sin(40 * t) + 0.5 * np.sin(73 * t + 1))


def test_known_delay_gain_and_offset() -> None:
    rng = np.random.default_rng(1)
    simulated = reading(0.0)
    measured = 1.02 * reading(0.4 * DT) + 0.03 + 0.005 * rng.standard_normal(T.size)
    found = timing(measured - simulated, simulated, DT, channel="x", unit="m")
    assert found.delay == pytest.approx(0.4 * DT, rel=0.04)
    assert found.gain == pytest.approx(0.02, rel=0.04)
    assert found.offset == pytest.approx(0.03, rel=0.03)
    assert found.removed > 0.9
    assert "0.4 samples) later than the model" in found.words
    assert "2 % larger" in found.words
    assert "shifted by 0.0299 m" in found.words


@pytest.mark.parametrize("phi", [0.0, 0.9])
def test_noise_alone_is_nearly_never_blamed(phi: float) -> None:
    rng = np.random.default_rng(2)
    z, blamed = [], 0
    for _ in range(120):
        t = timing(0.1 * coloured(rng, T.size, phi), reading(0.0), DT)
        z.append([t.delay / t.delay_error, t.gain / t.gain_error, t.offset / t.offset_error])
        blamed += t.words != "delay, gain and offset are right"
    assert blamed <= 3
    assert np.mean(np.abs(z) > 1.96) == pytest.approx(0.05, abs=0.05)


def test_a_gain_about_a_mean_is_no_offset() -> None:
    rng = np.random.default_rng(3)
    simulated = 5.0 + reading(0.0)
    found = timing(0.02 * simulated + 1e-3 * rng.standard_normal(T.size), simulated, DT, unit="V")
    assert "2 % larger" in found.words
    assert "shifted" not in found.words
    assert abs(found.offset) < 4 * found.offset_error
    moved = timing(found.gain * simulated + 0.3, simulated, DT, unit="V")
    assert moved.offset == pytest.approx(0.3, rel=1e-6)
    assert "shifted by 0.3 V" in moved.words


def test_a_reading_that_does_not_follow_at_all_has_no_delay() -> None:
    simulated = reading(0.0)
    found = timing(-simulated, simulated, DT)  # the sensor reads zero
    assert found.gain == pytest.approx(-1.0)
    assert (found.delay, found.delay_error) == (0.0, np.inf)
    assert "later" not in found.words
    assert "smaller" in found.words


def test_a_simulation_at_rest_is_refused() -> None:
    with pytest.raises(UnusableInput, match="does not move"):
        timing(np.ones(100), np.zeros(100), DT, channel="x")
