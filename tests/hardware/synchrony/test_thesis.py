"""The two clocks of section 6.6 of the stack actuator thesis, and the numbers to reach."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hardware.contracts import Flag
from hardware.simulators.rig import DeviceClock
from hardware.synchrony import Budget, ClockWiring, Stream, TimeMap, align, false_width, merged
from tests.hardware.synchrony.bench import LAG, RATE, record, sine, true_map, widths

CLOCK = DeviceClock(ppm=37.0, offset=123e-6)
KNOWN = ClockWiring(lag=LAG)


@pytest.mark.parametrize(
    ("ppm", "nanometres"),
    [(1.0, (0.6, 2.9, 29.0)), (10.0, (5.8, 29.0, 290.0)), (100.0, (58.0, 290.0, 2695.0))],
)
def test_false_width_of_a_skew(ppm: float, nanometres: tuple[float, ...]) -> None:
    # 4.4 um, 10.49 s; the linear 2900 nm of 100 ppm at 100 Hz is 2695 nm by the sine
    for f, wanted in zip((2.0, 10.0, 100.0), nanometres, strict=True):
        made = 1e9 * false_width(4.4e-6, f, 1e-6 * ppm * 10.49)
        assert made == pytest.approx(wanted, rel=0.04)


def test_false_width_of_a_late_trigger() -> None:
    assert 1e9 * false_width(4.4e-6, 2.0, 1.0 / RATE) == pytest.approx(17.7, abs=0.05)
    assert 1e9 * false_width(4.4e-6, 100.0, 1.0 / RATE) == pytest.approx(885.0, rel=0.012)


@pytest.mark.parametrize("f", [2.0, 100.0])
def test_false_width_is_made_by_a_skew(f: float) -> None:
    # a smooth drive; between the steps of a slow one the sign of the misfit matters as well
    drive, sensor = record(sine(f), DeviceClock(ppm=10.0), drive_rate=8.0 * RATE)
    true, nominal = widths(drive, sensor, TimeMap(skew=10e-6), TimeMap())
    # the loop is about 1.1 times as steep at 50 V as a sine of its stroke
    made = false_width(4.4e-6, f, 10e-6 * 9.99)
    assert abs(nominal - true) == pytest.approx(1.1 * made, rel=0.05)


@pytest.mark.parametrize(("f", "allowed"), [(2.0, 1e-9), (100.0, 5e-9)])
@pytest.mark.parametrize("wiring", [KNOWN, ClockWiring()], ids=["lag known", "lag unknown"])
def test_a_copy_gives_ratio_delay_and_width(f: float, allowed: float, wiring: ClockWiring) -> None:
    drive, sensor = record(sine(f), CLOCK)
    found = align(drive, sensor, wiring)
    assert abs(found.map.skew - 37e-6) < 0.1e-6
    assert abs(found.map.delay - 123e-6) < 1.5e-6
    assert found.delay_known
    assert found.flag is Flag.GOOD
    truth = true_map(CLOCK)
    true, corrected, raw = widths(drive, sensor, truth, found.map, TimeMap())
    assert abs(corrected - true) < allowed
    assert abs(raw - true) > 10.0 * allowed
    low, high = found.delay_interval
    assert low < 123e-6 < high
    assert found.how == "copy"


def test_an_edge_in_the_record_does_as_well() -> None:
    def edges(t: np.ndarray) -> np.ndarray:
        return np.asarray(np.where((t > 0.5) & (t < 9.7), 80.0, 20.0))

    drive, sensor = record(edges, CLOCK, length=False)
    found = align(drive, sensor, KNOWN)
    assert abs(found.map.skew - 37e-6) < 0.1e-6
    assert abs(found.map.delay - 123e-6) < 1.5e-6
    (low, high), (slow, fast) = found.delay_interval, found.skew_interval
    assert low < 123e-6 < high
    assert slow < 37e-6 < fast


@pytest.mark.parametrize("f", [2.0, 100.0])
@pytest.mark.sampled(every=2)
def test_one_sine_without_a_copy_tells_the_ratio_only(f: float) -> None:
    drive, sensor = record(sine(f), CLOCK)
    alone = Stream.of(RATE, x=sensor.channels["x"])
    found = align(drive, alone)
    assert found.how == "phase"
    low, high = found.skew_interval
    assert low < 37e-6 < high
    assert high - low < 3e-6
    assert not found.delay_known
    assert found.flag is Flag.UNSYNCHRONISED
    assert found.delay_interval == (-math.inf, math.inf)
    assert "NOT known" in found.sentence
    together = merged(drive, alone, found)
    assert np.all(together.flags & int(Flag.UNSYNCHRONISED))
    # the same record with the trigger known is another matter
    known = align(drive, alone, ClockWiring(delay=123e-6, delay_error=1e-6))
    assert known.delay_known
    assert known.map.delay == 123e-6


def test_the_delay_of_one_sine_leaves_no_trace() -> None:
    # two delays, one record: no method could tell; each is declared unknown, none is guessed
    plain = align(*alone(record(sine(2.0), DeviceClock(ppm=37.0), n=8192)))
    late = align(*alone(record(sine(2.0), CLOCK, n=8192)))
    assert plain.map.delay == late.map.delay == 0.0
    assert not plain.delay_known
    assert not late.delay_known


def alone(pair: tuple[Stream, Stream]) -> tuple[Stream, Stream]:
    return pair[0], Stream.of(RATE, x=pair[1].channels["x"])


def test_a_budget_in_nanometres() -> None:
    from hardware.errors import ClockSkewError

    drive, sensor = record(sine(100.0), CLOCK, n=4096)
    strict = Budget(width=1e-12, stroke=4.4e-6, frequency=100.0)
    with pytest.raises(ClockSkewError, match="nm of loop width at 100 Hz") as caught:
        align(drive, sensor, KNOWN, budget=strict)
    assert caught.value.partial.map.delay == pytest.approx(123e-6, abs=1e-6)
    marked = align(
        drive, sensor, KNOWN,
        budget=Budget(width=1e-12, stroke=4.4e-6, frequency=100.0, excess="mark"),
    )  # fmt: skip
    assert marked.flag is Flag.UNSYNCHRONISED
    kept = align(drive, sensor, KNOWN, budget=Budget(width=5e-9, stroke=4.4e-6, frequency=100.0))
    assert kept.flag is Flag.GOOD
