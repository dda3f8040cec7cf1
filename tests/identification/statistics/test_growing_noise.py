"""Noise that grows with the reading is found by its size; what follows the motion is none."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.statistics.growing_noise import growing_noise

T = np.arange(3000)
Y = 2.0 * (1 + np.sin(T / 700)) * np.sin(T / 9)


def white(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(T.size)


@pytest.mark.parametrize(("base", "share"), [(1e-2, 0.05), (0.1, 0.2), (1e-4, 0.03)])
def test_both_parts_are_recovered(base: float, share: float) -> None:
    found = growing_noise(white() * np.hypot(base, share * Y), Y)
    assert found is not None
    assert found.base == pytest.approx(base, rel=0.2)
    assert found.share == pytest.approx(share, rel=0.05)
    np.testing.assert_allclose(found.at(Y) ** 2, found.base**2 + (found.share * Y) ** 2)
    assert f"{100 * found.share:.3g} % of it" in found.of("x")


def test_outliers_do_not_make_it() -> None:
    r = 0.01 * white()
    r[::97] += 1.0
    assert growing_noise(r, Y) is None
    grown = white() * np.hypot(0.01, 0.05 * Y)
    grown[::97] += 3.0
    found = growing_noise(grown, Y)
    assert found is not None
    assert found.share == pytest.approx(0.05, rel=0.3)


@pytest.mark.parametrize(
    "r",
    [
        0.05 * white(),
        0.01 * white() + 0.02 * Y**2,
        0.001 * white() + 0.02 * np.gradient(Y) * np.abs(Y),
        0.001 * white() + 0.02 * np.abs(Y) * np.sin(T / 40),
        np.convolve(white() * np.hypot(0.01, 0.05 * Y), np.ones(6) / 6, "same"),
        np.zeros(T.size),
    ],
    ids=["constant", "curve", "rate", "swelling", "coloured", "nothing"],
)
def test_what_is_no_such_noise(r: np.ndarray) -> None:
    assert growing_noise(r, Y) is None


def test_a_curve_of_a_white_reading_is_no_noise() -> None:
    y = white(2)
    assert growing_noise(0.02 * y**3 + 0.001 * white(3), y) is None
    assert growing_noise(white()[:50], Y[:50]) is None


@pytest.mark.parametrize("unit", [1e-200, 1e150])
@pytest.mark.filterwarnings("error")
def test_units_do_not_matter(unit: float) -> None:
    r = white() * np.hypot(0.01, 0.05 * Y)
    plain, other = growing_noise(r, Y), growing_noise(unit * r, Y)
    assert plain is not None
    assert other is not None
    assert (other.base / unit, other.share / unit) == pytest.approx((plain.base, plain.share))


def test_arrays_of_unlike_length_are_one_line() -> None:
    with pytest.raises(UnusableInput, match="give one for each"):
        growing_noise(white(), Y[:-1])
