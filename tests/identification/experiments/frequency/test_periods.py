"""The period of a drive, its run-in and its lines."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.experiments.frequency.periods import cut, period_lines
from identification.statistics.periods import find_period, whole_period

N = 400


def repeated(count: int = 6, *, noise: float = 0.0, decay: float = 0.0, skip: int = 0) -> Recording:
    rng = np.random.default_rng(1)
    u, y = (np.tile(rng.standard_normal(N), count) for _ in range(2))
    y = y + decay * np.exp(-np.arange(y.size) / (0.4 * N))
    u, y = (v + noise * rng.standard_normal(v.size) for v in (u, y))
    return Recording.from_arrays("run", {"u[V]": u[skip:], "y[m]": y[skip:]}, fs=100.0)


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.25])
@pytest.mark.parametrize("skip", [0, 123])
def test_period_is_found_under_noise(noise: float, skip: int) -> None:
    r = repeated(noise=noise, skip=skip)
    assert whole_period(find_period(r["u"]), r.n, "u") == N


def test_a_small_subharmonic_counts() -> None:
    t = np.arange(1200)
    u = np.sin(2 * np.pi * t / 25) + 0.05 * np.sin(2 * np.pi * t / 75)
    assert find_period(u) == pytest.approx(75, abs=0.01)


def test_multiple_of_a_fractional_period() -> None:
    u = np.sin(2 * np.pi * np.arange(1000) / 33.25)
    assert whole_period(find_period(u), 1000, "u") == 133


@pytest.mark.parametrize(
    ("u", "words"),
    [
        (np.ones(100), "does not move"),
        (np.random.default_rng(0).standard_normal(500), "does not repeat"),
        (np.linspace(0, 1, 500), "does not repeat"),
    ],
)
def test_no_period(u: np.ndarray, words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        find_period(u)


def test_period_between_samples_is_refused() -> None:
    with pytest.raises(UnusableInput, match="no whole number of samples"):
        whole_period(100.0 / np.pi, 200, "u")


def test_run_in_is_left_out() -> None:
    clean = cut(repeated(noise=0.01), "u", ["y"])
    assert (clean.count, clean.discarded) == (6, 0)
    late = cut(repeated(noise=0.01, decay=2.0, skip=100), "u", ["y"])
    assert late.count in (3, 4)
    assert late.discarded == 300 + N * (5 - late.count)
    assert "dropped" in repr(late)
    given = cut(repeated(noise=0.01, decay=2.0), "u", ["y"], period=N, discard=10)
    assert (given.count, given.discarded) == (5, N)


def test_two_periods_cannot_be_tested() -> None:
    assert "too few" in cut(repeated(2), "u", ["y"]).words
    with pytest.raises(UnusableInput, match="hold no period"):
        cut(repeated(2), "u", ["y"], period=5000)


def test_spectra_are_peak_amplitudes() -> None:
    t = np.arange(3 * N)
    y = 2.5 * np.cos(2 * np.pi * 7 * t / N + 0.3)
    r = Recording.from_arrays("tone", {"y[m]": y}, fs=1.0)
    s = cut(r, "y", ["y"], period=N).spectra(["y"])
    assert s.shape == (3, N // 2 + 1, 1)
    assert s[:, 7, 0] == pytest.approx(np.full(3, 2.5 * np.exp(0.3j)))


def test_lines_stand_out() -> None:
    spectrum = np.full(50, 1e-3, complex)
    spectrum[0], spectrum[[3, 5, 9]] = 9.0, [1.0, 0.2j, -0.5]
    assert period_lines(spectrum.copy()).tolist() == [3, 5, 9]
    with pytest.raises(UnusableInput, match="excites no line"):
        period_lines(np.zeros(5, complex))


def test_rest_before_and_after() -> None:
    run = repeated(noise=0.01)
    still = np.zeros(300)
    first, last = (
        Recording.from_arrays(
            "rest", {f"{k}[V]": np.concatenate(order(run[k])) for k in "uy"}, fs=100.0
        )
        for order in (lambda v: (still, v), lambda v: (v, still))
    )
    found = cut(first, "u", ["y"])
    assert (found.period, found.count, found.discarded) == (N, 6, 300)
    with pytest.raises(UnusableInput, match="up to the end of the record"):
        cut(last, "u", ["y"])
    with pytest.raises(UnusableInput, match="does not repeat every 300"):
        cut(run, "u", ["y"], period=300)
