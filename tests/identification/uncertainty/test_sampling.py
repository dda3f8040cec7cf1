"""Samples: of a known normal density, and of a spring; convergence measures."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import BondsightError, UnusableInput
from identification.uncertainty.figures import sample_figure
from identification.uncertainty.fitted import from_estimation
from identification.uncertainty.sampling import draw, sample, split_rhat
from tests.identification.uncertainty.plants import found, spring

pytest.importorskip("emcee")


def test_a_normal_density_is_recovered() -> None:
    root = np.array([[1.0, 0.0], [0.9, 0.3]])
    inverse = np.linalg.inv(root @ root.T)
    draws, tau, rhat, acceptance, status = draw(
        lambda x: float(-0.5 * x @ inverse @ x), np.zeros(2), root, steps=4000, walkers=16
    )
    flat = draws.reshape(-1, 2)
    assert status == "converged"
    assert (tau < 100).all()
    assert (rhat < 1.05).all()
    assert 0.2 < acceptance < 0.9
    assert np.cov(flat.T) == pytest.approx(root @ root.T, rel=0.2, abs=0.05)
    assert np.quantile(flat[:, 0], 0.975) == pytest.approx(1.96, rel=0.12)


def test_draws_do_not_depend_on_global_state() -> None:
    def once(seed: int) -> np.ndarray:
        return draw(lambda x: float(-x @ x), np.zeros(2), np.ones(2), steps=100, seed=seed)[0]

    first = once(1)
    np.random.default_rng().standard_normal(5)
    assert np.array_equal(first, once(1))
    assert not np.array_equal(first, once(2))


def test_rhat_sees_chains_apart() -> None:
    rng = np.random.default_rng(0)
    together = rng.standard_normal((500, 8, 1))
    apart = together + np.arange(8)[None, :, None]
    assert split_rhat(together)[0] < 1.02
    assert split_rhat(apart)[0] > 1.5
    trend = together + np.linspace(0, 5, 500)[:, None, None]
    assert split_rhat(trend)[0] > 1.3


@pytest.mark.long
def test_spring_agrees_with_its_information() -> None:
    f = from_estimation(found())
    s = sample(f, steps=200, walkers=8)
    assert s.names == ("m", "d", "k")
    for n, (low, mid, high) in s.quantiles().items():
        a, b = f.plain.interval(n)
        assert (high - low) == pytest.approx(b - a, rel=0.35)
        assert a < mid < b
    assert s.to_pandas().shape == (s.flat.shape[0], 3)
    table = s.to_xarray()
    assert table["k"].attrs["units"] == "N/m"
    assert table.sizes["walker"] == 8
    assert len(sample_figure(s).axes) == 6
    assert "R-hat" in str(s)


def test_open_directions_and_walkers_are_refused() -> None:
    with pytest.raises(UnusableInput, match="leave a direction of them open"):
        sample(from_estimation(found(spring(1.001))))
    with pytest.raises(UnusableInput, match="at least 4"):
        draw(lambda x: 0.0, np.zeros(2), np.ones(2), walkers=3)


def test_missing_emcee_is_said_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(BondsightError, match=r"bondsight\[sampling\]"):
        draw(lambda x: 0.0, np.zeros(2), np.ones(2))
