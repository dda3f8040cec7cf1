"""The noise floor, read from a recording without any model."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.signals import Recording, Split
from identification.floor import RELATIVE_LEAST, noise_floor

N = 4000
T = np.asarray(1e-3 * np.arange(N), np.float64)


def recorded(x: np.ndarray) -> Recording:
    return Recording("r", T[: x.size], {"x": x}, {"x": "m"})


def floor(x: np.ndarray, rest: slice | None = None) -> float:
    split = Split(
        slice(rest.stop if rest else 0, x.size // 2), slice(x.size // 2, x.size), "", rest
    )
    return noise_floor(recorded(x), split, ("x",))["x"]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_white_noise_on_a_slow_signal(seed: int) -> None:
    noise = 2e-3 * np.random.default_rng(seed).standard_normal(N)
    assert floor(np.sin(2 * np.pi * 3 * T) + noise) == pytest.approx(2e-3, rel=0.15)


def test_rest_gives_it_directly_less_a_drift() -> None:
    x = np.sin(2 * np.pi * 3 * T)
    x[:1000] = 0.3 + 0.5 * T[:1000]
    x[1000:] += 0.05 * np.random.default_rng(9).standard_normal(N - 1000)
    x[:1000] += 1e-3 * np.random.default_rng(1).standard_normal(1000)
    assert floor(x, slice(0, 1000)) == pytest.approx(1e-3, rel=0.1)


def test_rounding_of_the_converter_is_noise() -> None:
    step = 0.02
    x = step * np.round(np.sin(2 * np.pi * 0.3 * T) / step)
    assert floor(x) >= step / np.sqrt(12) * 0.999


def test_never_zero() -> None:
    x = np.sin(2 * np.pi * 3 * T)
    assert floor(x) >= RELATIVE_LEAST * x.std()
    assert floor(np.zeros(100)) > 0
    assert floor(np.array([1.0, 2.0, 3.0])) > 0
