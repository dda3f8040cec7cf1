"""Air, floor and noise: sizes from their physics, the same however a record is cut."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hardware.simulators.plants import AirPath, Disturbed, SensorNoise, Vibration
from hardware.simulators.rig import Rig
from tests.hardware.simulators.test_rig import Lag, Means

STEP = 1e-4


def test_warm_air_reads_as_motion() -> None:
    """100 mm of dead path: -95 nm per kelvin, +27 nm per 100 Pa."""
    hour = 36_000_000
    warm = AirPath(0.1, kelvin_per_hour=1.0).added(hour, 1, STEP)[0]
    high = AirPath(0.1, pascal_per_hour=100.0).added(hour, 1, STEP)[0]
    assert np.asarray(warm)[0] == pytest.approx(-95e-9, rel=1e-9)
    assert np.asarray(high)[0] == pytest.approx(27e-9, rel=1e-9)
    swing = AirPath(0.2, swing=0.5, period=4.0).kelvin(np.array([0.0, 1.0, 2.0]))
    assert np.allclose(swing, [0.0, 0.5, 0.0], atol=1e-12)


def test_turbulence_has_its_size_and_no_jumps() -> None:
    """Rms as asked for, continuous over its knots, zero at the start."""
    air = AirPath(0.1, stir=0.02, seed=3)
    x = np.asarray(air.added(0, 2_000_000, STEP)[0])
    kelvin = x / (0.1 * -9.5e-7)
    assert kelvin[0] == 0.0
    assert np.std(kelvin) == pytest.approx(0.02, rel=0.1)
    assert np.abs(np.diff(kelvin)).max() < 0.02 * 5.0 * np.pi / 2.0 * STEP / 0.1 * 1.5


def test_the_floor_shakes_at_its_lines() -> None:
    """Amplitudes in the spectrum."""
    x = np.asarray(Vibration([(50.0, 3e-9), (18.0, 1e-9)], seed=1).added(0, 10_000, STEP)[0])
    spectrum = np.abs(np.fft.rfft(x)) / 5000.0
    assert spectrum[50] == pytest.approx(3e-9, rel=1e-6)
    assert spectrum[18] == pytest.approx(1e-9, rel=1e-6)


@pytest.mark.parametrize(
    "disturbance",
    [
        AirPath(0.1, kelvin_per_hour=2.0, swing=0.1, stir=0.01),
        Vibration([(50.0, 3e-9)], seed=1),
        SensorNoise(1e-9, 1e-4, seed=2),
    ],
)
def test_it_does_not_depend_on_how_a_record_is_cut(disturbance: Any) -> None:
    """A function of the number of the step, on the rig as well."""
    whole = disturbance.added(7, 5000, STEP)
    parts = [disturbance.added(7 + k, 100, STEP) for k in range(0, 5000, 100)]
    for c in (0, 1):
        joined = np.concatenate([np.broadcast_to(p[c], 100) for p in parts])
        assert np.allclose(joined, whole[c], rtol=0.0, atol=1e-18)
    rigs = [Rig(Disturbed(Lag(), disturbance)) for _ in range(2)]
    for k in range(100):
        for rig, look in zip(rigs, (True, False), strict=True):
            rig.wait(3.3e-5)
            rig.drive(float(k))
            if look:
                rig.seen(np.array([rig.now]))
    t = np.linspace(0.0, rigs[0].now * 0.99, 400)
    a, b = (rig.seen(t) for rig in rigs)
    assert np.allclose(a.x, b.x, rtol=0.0, atol=1e-16)
    assert np.allclose(a.i, b.i, rtol=0.0, atol=1e-13)


def test_noise_has_its_size() -> None:
    """On the steps of the plant."""
    plant = Disturbed(Lag(), SensorNoise(2e-9, 3e-4))
    motion = plant.advance(np.zeros(20_000))
    assert np.std(motion.x) == pytest.approx(2e-9, rel=0.03)
    assert np.std(motion.i) == pytest.approx(3e-4, rel=0.03)


def test_a_plant_that_cannot_look_ahead_is_refused() -> None:
    """Or its noise would be drawn twice."""
    with pytest.raises(TypeError, match="Means"):
        Disturbed(Means(), SensorNoise(1e-9))
