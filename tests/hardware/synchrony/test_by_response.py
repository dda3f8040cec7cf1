"""The ratio of two clocks from the answer of actuators with dynamics, hysteresis and friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondsight.cli.acquire_signal import waveform
from hardware.envelope import P840_1_UNIPOLAR
from hardware.simulators.plants import GeneratedPlant, HystereticPlant, conceal
from hardware.simulators.plants.stack import STEP
from hardware.simulators.rig import DeviceClock, Rig
from hardware.synchrony import ClockWiring, Stream, align
from hardware.synchrony.by_response import skew_by_response

RATE, FINE = 10e3, 40e3
FRICTION = 0.286


def actuator(seed: int, effect: str) -> GeneratedPlant:
    """Return a stack that creeps strongly, or rubs with 0.29 N."""
    drawn = conceal(seed, effect, strength="strong")
    rubbing = {"level": FRICTION} if effect == "coulomb_friction" else {}
    effects = [replace(e, numbers={**e.numbers, **rubbing}) for e in drawn.effects]
    return GeneratedPlant(
        "stack", drawn.case.parameters, effects, sized_on=drawn.sized_on, step=STEP
    )


def streams(
    effect: str, seed: int, ppm: float, samples: int, drift_ppm: float = 0.0
) -> tuple[Stream, Stream]:
    """Drive an independent plant, read it by a clock of its own with 1 nm of noise."""
    plant = conceal(seed, "none").plant() if effect == "hysteresis" else actuator(seed, effect)
    # plays of 5 to 40 V that together move as much as a quarter of the voltage
    radii, gains = (5.0, 15.0, 40.0), (0.1, 0.1, 0.05)
    rig = Rig(HystereticPlant(plant, radii, gains) if effect == "hysteresis" else plant, keep=2.0)
    volts = waveform("session", RATE, samples, P840_1_UNIPOLAR, seed)[0]
    for u in np.linspace(0.0, volts[0], 100):
        rig.drive(float(u))
        rig.wait(1e-3)
    rig.wait(0.05)
    start = rig.now
    for u in volts:
        rig.drive(float(u))
        rig.wait(1.0 / RATE)
    rig.wait(1e-3)
    clock = DeviceClock(ppm=ppm, drift_ppm=drift_ppm)
    instants = clock.instants(start, 0, int(samples / RATE * FINE) - 20, FINE)
    noise = 1e-9 * np.random.default_rng(seed).standard_normal(instants.size)
    return Stream.of(RATE, V=volts), Stream.of(FINE, x=rig.seen(instants).x + noise)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize(
    ("effect", "ppm", "within"),
    [
        ("none", -138.0, 0.3),
        ("hysteresis", 37.0, 4.0),
        ("creep", 290.0, 0.5),
        ("coulomb_friction", 17.0, 6.0),
    ],
)
def test_the_ratio_is_found_and_its_error_is_true(effect: str, ppm: float, within: float) -> None:
    drive, sensor = streams(effect, 7, ppm, 2500)
    found = skew_by_response(drive, sensor, 0.0)
    assert found is not None
    assert abs(1e6 * found.value - ppm) < 4.0 * 1e6 * found.error
    assert 1e6 * found.error < within


def test_align_takes_it_and_still_knows_no_delay() -> None:
    drive, sensor = streams("hysteresis", 7, 37.0, 2500)
    a = align(drive, sensor, ClockWiring())
    low, high = a.skew_interval
    assert low < 37e-6 < high
    assert high - low < 30e-6
    assert not a.delay_known


def test_too_short_or_at_rest_gives_nothing() -> None:
    drive, sensor = streams("none", 7, 0.0, 300)
    assert skew_by_response(drive, sensor, 0.0) is None
    still = Stream.of(RATE, V=np.ones(2500))
    assert skew_by_response(still, Stream.of(FINE, x=np.zeros(9000)), 0.0) is None


def test_a_drift_that_shows_is_told_and_none_is_invented() -> None:
    # 6000 ppm a minute: 1e-4 a second
    drive, sensor = streams("none", 7, 20.0, 2500, drift_ppm=6000.0)
    found = skew_by_response(drive, sensor, 0.0)
    assert found is not None
    assert abs(found.drift - 1e-4) < 4.0 * found.drift_error
    assert found.drift_error < 2e-5
    assert abs(found.value - 20e-6) < 4.0 * found.error
    steady = skew_by_response(*streams("none", 7, 20.0, 2500), 0.0)
    assert steady is not None
    assert steady.drift == 0.0
