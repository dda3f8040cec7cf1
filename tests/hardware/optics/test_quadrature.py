"""Ellipse, phase and light of quadrature signals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph.support.arrays import FloatArray as Array
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
from tests.counted import calls

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


def test_a_minute_of_streaming_gathers_no_rounding_and_no_work() -> None:
    n, rate = 1600, 16000.0
    x = 2.45e-6 * (1.0 - np.cos(2.0 * np.pi * 10.0 * np.arange(n) / rate))
    u1, u2 = BENT.signals(4.0 * np.pi * INDEX * x / LASER)
    state = Demodulator(BENT, LASER, INDEX)
    first = calls(lambda: state.feed(u1[:16], u2[:16]))
    for _ in range(600):
        part, state = state.feed(u1, u2)
    # fringes are still counted right, and rounding has not gathered
    assert np.abs(part.position - x).max() < 1e-12
    assert state.seen.samples == 960_000
    # as much for a chunk of 1600 late as for one of 16 at first
    assert calls(lambda: state.feed(u1, u2)) <= first < 1000


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
        (np.full(100, 3.3), np.full(100, -0.1), "do not move"),
        (np.arange(4.0), np.arange(4.0), "6 or more"),
        (np.full(9, np.nan), np.zeros(9), "not finite"),
        (np.linspace(0, 1, 100), np.linspace(0, 1, 100), "on a line"),
        (np.linspace(0, 1, 100), np.zeros(100), "on a line"),
        (np.linspace(-1, 1, 100), np.linspace(-1, 1, 100) ** 2, "parabola"),
    ],
)
def test_what_is_no_ellipse_is_refused(u1: Array, u2: Array, named: str) -> None:
    with pytest.raises(UnusableInput, match=named):
        fit_ellipse(u1, u2)


T = np.linspace(-1.0, 1.3, 60)
FOUR = np.arange(60) % 4
SHAPES: dict[str, tuple[Any, Any, str]] = {
    "parabola": (T, T**2, "on a parabola"),
    "flat parabola": (T, 1e-4 * T**2, "on a parabola"),
    "half a parabola": (T + 1.0, (T + 1.0) ** 2, "on a parabola"),
    "parallel lines": (T, np.arange(60) % 2 + 0.0, "on a parabola or on parallel lines"),
    "hyperbola": (np.cosh(T), np.sinh(T), "on a hyperbola"),
    "two branches": (np.where(FOUR < 2, 1.0, -1.0) * np.cosh(T), np.sinh(T), "on a hyperbola"),
    "crossing lines": (T, np.where(FOUR < 2, 0.5 * T, -T), "crossing lines"),
    "line": (T, -3.0 * T, "on a line"),
    "line along an axis": (0.0 * T, T, "on a line"),
    "two points": (FOUR // 2 + 0.0, FOUR // 2 - 1.0, "on a line"),
    "four points": (np.cos(FOUR * 1.3), np.sin(FOUR * 1.3), "fewer than five distinct points"),
    "three points": (np.cos(FOUR % 3 * 2.0), np.sin(FOUR % 3 * 2.0), "fewer than five"),
    "line and a point": (T, T + (np.arange(60) == 30), "all but one on a line"),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("keep", [None, Ellipse(0.2, -0.3, 1.1, 0.1, 0.4)])
def test_the_refusal_names_the_shape_wherever_it_lies(name: str, keep: Ellipse | None) -> None:
    """Turned, scaled, shifted, in any order and with other last digits: one decision."""
    x, y, named = SHAPES[name]
    for seed in range(60):
        rng = np.random.default_rng(seed)
        turn = rng.uniform(0.0, 2.0 * np.pi) * (seed % 4 > 0)
        size = 10.0 ** rng.uniform(-6.0, 6.0)
        shift = rng.uniform(-1.0, 1.0, 2) * 10.0 ** rng.uniform(-1.0, 2.0) * (seed % 3 > 0)
        order = rng.permutation(x.size) if seed % 2 else np.arange(x.size)
        u = size * (np.cos(turn) * x - np.sin(turn) * y + shift[0])[order]
        v = size * (np.sin(turn) * x + np.cos(turn) * y + shift[1])[order]
        noise = 1e-15 * max(np.abs(u).max(), np.abs(v).max()) * rng.uniform(-1.0, 1.0, (2, x.size))
        # a given ellipse counts only by its middle here
        old = keep if keep is None else Ellipse(size * 0.2, size * -0.3, 1.1, 0.1, size * 0.4)
        for a, b in ((u, v), (u + noise[0], v + noise[1])):
            with pytest.raises(UnusableInput, match=named):
                fit_ellipse(a, b, old, shortest_arc=0.0)


@pytest.mark.parametrize("scale", [(1e-9, 1e-9), (1e6, 1e6), (1.0, 1e-5), (3e4, 1e-1)])
def test_an_ellipse_is_one_in_any_unit_and_with_other_last_digits(
    scale: tuple[float, float],
) -> None:
    phase = np.linspace(0.3, 5.0, 400)
    want = np.array([0.4, -1.3, 1.07, 0.07, 1.0])
    u1, u2 = Ellipse(*want).signals(phase)
    a, b = scale
    for seed in range(20):
        digits = 1.0 + 1e-15 * np.random.default_rng(seed).uniform(-1.0, 1.0, (2, phase.size))
        e = fit_ellipse(a * u1 * digits[0], b * u2 * digits[1]).ellipse
        got = np.array([e.offset_1 / a, e.offset_2 / b, e.ratio * b / a, e.skew, e.radius / a])
        np.testing.assert_allclose(got, want, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("arc", [0.1, 0.3, 1.0])
def test_a_short_arc_without_noise_is_still_an_ellipse(arc: float) -> None:
    for middle in np.linspace(0.0, 2.0 * np.pi, 7):
        phase = middle + arc * np.linspace(-1.0, 1.0, 101)
        e = fit_ellipse(np.cos(phase), np.sin(phase), shortest_arc=0.0).ellipse
        # what the rounding of the samples leaves of it
        assert e.radius == pytest.approx(1.0, rel=max(1e-8, 1e-13 / arc**4))


def test_coefficients_must_be_an_ellipse() -> None:
    for bad in ({"ratio": 0.0}, {"radius": -1.0}, {"skew": 2.0}, {"ratio": float("nan")}):
        with pytest.raises(UnusableInput, match="no ellipse"):
            Ellipse(**bad)
