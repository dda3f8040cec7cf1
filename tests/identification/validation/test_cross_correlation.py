"""False alarms at the stated rate whatever the colours; lags named rightly."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.validation.cross_correlation import cross_correlation

from .made import coloured


@pytest.mark.parametrize(("of_residual", "of_input"), [(0.0, 0.0), (0.9, 0.0), (0.9, 0.9)])
def test_independent_series_raise_false_alarms_at_the_level(
    of_residual: float, of_input: float
) -> None:
    rng = np.random.default_rng(8)
    found = [
        cross_correlation(coloured(rng, 600, of_residual), coloured(rng, 600, of_input))
        for _ in range(150)
    ]
    assert np.mean([c.causal for c in found]) < 0.11
    assert np.mean([c.anticausal for c in found]) < 0.11
    outside = np.mean([np.abs(c.correlations) > c.band for c in found])
    assert outside == pytest.approx(0.05, abs=0.012)


def test_missing_dynamics_follow_the_input() -> None:
    rng = np.random.default_rng(9)
    u = coloured(rng, 4000, 0.8)
    response = 0.85 ** np.arange(30)
    e = np.convolve(u, response)[:4000] + 2 * rng.standard_normal(4000)
    c = cross_correlation(e, u, dt=1e-3, name="F")
    assert c.causal
    assert not c.anticausal
    assert not c.regular
    assert c.words.startswith("follows F most at lag 0")
    assert c.words.endswith("dynamics are missing")
    # the whitened correlation is the missing response: it decays like 0.85^k
    r = c.correlations[c.lags >= 0]
    assert r[5] / r[1] == pytest.approx(0.85**4, abs=0.12)


def test_a_delayed_path_is_named_with_its_lag() -> None:
    rng = np.random.default_rng(10)
    u = rng.standard_normal(4000)
    e = 0.3 * np.roll(u, 12) + rng.standard_normal(4000)
    c = cross_correlation(e, u, dt=1e-3, name="F", level=0.01)
    assert "most at lag 12 (12 ms) alone: a path delayed by 12 samples" in c.words


def test_feedback_runs_ahead() -> None:
    rng = np.random.default_rng(11)
    e = rng.standard_normal(4000)
    u = coloured(rng, 4000, 0.7) - 0.8 * np.roll(e, 3)
    c = cross_correlation(e, u, name="F", level=0.01)
    assert c.anticausal
    assert not c.causal
    assert "runs ahead of F most at lag -3" in c.words
    assert "feedback" in c.words


def test_a_wrong_hold_runs_ahead_by_one_sample() -> None:
    rng = np.random.default_rng(13)
    u = rng.standard_normal(4000)
    # the plant answers the mean of this and the next sample, the model to this one alone
    e = 0.5 * (np.roll(u, -1) - u) + rng.standard_normal(4000)
    c = cross_correlation(e, u, name="F", level=0.01)
    assert "runs ahead of F most at lag -1" in c.words
    assert "between samples (hold)" in c.words


def test_a_periodic_input_has_no_lags_to_tell_apart() -> None:
    rng = np.random.default_rng(12)
    u = np.tile(rng.standard_normal(200), 20)
    e = 0.2 * u + rng.standard_normal(u.size)
    c = cross_correlation(e, u, name="F")
    assert c.regular
    assert "too regular to tell lags apart" in c.words


def test_an_input_at_rest_is_refused() -> None:
    with pytest.raises(UnusableInput, match="V does not move where x is scored"):
        cross_correlation(np.random.default_rng(0).standard_normal(100), np.ones(100),
                          channel="x", name="V")  # fmt: skip
