"""What is left over the noise: outliers are none, what lasts is, and when it may be noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Split
from identification.diagnosis.evidence.remaining import Remaining, remaining
from identification.study.data import Data
from identification.study.noise_floor import COLOURED

N = 4000
T = np.linspace(0.0, 1.0, N)
MOVED = ((0.05 + T**2) * np.sin(900 * T))[:, None] * np.array([1.0, 50.0])
FLOOR = np.array([0.01, 0.5])


def left(noise: np.ndarray, measured: bool = True, *known: str) -> Remaining:
    n, moved = len(noise), MOVED[: len(noise)]
    split = Split(slice(0, n // 2), slice(n // 2, n), "first half")
    data = Data(
        "run", T[:n], {}, moved + FLOOR * noise, ("x", "v"), FLOOR, split, floor_measured=measured,
        floor_known=frozenset(known),
    )  # fmt: skip
    fit: Any = SimpleNamespace(
        problem=SimpleNamespace(data=data), simulated=moved,
        residuals=lambda part: (data.readings - moved)[data.mask(part)],
    )  # fmt: skip
    return remaining(fit)


def white(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((N, 2))


def test_noise_is_noise() -> None:
    found = left(white())
    assert found.over_noise["x"] == pytest.approx(1.0, abs=0.1)
    assert found.over_noise["v"] == pytest.approx(1.0, abs=0.1)
    assert found.follows < 3.5
    assert found.is_noise(1.3)


@pytest.mark.parametrize("n", [2, 30, 150])
def test_a_short_record_is_asked_in_fewer_stretches(n: int) -> None:
    found = left(white()[:n])
    assert np.isfinite(found.follows)
    assert found.follows < 3.5


def test_a_few_outliers_are_no_misfit() -> None:
    noise = white()
    noise[[2100, 2500, 2501, 3000, 3300, 3900], 0] += 500.0
    found = left(noise)
    assert found.most < 1.2
    assert found.is_noise(1.3)


@pytest.mark.parametrize("length", [60, 200])
def test_a_burst_that_lasts_is_a_misfit(length: int) -> None:
    noise = white()
    noise[3000 : 3000 + length, 1] += 20.0
    found = left(noise)
    assert found.over_noise["x"] < 1.2
    assert found.over_noise["v"] > 2.0
    assert not found.is_noise(1.3)
    assert "v" in found.words


@pytest.mark.parametrize("size", [1.5, 3.0, 10.0, 1e3, 1e6])
def test_far_above_a_measured_noise_is_never_noise(size: float) -> None:
    found = left(size * white())
    assert found.most == pytest.approx(size, rel=0.1)
    assert not found.is_noise(1.3)
    assert f"{found.most:.3g}" in found.words


def test_each_reading_is_held_to_what_is_known_of_its_own_noise() -> None:
    """What was stated of one reading counts, though of the other nothing is known."""
    size = np.array([4.0, 1.0])
    found = left(size * white(), False, "x")
    assert not found.is_noise(1.3)
    assert found.words.startswith(f"what is left of x is {found.most:.3g} times the noise and of")
    assert found.words.endswith("times the noise read off its spectrum")
    other = left(size[::-1] * white(), False, "x")
    assert other.most > 3
    assert other.is_noise(1.3)
    # of a sort all are, nothing depends on which
    assert left(size * white(), False) == left(size * white(), False, *())
    assert left(size * white(), False).is_noise(1.3)
    assert left(size * white(), True, "x", "v").sure == frozenset()
    # what follows the motion is asked where it is not known how large the noise is
    swelling = np.abs(MOVED) / np.abs(MOVED).max(axis=0)
    wild = np.stack([0.02 + swelling[:, 0], np.full(N, 4.0)], axis=1) * white()
    assert left(wild, False, "x").is_noise(1.3)


def test_above_a_noise_read_off_the_spectrum_only_what_follows_the_motion_is_none() -> None:
    coloured = left(4.0 * white(), measured=False)
    assert coloured.is_noise(1.3)
    swelling = np.abs(MOVED) / np.abs(MOVED).max(axis=0)
    follows = left((0.3 + 20 * swelling) * white(), measured=False)
    assert follows.most > 1.3
    assert follows.follows > 3.5
    assert not follows.is_noise(1.3)
    assert not left(1.2 * COLOURED * white(), measured=False).is_noise(1.3)


def test_noise_of_any_colour_is_as_loud_in_training() -> None:
    """A rare event in what is held out is none, though the noise is known badly."""
    late = np.where(np.arange(N) < N // 2, 1.0, 2.3)[:, None] * 3.0 * white()
    assert left(late, measured=False).louder > 2.0
    assert not left(late, measured=False).is_noise(1.3)
    assert left(late / 2.3, measured=False).is_noise(3.5)
    assert left(late[::-1], measured=False).is_noise(1.3)


@pytest.mark.parametrize("pole", [0.0, 0.6, 0.95])
def test_noise_of_any_colour_is_as_loud_in_the_mean_as_half_of_the_time(pole: float) -> None:
    """Bursts are none, however little they follow the motion."""
    slow = np.zeros((N, 2))
    for i, e in enumerate(white(3)):
        slow[i] = pole * slow[i - 1] + e
    slow *= 4.0 / slow.std()
    assert left(slow, measured=False).is_noise(1.3)
    bursts = np.where(np.sin(np.arange(N) / 60.0) > 0.8, 2.0, 0.1)[:, None]
    assert not left(bursts * slow, measured=False).is_noise(1.3)
