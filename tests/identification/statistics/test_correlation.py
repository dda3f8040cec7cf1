"""Correlations over gaps, and the memory of known processes."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.statistics.autoregression import autoregression
from identification.statistics.correlation import autocorrelation, correlate, pieces_of, stretches
from identification.statistics.memory import memory
from tests.identification.validation.made import coloured


def test_sums_are_those_of_the_definition() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 40))
    found = correlate([a[:25], a[25:]], [b[:25], b[25:]], 30)
    for k in range(-30, 31):
        slow = 0.0
        for part in (slice(0, 25), slice(25, 40)):
            x, y = a[part], b[part]
            slow += sum(x[t + k] * y[t] for t in range(x.size) if 0 <= t + k < x.size)
        assert found[k + 30] == pytest.approx(slow, abs=1e-12)


def test_pairs_never_cross_a_gap() -> None:
    v = np.tile([1.0, -1.0], 20)
    v[20] = np.nan
    pieces = pieces_of(v)
    assert [p.size for p in pieces] == [20, 19]
    assert [s.start for s in stretches(np.isfinite(v))] == [0, 21]
    # 18 + 19 pairs of opposite sign, not 38
    assert correlate(pieces, pieces, 1)[2] == pytest.approx(-37, abs=1.1)


@pytest.mark.parametrize(("phi", "truth"), [(0.0, 1.0), (0.8, 9.0), (0.95, 39.0)])
def test_memory_of_autoregressive_noise(phi: float, truth: float) -> None:
    e = coloured(np.random.default_rng(3), 20000, phi)
    r = autocorrelation(pieces_of(e), 2000)
    assert memory(r, e.size) == pytest.approx(truth, rel=0.2)
    assert autoregression(r, e.size).innovation == pytest.approx(1 - phi**2, abs=0.02)


def test_an_oscillation_has_memory_although_its_correlations_cancel() -> None:
    rng = np.random.default_rng(4)
    e = np.sin(0.7 * np.arange(4000)) + 0.01 * rng.standard_normal(4000)
    assert memory(autocorrelation(pieces_of(e), 1000), 4000) > 100


def test_a_constant_residual_has_no_correlation() -> None:
    assert autocorrelation(pieces_of(np.full(50, 3.0)), 5).tolist() == [1.0, 0, 0, 0, 0, 0]


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(UnusableInput, match="5 scored samples"):
        pieces_of(np.arange(5.0))
