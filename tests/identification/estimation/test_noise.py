"""Noise from residuals: orders and levels, and intervals that hold for coloured noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import FloatArray as Array
from identification.estimation import Estimation, estimate
from identification.estimation.settling import same_setting
from identification.statistics.autoregression import innovations, whitening_filter
from tests.identification.estimation.plants import TRUTH, force, misses, moved, record, study

COLOURS = {"first order": [1.0, -0.9], "second order": [1.0, -1.5, 0.8]}
LEVEL = 1e-4


def coloured(polynomial: list[float], n: int, seed: int) -> Array:
    white = np.random.default_rng(seed).standard_normal(n + 500)
    return np.asarray(lfilter([1.0], polynomial, white)[500:])


@pytest.mark.parametrize("polynomial", COLOURS.values(), ids=COLOURS.keys())
def test_polynomial_and_innovations_are_found(polynomial: list[float]) -> None:
    e = coloured(polynomial, 8000, 1)
    found = whitening_filter(e)
    assert found.size == len(polynomial)
    assert found == pytest.approx(polynomial, abs=0.03)
    left = innovations(e - e.mean(), found)
    assert left.size == e.size - found.size + 1
    assert left.std() == pytest.approx(1.0, abs=0.03)
    assert abs(np.corrcoef(left[1:], left[:-1])[0, 1]) < 0.03


def test_white_constant_and_short_residuals_have_no_colour() -> None:
    rng = np.random.default_rng(0)
    assert whitening_filter(rng.standard_normal(5000)).tolist() == [1.0]
    assert whitening_filter(np.full(100, 3.0)).tolist() == [1.0]
    assert whitening_filter(np.zeros(100)).tolist() == [1.0]
    for n in (1, 2, 5, 9):
        assert whitening_filter(rng.standard_normal(n)).tolist() == [1.0]
    assert whitening_filter(coloured([1.0, -0.9], 30, 2)).size <= 4


def test_filter_is_stable_for_a_drift() -> None:
    found = whitening_filter(np.cumsum(np.random.default_rng(0).standard_normal(400)))
    assert np.abs(np.roots(found)).max() < 1.0


def noisy(polynomial: list[float], seed: int, n: int = 1200) -> Recording:
    u = force(n, 100.0, seed)
    x = moved(u, 100.0) + LEVEL * coloured(polynomial, n, 700 + seed)
    return Recording.from_arrays("noisy", {"F[N]": u, "x[m]": x}, fs=100.0)


@pytest.mark.parametrize("polynomial", COLOURS.values(), ids=COLOURS.keys())
def test_coloured_noise_is_estimated_with_the_parameters(polynomial: list[float]) -> None:
    found = estimate(study(noisy(polynomial, 1, 4000), noise="coloured"))
    assert found.setting.floors[0] == pytest.approx(LEVEL, rel=0.04)
    (heard,) = found.setting.whitening[0]
    assert heard.size == len(polynomial)
    assert heard == pytest.approx(polynomial, abs=0.05)
    assert max(misses(found, TRUTH).values()) < 3.3


def scores(found: Estimation) -> list[float]:
    signs = [np.sign(found.values[n] - t) for n, t in TRUTH.items()]
    return [float(s * v) for s, v in zip(signs, misses(found, TRUTH).values(), strict=True)]


@pytest.mark.parametrize("noise", ["coloured", "white"])
def test_intervals_hold_for_coloured_noise(noise: str) -> None:
    """White noise is assumed in vain: the intervals are then robust ones, and say so."""
    every, notes = [], []
    for seed in range(16):
        found = estimate(study(noisy(COLOURS["second order"], seed), noise=noise))
        every += scores(found)
        notes.append(any("robust" in n for n in found.notes))
        advised = any("noise='coloured'" in n for n in found.notes)
        assert advised == (notes[-1] and noise == "white")
    assert 0.65 < np.std(every) < 1.45
    assert np.mean(np.abs(every) < 1.96) > 0.84
    assert np.mean(notes) > 0.9 if noise == "white" else np.mean(notes) < 0.3


def test_known_noise_is_kept() -> None:
    found = estimate(study(record(), noise={"x": 5e-4}))
    assert found.setting.floors[0].tolist() == [5e-4]
    assert found.cost == pytest.approx((2e-4 / 5e-4) ** 2, rel=0.15)
    narrow = estimate(study(record(), noise={"x": 2e-4}))
    ratio = np.diff(found.estimate_of("k").ci95) / np.diff(narrow.estimate_of("k").ci95)
    assert ratio[0] == pytest.approx(2.5, rel=1e-2)


def test_noise_far_above_what_was_given_is_said() -> None:
    found = estimate(study(record(), noise={"x": 2e-6}))
    assert any("misfit is above the noise given" in n for n in found.notes)


def test_noise_of_nanometres_settles_as_noise_of_metres_does() -> None:
    begun = study(record(60)).first_setting
    for unit in (1.0, 1e-9):
        one, near, other = (
            replace(begun, floors=(np.array([unit * level]),)) for level in (1.0, 1.01, 1.5)
        )
        assert same_setting(one, near, 0.02)
        assert not same_setting(one, other, 0.02)
