"""Criteria by hand, and the likelihood ratio at its stated rate for white and coloured noise."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.statistics.correlation import autocorrelation, pieces_of
from identification.statistics.criteria import ResidualLevel, criteria, likelihood_ratio
from identification.statistics.memory import memory
from tests.identification.validation.made import coloured


def test_criteria_by_hand() -> None:
    found = criteria([ResidualLevel(4.0, 100, 2.0), ResidualLevel(1.0, 60)], n_free=3)
    assert (found.n, found.effective, found.parameters) == (160, 110, 5)
    assert found.aic == pytest.approx(50 * np.log(4.0) + 10)
    assert found.aicc == pytest.approx(found.aic + 60 / 104)
    assert found.bic == pytest.approx(50 * np.log(4.0) + 5 * np.log(110))


def test_more_parameters_than_samples_have_no_aicc() -> None:
    assert criteria([ResidualLevel(1.0, 5)], n_free=8).aicc == np.inf


def _level(design: np.ndarray, y: np.ndarray) -> ResidualLevel:
    r = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
    found = memory(autocorrelation(pieces_of(r), r.size // 4), r.size)
    return ResidualLevel(float(np.mean(r**2)), r.size, found)


@pytest.mark.parametrize("phi", [0.0, 0.8])
def test_likelihood_ratio_raises_false_alarms_at_its_rate(phi: float) -> None:
    rng = np.random.default_rng(4)
    n, trials = 1000, 200
    t = np.linspace(-1, 1, n)
    few, many = np.stack([t**k for k in range(2)], 1), np.stack([t**k for k in range(4)], 1)
    counted, plain = 0, 0
    for _ in range(trials):
        y = coloured(rng, n, phi)
        a, b = _level(few, y), _level(many, y)
        counted += likelihood_ratio([a], [b], 2).p < 0.05
        white = [ResidualLevel(v.mean_square, n) for v in (a, b)]
        plain += likelihood_ratio(white[:1], white[1:], 2).p < 0.05
    assert counted / trials < 0.12
    if phi:
        assert plain / trials > 0.5  # what the count of effective samples is for


def test_a_needed_parameter_earns_its_place() -> None:
    rng = np.random.default_rng(5)
    t = np.linspace(-1, 1, 1000)
    y = 0.5 * t**2 + rng.standard_normal(1000)
    few, many = np.stack([t**0, t], 1), np.stack([t**0, t, t**2], 1)
    found = likelihood_ratio([_level(few, y)], [_level(many, y)], 1)
    assert found.p < 1e-3
    assert "the further parameter earns its place" in found.words


def test_different_samples_and_exact_fits_are_refused() -> None:
    with pytest.raises(UnusableInput, match="the same samples"):
        likelihood_ratio([ResidualLevel(1.0, 10)], [ResidualLevel(1.0, 11)], 1)
    with pytest.raises(UnusableInput, match="nested"):
        likelihood_ratio([ResidualLevel(1.0, 10)], [ResidualLevel(1.0, 10)], 0)
    with pytest.raises(UnusableInput, match="no likelihood"):
        criteria([ResidualLevel(0.0, 10)], 1)
