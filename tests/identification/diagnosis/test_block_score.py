"""Two predictions compared: by what they differ in, over what the noise can do to it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bondgraph.support.arrays import Array
from identification.diagnosis.evidence.block_score import LEAST, BlockScore
from identification.diagnosis.evidence.leave_out import LeftOut, Rows, stretched

N, B = 2000, 40
ROWS = Rows(np.arange(N), np.zeros(N, int), np.arange(N) * B // N)


def scored(residual: Array, rows: Rows = ROWS) -> BlockScore:
    return BlockScore(LeftOut(rows, residual, residual, np.zeros(rows.blocks)))


def regressed(y: Array, *columns: Array) -> BlockScore:
    """Score a linear model, every stretch predicted from the others."""
    x = np.stack(columns, axis=1)
    weights = np.linalg.lstsq(x, y, rcond=None)[0]
    return BlockScore(stretched(x, ROWS).held_out(y - x @ weights, np.zeros(x.shape[1])))


def white(seed: int, size: int = N) -> Array:
    return np.random.default_rng(seed).standard_normal(size)


def coloured(seed: int, pole: float) -> Array:
    y = lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], white(seed, N + 500))[500:]
    return np.asarray(y)


def test_antisymmetric_and_zero_for_equals() -> None:
    a, b = scored(white(1)), scored(white(1) + 0.3 * white(2))
    assert a.behind(a) == 0.0
    assert a.behind(scored(white(1))) == 0.0
    assert b.behind(a) == -a.behind(b)
    assert b.behind(a) > 3.0


def test_what_differs_by_nothing_is_one_hypothesis() -> None:
    """Two laws with the same predictions but for rounding: every stretch agrees on a lead of it."""
    better = scored(white(1))
    same = scored((1.0 + 1e-7) * white(1))
    assert same.paired(better) > 3.0
    assert same.behind(better) == better.behind(same) == 0.0
    assert scored(1.05 * white(1)).behind(better) > 3.0


def test_the_scale_of_the_floor_does_not_matter() -> None:
    n, d = white(1), white(2)
    one = scored(n + 0.1 * d).behind(scored(n))
    assert scored(7.0 * (n + 0.1 * d)).behind(scored(7.0 * n)) == pytest.approx(one)


def test_what_shows_in_two_stretches_of_forty_has_no_ceiling() -> None:
    shape = np.where((ROWS.block == 7) | (ROWS.block == 23), white(3), 0.0)
    n = white(1)
    leads = [scored(n + s * shape).behind(scored(n)) for s in (0.3, 1.0, 10.0, 100.0, 1000.0)]
    assert leads == sorted(leads)
    assert leads[0] < 3.0
    assert leads[2] > 20.0
    assert leads[4] == pytest.approx(10 * leads[3], rel=0.1)


@pytest.mark.parametrize(("size", "least"), [(0.03, 0.85), (0.3, 0.5)])
def test_two_equally_wrong_predictions_differ_as_a_standard_normal_number(
    size: float, least: float
) -> None:
    one, other = np.sin(np.arange(N) / 9.0), np.sin(np.arange(N) / 23.0 + 1)
    other *= np.linalg.norm(one) / np.linalg.norm(other)
    z = np.array(
        [scored(white(s) + size * one).behind(scored(white(s) + size * other)) for s in range(400)]
    )
    assert abs(z.mean()) < 0.2
    assert least < z.std() < 1.15
    assert np.mean(np.abs(z) > 3.0) < 0.015


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("pole", [0.0, 0.9, 0.98])
def test_a_column_that_means_nothing_does_not_lead(pole: float) -> None:
    one = np.ones(N)
    leads = []
    for s in range(300):
        y, idle = coloured(s, pole), coloured(10_000 + s, pole)
        leads.append(regressed(y, one).behind(regressed(y, one, idle)))
    assert np.mean(np.array(leads) > 3.0) < 0.02
    assert np.median(leads) < 0.5


@pytest.mark.parametrize("pole", [0.0, 0.9])
def test_many_columns_that_mean_nothing_do_not_lead(pole: float) -> None:
    one = np.ones(N)
    for s in range(40):
        y = coloured(s, pole)
        idle = [coloured(10_000 + 100 * s + i, pole) for i in range(12)]
        assert regressed(y, one).behind(regressed(y, one, *idle)) < 2.0


def test_what_slow_noise_cannot_do_is_seen_beneath_it() -> None:
    """A tenth of the noise, but quick: the noise has little there."""

    def leads(pole: float) -> list[float]:
        noises = [coloured(s, pole) for s in range(20)]
        quick = [0.1 * white(s + 50) for s in range(20)]
        return [scored(n + q).behind(scored(n)) for n, q in zip(noises, quick, strict=True)]

    assert min(leads(0.9)) > 2.0
    assert np.median(leads(0.9)) > 5.0
    assert np.median(leads(0.0)) < 3.0


@pytest.mark.parametrize("pole", [0.0, 0.9])
def test_a_column_that_means_something_does(pole: float) -> None:
    one, idle = np.ones(N), white(77)
    for s in range(5):
        y = coloured(s, pole) + 0.5 * idle
        assert regressed(y, one).behind(regressed(y, one, idle)) > 5.0


def test_a_reading_of_little_noise_counts_as_much_as_another() -> None:
    rows = Rows(np.tile(np.arange(N), 2), np.repeat([0, 1], N), np.tile(ROWS.block, 2))
    n, d = np.concatenate([white(1), 100 * white(1)]), white(3)
    first, second = np.zeros(2 * N), np.zeros(2 * N)
    first[:N], second[N:] = 0.2 * d, 20 * d
    plain = scored(n, rows)
    assert plain.noise == pytest.approx([1.0, 100.0], rel=0.05)
    small, large = scored(n + first, rows).behind(plain), scored(n + second, rows).behind(plain)
    assert small > 3.0
    assert small == pytest.approx(large)


def test_numbers_at_the_ends_of_the_scale_stay_numbers() -> None:
    perfect, awful = scored(np.zeros(N)), scored(np.full(N, 1e150))
    assert perfect.noise == pytest.approx([LEAST])
    assert np.isfinite(awful.behind(scored(white(1))))
    assert awful.behind(scored(white(1))) > 3.0
    assert scored(white(1)).behind(perfect) > 3.0


def test_misfits_that_are_no_noise_are_compared_by_whole_stretches() -> None:
    """Whitening would take out what is physics: both leave slow misfits, one twice as large."""
    angle = 2 * np.pi * np.arange(N) / 150
    better = scored(0.1 * white(1) + 30 * np.sin(angle))
    worse = scored(0.1 * white(1) + 40 * np.sin(0.9 * angle))
    assert worse.apart(better) < 3.0
    assert worse.paired(better) > 3.0
    assert worse.behind(better) == worse.paired(better)


def test_stretches_that_do_not_agree_say_nothing() -> None:
    leads = [scored(white(s)).paired(scored(white(s + 1))) for s in range(0, 400, 2)]
    assert np.std(leads) == pytest.approx(1.0, abs=0.2)
    assert scored(white(1)).paired(scored(white(1))) == 0.0


def test_nothing_is_whitened_across_held_out_samples() -> None:
    noise = coloured(5, 0.97)
    kept = np.flatnonzero(np.arange(N) % 200 < 140)
    rows = Rows(kept, np.zeros(kept.size, int), np.arange(kept.size) * B // kept.size)
    s = scored(noise[kept], rows)
    assert s.poles[0] == pytest.approx(0.97, abs=0.015)
    assert np.mean(s.white**2) == pytest.approx(1.0, abs=0.15)
    # a step between two kept samples would be many standard deviations
    assert np.abs(s.white).max() < 5.0


# -- noise that is slow at any scale ----------------------------------------------------------
def pink(seed: int) -> Array:
    """White noise and more of 1/f noise."""
    f = np.fft.rfftfreq(N)
    slow = np.fft.irfft(np.fft.rfft(white(seed)) / np.sqrt(np.maximum(f, f[1])), N)
    return np.asarray(0.45 * white(seed + 1000) + 0.9 * slow / slow.std())


def led_by_slow_forms(seed: int, added: Array | float = 0.0, *more: Array) -> tuple[float, float]:
    """Return the lead of slow sines over a constant, plain and beside the noise's memory."""
    y, t = pink(seed) + added, np.arange(N) / N
    slow = [f(2 * np.pi * k * t) for k in (0.5, 1.0, 1.5) for f in (np.sin, np.cos)]
    plain = regressed(y, np.ones(N))
    better = regressed(y, np.ones(N), *(more or slow))
    return plain.behind(better), plain.beside_colour(better)


def test_slow_forms_do_not_lead_beside_noise_that_is_slow_at_any_scale() -> None:
    z = np.array([led_by_slow_forms(seed) for seed in range(60)])
    assert np.mean(z[:, 0] > 3.0) > 0.15  # one pole is not enough
    assert np.mean(z[:, 1] > 4.0) < 0.05


def test_what_the_motion_explains_leads_beside_any_colour() -> None:
    """A tenth of the power, at frequencies in the midst of the noise."""
    t = np.arange(N)
    moved = sum(np.sin(2 * np.pi * f * t + 7 * f) for f in (0.013, 0.021, 0.034, 0.055, 0.089))
    z = [led_by_slow_forms(s, 0.2 * moved, np.asarray(moved)) for s in range(20)]
    assert min(beside for _, beside in z) > 3.0


def test_a_drift_beside_white_noise_leads_nearly_as_surely_as_without_colour() -> None:
    """What it leaves has no memory, however slow it is itself."""
    t = np.linspace(-1.0, 1.0, N)
    for s in range(20):
        y = white(s) + 0.4 * t
        plain, better = regressed(y, np.ones(N)), regressed(y, np.ones(N), t)
        assert plain.beside_colour(better) > 0.7 * plain.behind(better)
        assert better.foretold < 0.05 < regressed(pink(s), np.ones(N)).foretold


def test_beside_white_noise_the_lead_is_the_usual_one() -> None:
    plain, better = scored(white(1) + 0.2 * white(2)), scored(white(1))
    assert plain.beside_colour(better) == pytest.approx(plain.behind(better), rel=0.1)
    assert better.beside_colour(plain) == 0.0
    assert plain.beside_colour(plain) == 0.0
    assert scored(np.full(N, np.inf)).beside_colour(better) == np.inf
