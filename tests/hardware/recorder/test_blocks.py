"""Blocks of the sensor: long ones, full ones, those that an error interrupts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.devices.interferometer import Block, Streaming, Triggered
from hardware.errors import HardwareError, LinkLost, TimedOut
from hardware.recorder import TakePlan, TakeProgress, record
from hardware.station import settings_from
from hardware.storage import flags_of, open_journal, recover

Make = Callable[..., Any]
SENSOR = "interferometer"


def slow(seconds: float, rate: float = 50.0) -> TakePlan:
    t = np.arange(round(seconds * rate)) / rate
    return TakePlan(30.0 - 20.0 * np.cos(2.0 * np.pi * t / seconds), rate, "slow", "start")


def with_sensor(station: Any, **settings: Any) -> None:
    now = station.settings
    station.settings = replace(now, interferometer=replace(now.interferometer, **settings))


@pytest.mark.parametrize(
    ("way", "samples"), [pytest.param("start", 529 * 4, marks=pytest.mark.long), ("clock", 525)]
)
def test_a_block_longer_than_the_patience_is_kept(
    bench: Make, target: Path, way: Any, samples: int
) -> None:
    _, station = bench()
    plan = replace(slow(10.5), synchronisation=way)
    assert plan.seconds > 2.0 * plan.patience
    taken = record(station.station(plan), plan, target)
    assert taken.recording.n >= plan.volts.size - 2
    assert open_journal(taken.journal).read(SENSOR).n == samples


def test_a_trigger_that_never_comes_still_ends_a_long_take(bench: Make, target: Path) -> None:
    server, station = bench()
    assert server.control.answer(f"FAULT {SENSOR} no_trigger=1").startswith("OK")
    plan = replace(slow(3.0), patience=0.4)
    with pytest.raises(TimedOut, match="trigger"):
        record(station.station(plan), plan, target)
    assert server.rig.volts == 0.0


@pytest.mark.parametrize("error", [KeyboardInterrupt, LinkLost])
def test_a_finished_block_survives_an_error_of_something_else(
    bench: Make, target: Path, error: type[BaseException]
) -> None:
    server, station = bench()
    plan = slow(1.0)

    def fail(step: TakeProgress) -> None:
        if step.phase == "drain":
            station.clock.sleep(0.2)  # the block ends, nobody has asked for it yet
            raise error("stop")

    with pytest.raises(error):
        record(station.station(plan), plan, target, watch=fail)
    kept = open_journal(target.with_suffix(".journal")).read(SENSOR)
    assert kept.n == 54 * 4
    assert server.rig.volts == 0.0
    (path,) = recover(target.with_suffix(".journal"))[:1]
    assert path.exists()


def test_what_a_stream_holds_survives_an_error(bench: Make, target: Path) -> None:
    _, station = bench()
    with_sensor(station, rate=1000.0)
    plan = replace(slow(1.0), synchronisation="none")

    def fail(step: TakeProgress) -> None:
        if step.phase == "play" and step.written > 25:
            station.clock.sleep(0.1)
            raise HardwareError("something else failed")

    with pytest.raises(HardwareError):
        record(station.station(plan), plan, target, watch=fail)
    kept = open_journal(target.with_suffix(".journal")).read(SENSOR)
    assert kept.n >= 600


def test_the_block_of_the_thesis_is_taken_as_asked_for(bench: Make) -> None:
    _, station = bench()
    plan = slow(32_768 / 3125.0, 3125.0)
    assert plan.volts.size == 32_768
    for rate in (None, 3125.0):
        with_sensor(station, rate=rate)
        (sensor,) = station.station(plan).sensors
        assert isinstance(sensor, Block)
        assert sensor.rate == 3125.0
        assert sensor.samples == 32_768
        assert not station.station(plan).remarks


def test_a_rate_that_no_block_holds_is_streamed_and_said(
    bench: Make, target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hardware.station.opening.MEMORY", 1000)
    _, station = bench()
    with_sensor(station, rate=50_000.0)
    plan = slow(0.2)
    made = station.station(plan)
    (sensor,) = made.sensors
    assert isinstance(sensor, Streaming)
    (remark,) = made.remarks
    assert "no block of 1000" in remark
    assert "16000 Hz" in remark
    assert record(made, plan, target).sentences[0] == remark


def test_a_device_whose_blocks_no_edge_clocks_is_read_in_its_fast_mode(
    bench: Make, swing: Any, target: Path
) -> None:
    server, station = bench(clocked="fast")
    plan = TakePlan(swing, 10e3, "swing", "clock")
    made = station.station(plan)
    assert isinstance(made.sensors[0], Triggered)
    taken = record(made, plan, target)
    assert taken.recording.n == swing.size
    assert not flags_of(taken.recording, SENSOR).any()
    with pytest.raises(UnusableInput, match=r'20000 Hz.*clocked = "block"'):
        station.station(replace(plan, rate=20e3))
    # a station file that claims more than the device can is answered by the device
    with_sensor(station, clocked="block")
    with pytest.raises(UnusableInput, match="IfmSetBlockMode"):
        record(station.station(plan), plan, target.with_name("other"))
    assert server.rig.volts == 0.0


def test_an_unknown_station_is_taken_for_the_thesis_device() -> None:
    table = {"envelope": {"preset": "P-840.1-unipolar"}, "output": {"kind": "mf634"}}
    plain = settings_from({**table, "interferometer": {}}).interferometer
    assert plain is not None
    assert plain.clocked == "fast"
    with pytest.raises(UnusableInput, match="blok"):
        settings_from({**table, "interferometer": {"clocked": "blok"}})


@pytest.mark.parametrize("ppm", [-2000.0, 2000.0])
def test_a_full_block_on_a_clock_of_its_own_loses_the_end_only(
    bench: Make, target: Path, ppm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There is no room for the samples behind the wave that make up for a fast clock."""
    monkeypatch.setattr("hardware.station.opening.MEMORY", 1000)
    _, station = bench(interferometer={"ppm": ppm})
    plan = slow(5.0, 200.0)
    made = station.station(plan)
    assert (made.sensors[0].samples, made.sensors[0].rate) == (1000, 200.0)
    taken = record(made, plan, target)
    lost = 1000 - taken.recording.n
    assert 0 <= lost <= (4 if ppm < 0.0 else 1)
