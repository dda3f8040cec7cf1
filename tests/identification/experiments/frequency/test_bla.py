"""Best linear approximation: unbiased, with variances that are those of its errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import freqz, lfilter

from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.experiments.design.multisine import multisine, orthogonal_multisines
from identification.experiments.frequency import (
    FrequencyResponse,
    best_linear_approximation,
    local_polynomial,
)

RATE, N, NOISE = 1000.0, 512, 0.02
PLANTS = {
    ("y", "u"): ([0.1, 0.05], [1.0, -1.6, 0.8]),
    ("y", "v"): ([0.03], [1.0, -0.9]),
    ("z", "u"): ([0.02, -0.01], [1.0, -0.5]),
    ("z", "v"): ([0.2], [1.0, -1.2, 0.6]),
}


def true(response: FrequencyResponse) -> Array:
    w = 2 * np.pi * response.frequency / RATE
    return np.stack(
        [[freqz(*PLANTS[y, u], worN=w)[1] for u in response.inputs] for y in response.outputs]
    ).transpose(2, 0, 1)


def record(drives: dict[str, Array], outputs: str, seed: int, cube: float = 0.0) -> Recording:
    rng = np.random.default_rng(seed)
    channels = {f"{u}[V]": v for u, v in drives.items()}
    for y in outputs:
        clean = sum(lfilter(*PLANTS[y, u], v) for u, v in drives.items())
        late = lfilter(*PLANTS[y, "u"], drives["u"] ** 3)
        channels[f"{y}[m]"] = clean + cube * late + NOISE * rng.standard_normal(clean.size)
    return Recording.from_arrays(f"run {seed}", channels, fs=RATE)


def single(count: int, periods: int = 6, cube: float = 0.0, first: int = 0) -> list[Recording]:
    found = []
    for m in range(first, first + count):
        u = multisine(RATE, N, band=(4.0, 400.0), periods=periods, seed=m)
        found.append(record({"u": u.values}, "y", m, cube))
    return found


def normalised(found: FrequencyResponse, variance: Array) -> Array:
    """Mean square error over the variance, by path; 1 if the variance is right."""
    return np.asarray(np.mean(np.abs(found.response - true(found)) ** 2 / variance, axis=0))


def test_one_realisation_has_the_variance_of_its_errors() -> None:
    found = best_linear_approximation(single(1), ["u"], ["y"])
    assert found.response.shape == (202, 1, 1)
    # 202 lines: the mean of as many exponential variables, five periods of noise estimate each
    assert normalised(found, np.asarray(found.noise_variance.mean(axis=0))) == pytest.approx(
        1.0, abs=0.35
    )
    assert found.output_noise.mean() == pytest.approx(4 * NOISE**2 / N / 5, rel=0.2)
    assert found.output_total.mean() == pytest.approx(found.output_noise.mean(), rel=0.35)
    assert "neighbouring" in found.method


def test_many_realisations_see_no_distortion_of_a_linear_plant() -> None:
    found = best_linear_approximation(single(6), ["u"], ["y"])
    assert found.output_total.mean() == pytest.approx(found.output_noise.mean(), rel=0.2)
    ratio = np.mean(np.abs(found.response - true(found)) ** 2) / found.noise_variance.mean()
    assert ratio == pytest.approx(1.0, abs=0.35)


def test_total_variance_holds_for_a_cubic_plant() -> None:
    sets = [
        best_linear_approximation(single(8, 3, cube=0.3, first=20 * k), ["u"], ["y"])
        for k in (1, 2)
    ]
    a, b = sets
    for s in sets:
        assert s.output_total.mean() > 5 * s.output_noise.mean()
        assert s.output_distortion.mean() > 0
    apart = np.mean(np.abs(a.response - b.response) ** 2)
    assert apart / (a.total_variance + b.total_variance).mean() == pytest.approx(1.0, abs=0.3)
    assert apart > 5 * (a.noise_variance + b.noise_variance).mean()
    # E[u^3 u] / E[u^2] = 3 for a Gaussian drive of unit power, a little less with few lines
    gain = np.mean((a.response + b.response) / 2 / true(a))
    assert gain.real == pytest.approx(1 + 3 * 0.3, rel=0.03)


def test_several_inputs_by_orthogonal_phases() -> None:
    blocks = [
        s
        for seed in (1, 2)
        for s in orthogonal_multisines(RATE, N, ["u", "v"], seed=seed, band=(4.0, 400.0), periods=6)
    ]
    records = [
        record({s.name: s.values for s in pair}, "yz", 10 + k) for k, pair in enumerate(blocks)
    ]
    two = best_linear_approximation(records[:2], ["u", "v"], ["y", "z"])
    four = best_linear_approximation(records, ["u", "v"], ["y", "z"])
    for found in (two, four):
        error = np.mean(np.abs(found.response - true(found)) ** 2, axis=0)
        assert error / found.noise_variance.mean(axis=0) == pytest.approx(np.ones((2, 2)), abs=0.35)
    assert four.noise_variance.mean() == pytest.approx(0.5 * two.noise_variance.mean(), rel=0.1)
    assert four.output_total.mean() == pytest.approx(four.output_noise.mean(), rel=0.3)
    one = best_linear_approximation(records[0], ["u", "v"], ["y", "z"])
    assert "local" in one.method
    assert np.mean(np.abs(one.response - true(one)) ** 2) < 20 * two.total_variance.mean()


def test_inputs_that_move_together_are_refused() -> None:
    u = multisine(RATE, N, band=(4.0, 400.0), periods=3).values
    same = [record({"u": u, "v": 2 * u}, "y", k) for k in range(3)]
    with pytest.raises(UnusableInput, match="do not separate the 2 inputs"):
        best_linear_approximation(same, ["u", "v"], ["y"])
    with pytest.raises(UnusableInput, match="move together"):
        best_linear_approximation(same[:1], ["u", "v"], ["y"])


def test_arbitrary_records_by_local_polynomials() -> None:
    rng = np.random.default_rng(0)
    u = rng.standard_normal(16 * N)
    found = local_polynomial(record({"u": u}, "y", 1), ["u"], ["y"], band=(1.0, 400.0), points=300)
    assert found.frequency.size == 300
    assert np.isnan(found.noise_variance).all()
    error = np.abs(found.response - true(found)) ** 2
    assert error.mean() / found.total_variance.mean() == pytest.approx(1.0, abs=0.4)
    assert found.output_total.mean() == pytest.approx(4 * NOISE**2 / u.size, rel=0.15)
    # a record of two inputs at once
    both = {"u": u, "v": rng.standard_normal(u.size)}
    pair = local_polynomial(record(both, "yz", 2), ["u", "v"], ["y", "z"], points=200)
    assert np.mean(np.abs(pair.response - true(pair)) ** 2) < 1.5 * pair.total_variance.mean()


def test_bad_input_says_what() -> None:
    runs = single(2)
    with pytest.raises(UnusableInput, match="no recording"):
        best_linear_approximation([], ["u"], ["y"])
    with pytest.raises(UnusableInput, match="no recording"):
        local_polynomial([], ["u"], ["y"])
    with pytest.raises(UnusableInput, match="lines must lie"):
        best_linear_approximation(runs, ["u"], ["y"], lines=[0, 3])
    with pytest.raises(UnusableInput, match="differ in length"):
        local_polynomial([runs[0], runs[1].slice(0, 500)], ["u"], ["y"])
    with pytest.raises(UnusableInput, match="record longer"):
        local_polynomial(runs[0].slice(0, 16), ["u"], ["y"])
    with pytest.raises(UnknownName, match="no channel 'w'"):
        best_linear_approximation(runs, ["u"], ["w"])
    found = best_linear_approximation(runs, ["u"], ["y"])
    with pytest.raises(UnknownName, match="no input"):
        found.entry("y", "y")
    with pytest.raises(UnusableInput, match="no line between"):
        found.band(900.0, 901.0)


def test_tables() -> None:
    found = best_linear_approximation(single(2), ["u"], ["y"])
    frame = found.to_pandas()
    assert frame.shape == (202, 3)
    assert frame.index.name == "f_Hz"
    assert "noise" in repr(found)
    assert found.band(100.0, 200.0).frequency.size < 60
