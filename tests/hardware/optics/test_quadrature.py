"""Ellipse, phase and light of quadrature signals."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.optics import (
    BeamWatch,
    Demodulator,
    Ellipse,
    fit_ellipse,
    quadrature_displacement,
    watch_beam,
)

Array = NDArray[np.float64]

LASER, INDEX = 632.9908e-9, 1.00027
# offsets 3 and 4 %, gain 7 %, 4 degrees from quadrature
BENT = Ellipse(0.03, -0.04, 1.07, np.deg2rad(4.0).item(), 1.0)
NOISE = 0.003


def _record(stroke: float, seed: int = 0, n: int = 32768) -> tuple[Array, Array, Array]:
    """Displacement and signals of a sine of 2 Hz at 3125 Hz, noise 0.3 % of the amplitude."""
    rng = np.random.default_rng(seed)
    x = 0.5 * stroke * (1.0 - np.cos(2.0 * np.pi * 2.0 * np.arange(n) / 3125.0))
    u1, u2 = BENT.signals(4.0 * np.pi * INDEX * x / LASER + 0.7)
    return x, u1 + NOISE * rng.standard_normal(n), u2 + NOISE * rng.standard_normal(n)


def _error(x: Array, u1: Array, u2: Array, ellipse: Ellipse) -> float:
    return float(np.ptp(quadrature_displacement(u1, u2, ellipse, LASER, INDEX) - x))


@pytest.mark.parametrize("stroke", [200e-9, 300e-9, 1e-6, 4.9e-6])
def test_periodic_error_falls_to_the_noise(stroke: float) -> None:
    x, u1, u2 = _record(stroke)
    fit = fit_ellipse(u1, u2)
    raw, corrected = _error(x, u1, u2, Ellipse()), _error(x, u1, u2, fit.ellipse)
    print(f"{1e9 * stroke:.0f} nm: {1e9 * raw:.2f} -> {1e9 * corrected:.2f} nm peak to peak")
    assert 8.5e-9 < raw < 10.5e-9
    assert corrected < 1.6e-9
    # noise alone, with the true coefficients
    assert corrected < 1.1 * _error(x, u1, u2, BENT)
    assert fit.noise == pytest.approx(NOISE, rel=0.1)
    assert fit.arc == pytest.approx(stroke / 316.41e-9, abs=0.02)


def test_too_short_an_arc_degrades_and_is_therefore_not_used() -> None:
    x, u1, u2 = _record(100e-9)
    forced = fit_ellipse(u1, u2, shortest_arc=0.0)
    assert _error(x, u1, u2, forced.ellipse) > 2.5e-9
    with pytest.raises(UnusableInput, match=r"covers 0\.3"):
        fit_ellipse(u1, u2)
    old = fit_ellipse(*_record(1e-6, seed=1)[1:]).ellipse
    kept = fit_ellipse(u1, u2, keep=old)
    assert kept.kept
    assert kept.ellipse == old
    assert kept.uncertainty is None
    assert kept.arc == pytest.approx(0.316, abs=0.02)
    assert _error(x, u1, u2, kept.ellipse) < 1.6e-9
    renewed = fit_ellipse(*_record(1e-6, seed=2)[1:], keep=old)
    assert not renewed.kept


def test_uncertainty_covers_the_truth() -> None:
    want = np.array([BENT.offset_1, BENT.offset_2, BENT.ratio, BENT.skew, BENT.radius])
    scores = []
    for seed in range(20):
        fit = fit_ellipse(*_record(1e-6, seed=seed, n=4096)[1:])
        e = fit.ellipse
        got = np.array([e.offset_1, e.offset_2, e.ratio, e.skew, e.radius])
        scores.append((got - want) / np.array(fit.uncertainty))
    rms = np.sqrt(np.mean(np.square(scores), axis=0))
    assert np.all((rms > 0.4) & (rms < 1.8)), rms


@pytest.mark.parametrize("offset", [2.5, 1.0, -4.0])
def test_large_offsets_and_any_unit(offset: float) -> None:
    _, u1, u2 = _record(1e-6)
    e = fit_ellipse(1e3 * (u1 + offset), 1e3 * (u2 + offset)).ellipse
    assert e.offset_1 == pytest.approx(1e3 * (0.03 + offset), abs=1.0)
    assert e.ratio == pytest.approx(1.07, abs=1e-3)
    assert e.skew == pytest.approx(BENT.skew, abs=1e-3)
    assert e.radius == pytest.approx(1e3, rel=1e-3)


@pytest.mark.parametrize("cuts", [[1], [7, 8, 5000], list(range(1, 4096, 17))])
def test_cutting_a_record_changes_nothing(cuts: list[int]) -> None:
    _, u1, u2 = _record(4.9e-6, n=8192)
    u1, u2 = u1.copy(), u2.copy()
    u1[6000:6003] = 0.03
    u2[6000:6003] = -0.04
    u1[3000] = np.nan
    whole, end = Demodulator(BENT, LASER, INDEX).feed(u1, u2)
    state, parts = Demodulator(BENT, LASER, INDEX), []
    for a, b in zip(np.split(u1, cuts), np.split(u2, cuts), strict=True):
        part, state = state.feed(a, b)
        parts.append(part)
    assert np.concatenate([p.position for p in parts]) == pytest.approx(whole.position, abs=1e-18)
    assert np.array_equal(np.concatenate([p.flags for p in parts]), whole.flags)
    assert state.seen == end.seen
    assert state.seen.lost_at == 3000


def test_a_minute_of_streaming_takes_a_fraction_of_a_second() -> None:
    n, rate = 1600, 16000.0
    x = 2.45e-6 * (1.0 - np.cos(2.0 * np.pi * 10.0 * np.arange(n) / rate))
    u1, u2 = BENT.signals(4.0 * np.pi * INDEX * x / LASER)
    state = Demodulator(BENT, LASER, INDEX)
    began = time.process_time()
    for _ in range(600):
        part, state = state.feed(u1, u2)
    took = time.process_time() - began
    print(f"960,000 samples in 600 chunks: {took:.2f} s")
    # fringes are still counted right, and rounding has not gathered
    assert np.abs(part.position - x).max() < 1e-12
    assert state.seen.samples == 960_000
    assert took < 5.0


def test_empty_chunk_and_wrong_shapes() -> None:
    state = Demodulator(BENT)
    part, after = state.feed(np.zeros(0), np.zeros(0))
    assert part.position.size == 0
    assert after == state
    with pytest.raises(UnusableInput, match="shape"):
        state.feed(np.zeros(3), np.zeros(4))


def test_fading_warns_before_the_beam_is_lost() -> None:
    x, u1, u2 = _record(4.9e-6, n=8192)
    share = np.clip(np.linspace(1.2, -0.2, 8192), 0.0, 1.0)
    part, state = Demodulator(BENT, LASER, INDEX).feed(
        0.03 + share * (u1 - 0.03), -0.04 + share * (u2 + 0.04)
    )
    low = (part.flags & Flag.LEVEL_LOW) != 0
    lost = (part.flags & Flag.BEAM_LOST) != 0
    assert state.seen.warned_at is not None
    assert state.seen.lost_at is not None
    assert state.seen.warned_at + 1000 < state.seen.lost_at
    assert lost[state.seen.lost_at :].all()
    assert not lost[: state.seen.lost_at].any()
    assert not low[: state.seen.warned_at].any()
    assert part.level[:2000] == pytest.approx(share[:2000], abs=0.02)
    # until the warning the position is right
    assert np.ptp((part.position - x)[: state.seen.warned_at]) < 3e-9
    with pytest.raises(UnusableInput, match="no light at sample"):
        quadrature_displacement(0.0 * u1, 0.0 * u2, Ellipse())


def test_light_that_comes_back_stays_suspect() -> None:
    flags, state = watch_beam([1.0, 0.1, 1.0])
    assert flags.tolist() == [0, Flag.LEVEL_LOW | Flag.BEAM_LOST, Flag.BEAM_LOST]
    flags, state = watch_beam([1.0], None, state)
    assert flags.tolist() == [Flag.BEAM_LOST]
    assert (state.samples, state.lost_at, state.lowest) == (4, 1, 0.1)
    with pytest.raises(UnusableInput, match="lost < warn"):
        BeamWatch(0.1, 0.2)


@pytest.mark.parametrize(
    ("u1", "u2", "named"),
    [
        (np.zeros(100), np.zeros(100), "do not move"),
        (np.arange(4.0), np.arange(4.0), "6 or more"),
        (np.full(9, np.nan), np.zeros(9), "not finite"),
        (np.linspace(0, 1, 100), np.linspace(0, 1, 100), "distinct|ellipse"),
        (np.linspace(-1, 1, 100), np.linspace(-1, 1, 100) ** 2, "ellipse"),
    ],
)
def test_what_is_no_ellipse_is_refused(u1: Array, u2: Array, named: str) -> None:
    with pytest.raises(UnusableInput, match=named):
        fit_ellipse(u1, u2)


def test_coefficients_must_be_an_ellipse() -> None:
    for bad in ({"ratio": 0.0}, {"radius": -1.0}, {"skew": 2.0}, {"ratio": float("nan")}):
        with pytest.raises(UnusableInput, match="no ellipse"):
            Ellipse(**bad)
