"""Errors by hand, and the coverage of the block bootstrap."""

from __future__ import annotations

import numpy as np
import pytest

from identification.statistics.bootstrap import mean_interval
from identification.validation.held_out import error

from .made import coloured, record


def test_numbers_by_hand() -> None:
    residual = np.tile([1.0, -3.0], 60)
    simulated = np.tile([0.0, 0.0, 8.0, 8.0], 30)
    r = record(residual, simulated=simulated, floor=2.0, held=0.5)
    e = error(r, 0, "test")
    measured = (simulated + residual)[60:]
    assert e.n == 60
    assert e.rmse == pytest.approx(np.sqrt(5.0))
    assert e.chi2 == pytest.approx(5.0 / 4.0)
    assert e.bias == pytest.approx(-1.0)
    assert e.worst == 3.0
    assert e.fit == pytest.approx(100 * (1 - np.sqrt(5.0) / measured.std()))


def test_samples_without_simulation_do_not_count() -> None:
    residual = np.ones(120)
    residual[80:90] = np.nan
    assert error(record(residual), 0, "test").n == 30


def test_nothing_held_out_is_said_with_nan() -> None:
    e = error(record(np.ones(120), held=0.0), 0, "test")
    assert e.n == 0
    assert np.isnan(e.chi2)


@pytest.mark.parametrize("phi", [0.0, 0.9])
def test_intervals_cover_the_true_mean_square(phi: float) -> None:
    rng = np.random.default_rng(7)
    truth, trials = 1 / (1 - phi**2), 150
    hits = 0
    for _ in range(trials):
        low, high = mean_interval(coloured(rng, 1500, phi) ** 2, draws=400)
        hits += low < truth < high
    # nominal 95 %; a plain bootstrap of phi = 0.9 would cover about 45 %
    assert 0.86 <= hits / trials <= 0.99


def test_a_record_shorter_than_its_memory_gets_no_interval() -> None:
    assert np.isnan(mean_interval(np.linspace(0, 1, 40))).all()
