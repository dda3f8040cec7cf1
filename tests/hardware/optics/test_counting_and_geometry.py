"""Numbers of chapter 4 of the stack actuator thesis, and small errors of length."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Air, Flag
from hardware.optics import (
    AirTrack,
    abbe_error,
    block_duration,
    ciddor_index,
    correct_record,
    cosine_corrected,
    cosine_error,
    dead_path_error,
    displacement_per_fringe,
    increments_of_bits,
    largest_rate,
    largest_speed,
    smallest_step,
    wavelength_in_air,
)

LASER = 632.9908e-9


def test_wavelength_in_a_laboratory() -> None:
    n = float(ciddor_index(293.15, 101.3e3, 0.5))
    assert wavelength_in_air(LASER, n) == pytest.approx(632.819e-9, abs=0.5e-12)
    assert displacement_per_fringe(LASER, n) == pytest.approx(316.41e-9, abs=0.01e-9)
    assert displacement_per_fringe(LASER, n, 4) == pytest.approx(158.2e-9, abs=0.1e-9)


def test_resolution_of_eight_bits() -> None:
    assert smallest_step(632.8e-9, increments_of_bits(8)) == pytest.approx(1.24e-9, abs=5e-12)
    assert smallest_step(632.8e-9, increments_of_bits(8, True)) == pytest.approx(0.62e-9, abs=3e-12)
    assert math.ceil(displacement_per_fringe(632.8e-9) / 1e-9) == 317


def test_speed_and_duration() -> None:
    assert largest_speed(1e6, 632.8e-9) == pytest.approx(0.158, abs=5e-4)
    # the printed 800 mm/s needs a counter of its own, five times faster than the stored samples
    assert 0.8 / largest_speed(1e6, 632.8e-9) > 5.0
    assert block_duration(32768, 3125.0) == pytest.approx(10.48576)
    assert largest_rate(32768, block_duration(32768, 1e6)) == pytest.approx(1e6)


@pytest.mark.parametrize(
    "call",
    [
        lambda: smallest_step(LASER, 0),
        lambda: displacement_per_fringe(LASER, factor=0),
        lambda: displacement_per_fringe(-1.0),
        lambda: wavelength_in_air(LASER, float("nan")),
        lambda: increments_of_bits(0),
        lambda: largest_speed(1e6, LASER, 0.6),
        lambda: block_duration(0, 1e6),
        lambda: largest_rate(100, 0.0),
    ],
)
def test_senseless_numbers_are_refused(call: object) -> None:
    with pytest.raises(UnusableInput):
        call()  # type: ignore[operator]


def test_small_angles_without_cancellation() -> None:
    assert float(cosine_error(4.9e-6, 1e-6)) == pytest.approx(4.9e-6 * 0.5e-12, rel=1e-9)
    s = np.array([0.0, 4.9e-6])
    assert cosine_corrected(s - cosine_error(s, 0.01), 0.01) == pytest.approx(s, rel=1e-12)
    assert float(abbe_error(2e-3, 5e-6)) == pytest.approx(10e-9, rel=1e-6)


def test_one_kelvin_on_a_hundred_millimetres_of_dead_path() -> None:
    n0 = float(ciddor_index(293.15, 101325.0, 0.5))
    n1 = ciddor_index(294.15, 101325.0, 0.5)
    assert float(dead_path_error(0.1, n1, n0)) == pytest.approx(-94e-9, abs=1.5e-9)


def _track(instants: list[float], kelvin: list[float], **more: bool) -> AirTrack:
    n = len(instants)
    ok = np.full(n, more.get("measured", True))
    return AirTrack(np.array(instants), np.array(kelvin), np.full(n, 1e5), np.full(n, 0.5), ok)


def test_a_record_is_recomputed_with_the_air_along_it() -> None:
    t = np.linspace(0.0, 10.0, 2001)
    track = _track([float(k) for k in range(11)], [293.15 + 0.1 * k for k in range(11)])
    true = 2.45e-6 * (1.0 - np.cos(2.0 * np.pi * 2.0 * t))
    # what the counter sees, straight from the phase
    n = np.interp(t, track.instants, track.index())
    phase = 4.0 * np.pi / LASER * (n * (true + 0.1) - n[0] * 0.1)
    n_used = 1.00027
    reading = phase * LASER / (4.0 * np.pi * n_used)
    fixed = correct_record(reading, t, track, index_used=n_used, dead_path=0.1)
    assert np.abs(reading - true).max() > 80e-9
    assert np.abs(fixed.position - true).max() < 1e-15
    assert not fixed.flags.any()
    assert fixed.shift == pytest.approx(fixed.position - reading)
    # without the dead path one kelvin is 5 pm on this stroke
    small = correct_record(true, t, track, index_used=float(n[0]))
    assert 1e-12 < np.abs(small.shift).max() < 6e-12


def test_old_air_is_marked_not_hidden() -> None:
    t = np.arange(0.0, 20.0, 0.5)
    track = _track([0.0, 1.0, 2.0, 12.0], [293.0, 293.0, 293.0, 293.0])
    flags = correct_record(t * 0.0, t, track, index_used=1.0).flags
    stale = t[flags == Flag.AIR_STALE]
    assert stale.min() == 6.5
    assert 12.0 not in stale
    assert set(stale[stale > 12.0]) == set(t[t > 16.0])


@pytest.mark.parametrize("bad", [350.0, float("nan"), 20.0])
def test_impossible_air_does_not_correct(bad: float) -> None:
    t = np.arange(5.0)
    result = correct_record(t * 1e-6, t, _track([0.0], [bad]), index_used=1.0)
    assert np.array_equal(result.position, t * 1e-6)
    assert np.all(result.flags == Flag.AIR_STALE)
    # one bad reading among good ones is left out
    mixed = _track([0.0, 1.0, 2.0], [293.0, bad, 293.0])
    assert np.ptp(correct_record(t, t, mixed, index_used=1.0).index) == 0.0


def test_defaults_are_no_measurement() -> None:
    t = np.arange(3.0)
    result = correct_record(t, t, _track([0.0], [293.0], measured=False), index_used=1.0)
    assert np.all(result.flags == Flag.AIR_STALE)


def test_age_belongs_to_the_instant() -> None:
    def air(kelvin: float, age: float) -> Air:
        return Air(kelvin, 1e5, 0.5, 1.00027, age=age)

    track = AirTrack.of([(1.0, air(293.0, 0.5)), (1.5, air(293.0, 1.0)), (3.0, air(294.0, 0.0))])
    assert track.instants.tolist() == [0.5, 3.0]
    with pytest.raises(UnusableInput, match="at least one"):
        AirTrack.of([])
    with pytest.raises(UnusableInput, match="increase"):
        _track([1.0, 0.0], [293.0, 293.0])
    with pytest.raises(UnusableInput, match="positions"):
        correct_record(np.zeros(3), np.zeros(4), track, index_used=1.0)
