"""Even and odd distortion on a random odd multisine, against their known sizes."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.experiments.design.multisine import multisine
from identification.experiments.frequency import distortions
from tests.settled import simulate
from tests.spring import spring

RATE, N = 200.0, 1000


def static(
    square: float, cube: float, noise: float, seeds: tuple[int, ...] = (0,)
) -> list[Recording]:
    found = []
    for seed in seeds:
        u = multisine(RATE, N, band=(0.2, 20.0), kind="random_odd", periods=8, seed=3)
        if seed:
            lines = multisine(RATE, N, lines=u.lines, periods=8, seed=seed)
            u = lines
        rng = np.random.default_rng(seed)
        y = u.values + square * u.values**2 + cube * u.values**3
        y = y + noise * rng.standard_normal(y.size)
        found.append(Recording.from_arrays(f"run {seed}", {"u[V]": u.values, "y[m]": y}, fs=RATE))
    return found


def test_levels_are_the_known_ones() -> None:
    square, cube, noise = 0.05, 0.02, 0.1
    (noisy,), (clean,) = static(square, cube, noise), static(square, cube, 0.0)
    found, exact = (distortions(r, ["u"], ["y"]) for r in (noisy, clean))
    assert set(found.kind) == {"excited", "odd", "even"}
    level, known = found.level("y"), exact.level("y")
    assert level.noise == pytest.approx(np.sqrt(4 * noise**2 / N / 8), rel=0.1)
    assert known.noise < 1e-12
    for kind in ("linear", "odd", "even"):
        assert getattr(level, kind) == pytest.approx(getattr(known, kind), rel=0.1)
    # the mean power of the second harmonics of the square, by hand
    u = noisy["u"][:N]
    even = np.abs(np.fft.rfft(square * u**2))[2:101:2] * 2 / N
    assert known.even == pytest.approx(np.sqrt(np.mean(even**2)), rel=0.03)
    assert level.odd_certain
    assert level.even_certain
    assert "even distortion" in str(level)


def test_a_linear_plant_shows_none() -> None:
    level = distortions(static(0.0, 0.0, 0.1), ["u"], ["y"]).level("y")
    assert not level.odd_certain
    assert not level.even_certain
    assert "none beyond the noise" in str(level)


def test_even_and_odd_are_kept_apart() -> None:
    only_even = distortions(static(0.05, 0.0, 0.01), ["u"], ["y"]).level("y")
    assert only_even.even_certain
    assert not only_even.odd_certain
    only_odd = distortions(static(0.0, 0.05, 0.01), ["u"], ["y"]).level("y")
    assert only_odd.odd_certain
    assert not only_odd.even_certain


def test_realisations_give_the_stochastic_part() -> None:
    runs = static(0.0, 0.05, 0.02, seeds=(1, 2, 3, 4, 5, 6))
    found = distortions(runs, ["u"], ["y"])
    level = found.level("y")
    # odd detection lines and the spread at excited lines see the same distortion
    assert level.stochastic == pytest.approx(level.odd, rel=0.35)
    assert np.isnan(distortions(runs[:1], ["u"], ["y"]).level("y").stochastic)
    assert "over realisations" in str(level)


def test_a_drive_that_is_not_clean_is_allowed_for() -> None:
    (run,) = static(0.0, 0.0, 0.001)
    u = run["u"] + 0.01 * run["u"] ** 2
    late = Recording.from_arrays("dirty", {"u[V]": u, "y[m]": u + run["y"] - run["u"]}, fs=RATE)
    level = distortions(late, ["u"], ["y"]).level("y", (0.2, 19.0))
    assert level.even < 0.02 * 0.01 * level.linear / 0.01
    assert not level.odd_certain


def test_noise_of_a_measured_input_is_no_distortion() -> None:
    runs = []
    for run in static(0.0, 0.0, 1e-4, seeds=(1, 2, 3, 4)):
        rng = np.random.default_rng(int(run.name.split()[1]))
        u = run["u"] + 1e-2 * rng.standard_normal(run.n)
        runs.append(Recording.from_arrays("noisy", {"u[V]": u, "y[m]": run["y"]}, fs=RATE))
    for found in (distortions(runs[0], ["u"], ["y"]), distortions(runs, ["u"], ["y"])):
        level = found.level("y")
        assert not level.odd_certain
        assert not level.even_certain
        assert level.noise == pytest.approx(np.sqrt(4 * 1e-4 / N / 8), rel=0.1)


def test_one_period_does_not_tell_noise_from_distortion() -> None:
    (run,) = static(0.0, 0.02, 0.0)
    one = run.slice(0, N)
    for found in (distortions(r, ["u"], ["y"], period=N, discard=0) for r in (one, [one, run])):
        level = found.level("y")
        assert np.isnan(level.noise)
        assert f"odd distortion {100 * level.odd / level.linear:.3g} % (noise unknown" in str(level)
        assert "none beyond the noise" not in str(level)


def duffing(cube: float) -> Recording:
    g = spring(0.05, 0.5, 100.0, Polynomial(0.0, 0.01, 1.0, (2, 3), "N"), name="duffing")
    u = multisine(
        RATE, N, band=(0.2, 20.0), kind="random_odd", periods=5, rms=0.5, seed=1, name="F", unit="N"
    )
    made = simulate(g, u.time, u.commands, {"a_3_k": cube}, hold="band-limited")
    rng = np.random.default_rng(0)
    x = made["x"] + 2e-7 * rng.standard_normal(u.time.size)
    return Recording("duffing", u.time, {"F": u.values, "x": x}, {"F": "N", "x": "m"})


def test_duffing_is_odd() -> None:
    hard, linear = (distortions(duffing(c), ["F"], ["x"]).level("x") for c in (0.2, 0.0))
    assert hard.odd_certain
    assert hard.odd > 0.01 * hard.linear
    assert hard.even < 0.05 * hard.odd
    assert not linear.odd_certain


def test_tables_and_errors() -> None:
    found = distortions(static(0.05, 0.0, 0.1), ["u"], ["y"])
    assert list(found.to_pandas().columns) == ["kind", "y", "y noise", "y over realisations"]
    assert "excited" in repr(found)
    with pytest.raises(UnknownName):
        found.level("q")
    with pytest.raises(UnusableInput, match="no excited line"):
        found.level("y", (50.0, 60.0))
    with pytest.raises(UnusableInput, match="no recording"):
        distortions([], ["u"], ["y"])


def test_records_of_two_rates_are_refused() -> None:
    (run,) = static(0.05, 0.0, 0.1)
    slow = Recording.from_arrays("slow", {"u[V]": run["u"], "y[m]": run["y"]}, fs=RATE / 2)
    with pytest.raises(UnusableInput, match="slow: period of 1000 samples at 100 Hz"):
        distortions([run, slow], ["u"], ["y"])


def test_lines_that_are_given_out() -> None:
    (run,) = static(0.05, 0.0, 0.1)
    whole, few = (distortions(run, ["u"], ["y"], highest=h) for h in (None, 10))
    assert few.kind.tolist() == whole.kind[:10].tolist()
    np.testing.assert_allclose(few.amplitude, whole.amplitude[:10])
    for wrong in ({"highest": 0}, {"lines": [1, 3, N // 2]}):
        with pytest.raises(UnusableInput, match="raise highest, or leave the Nyquist rate out"):
            distortions(run, ["u"], ["y"], **wrong)
