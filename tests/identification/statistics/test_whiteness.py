"""False alarms at the stated rate, colour found and named."""

from __future__ import annotations

import numpy as np
import pytest

from identification.statistics.whiteness import runs, whiteness
from tests.identification.validation.made import coloured

TRIALS = 300
BAND = 3.2 * np.sqrt(0.05 * 0.95 / TRIALS)


def test_white_noise_raises_a_false_alarm_in_one_of_twenty() -> None:
    rng = np.random.default_rng(2)
    found = [whiteness(rng.standard_normal(400)) for _ in range(TRIALS)]
    assert np.mean([not w.white for w in found]) == pytest.approx(0.05, abs=BAND)
    assert np.mean([abs(w.runs_z) > 1.96 for w in found]) == pytest.approx(0.05, abs=BAND)
    outside = np.mean([np.abs(w.correlations[1:27]) > w.band for w in found])
    assert outside == pytest.approx(0.05, abs=0.01)


def test_parameters_of_a_simulation_take_no_degrees_of_freedom() -> None:
    rng = np.random.default_rng(3)
    plain, taken = 0, 0
    for _ in range(TRIALS):
        u = coloured(rng, 400, 0.8)
        j = np.stack([np.roll(u, k) for k in range(6)], axis=1)
        e = rng.standard_normal(400)
        r = e - j @ np.linalg.lstsq(j, e, rcond=None)[0]
        plain += not whiteness(r).white
        taken += not whiteness(r, predictor_parameters=6).white
    assert plain / TRIALS == pytest.approx(0.05, abs=BAND)
    assert taken / TRIALS > 0.12  # the textbook count for noise models would be wrong here


def test_parameters_of_a_noise_model_take_one_each() -> None:
    rng = np.random.default_rng(4)
    alarms = 0
    for _ in range(TRIALS):
        e = rng.standard_normal(420)
        for k in range(2, e.size):
            e[k] += 0.6 * e[k - 1] - 0.3 * e[k - 2]
        past = np.stack([e[5 - k : -k] for k in range(1, 6)], axis=1)[20:]
        now = e[5:][20:]
        r = now - past @ np.linalg.lstsq(past, now, rcond=None)[0]
        alarms += not whiteness(r, predictor_parameters=5, lags=15).white
    assert alarms / TRIALS == pytest.approx(0.05, abs=BAND)


def test_colour_is_found_and_named() -> None:
    e = coloured(np.random.default_rng(5), 4000, 0.8)
    w = whiteness(e, dt=1 / 3000)
    assert not w.white
    assert w.predictable == pytest.approx(0.64, abs=0.03)
    assert w.effective == pytest.approx(4000 / 9, rel=0.25)
    # 0.8^k falls below 1.96 / sqrt(4000) at k = 16
    assert 10 <= w.coloured_to <= 22
    assert w.words.startswith(f"coloured up to lag {w.coloured_to} (")
    assert "ms)" in w.words
    assert w.runs_z < -10


def test_one_odd_lag_is_named() -> None:
    rng = np.random.default_rng(6)
    e = rng.standard_normal(3000)
    e[7:] += 0.5 * e[:-7].copy()
    w = whiteness(e, dt=1e-3)
    assert w.coloured_to == 0
    assert "most at lag 7 (7 ms)" in w.words


def test_alternation_has_too_many_runs() -> None:
    assert runs([np.tile([1.0, -1.0], 50)]) > 5
