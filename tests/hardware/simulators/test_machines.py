"""The ultrasonic stage and the warming plate of the bench, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hardware.simulators.plants import PlatePlant, UltrasonicPlant


def test_the_stage_has_a_dead_zone_a_speed_and_ends() -> None:
    still = UltrasonicPlant(unsteady=0.0)
    assert not still.advance(np.full(2000, 2.0)).x.any()
    fast = UltrasonicPlant(unsteady=0.0)
    assert fast.advance(np.full(2000, -8.0)).x[-1] == -9e-3
    x = fast.advance(np.full(600, 8.0)).x
    # 1 N less 0.05 N of friction over 1.9 N s/m; m / b is 5.8 ms
    assert (x[-1] - x[-101]) / (100 * fast.step) == pytest.approx(0.95 / 1.9, rel=0.02)
    assert fast.advance(np.full(4000, 8.0)).x[-1] == 9e-3
    # switched off it is held, whatever it did before
    end = fast.advance(np.zeros(2000)).x
    assert np.ptp(end[1000:]) == 0.0


def test_a_pressed_stage_gives_its_force_to_the_spring() -> None:
    pressed = UltrasonicPlant(unsteady=0.0, friction=0.0, spring=2e3)
    assert 2e3 * pressed.advance(np.full(8000, 10.0)).x[-1] == pytest.approx(1.0, rel=1e-3)
    assert 2e3 * pressed.advance(np.full(8000, -10.0)).x[-1] == pytest.approx(-1.0, rel=1e-3)


def test_a_detuned_plate_lags_as_its_half_width_says() -> None:
    plate = PlatePlant(tuning=1e3, warming=1e9)
    half = 215e3 / 200.0
    for volts in (-1.5, 0.0, 0.4):
        moved = plate.advance(np.full(400, volts))
        x = 1e3 * volts / half
        assert moved.x[-1] == pytest.approx(x / math.hypot(1.0, x), abs=1e-6)
        assert moved.i[-1] == pytest.approx(1.0 / math.hypot(1.0, x), abs=1e-6)


def test_a_plate_at_resonance_warms_away_from_it() -> None:
    plate = PlatePlant(warming=0.05)
    moved = plate.advance(np.zeros(20_000))
    # x (1 + x^2) = 30 K 150e-6 / K 215 kHz in half widths: less vibration heats less
    x = float(next(r.real for r in np.roots([1.0, 0.0, 1.0, -30.0 * 150e-6 * 200.0]) if not r.imag))
    assert moved.x[-1] == pytest.approx(x / math.hypot(1.0, x), rel=1e-3)
    assert plate.resonance == pytest.approx(-x * 215e3 / 200.0, rel=1e-3)
    kept, after = plate.snapshot(), plate.advance(np.ones(50)).x
    plate.restore(kept)
    np.testing.assert_array_equal(plate.advance(np.ones(50)).x, after)
