"""The parts of the adapters that need no Bluesky."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Flag
from hardware.ecosystem import ActionStatus, BlockPlan, BlueskyBlock, BlueskyVoltage, block_arrays
from hardware.errors import HardwareError, LimitViolation, LinkLost, TimedOut
from tests.hardware.ecosystem.bench import GAIN, Bench
from tests.patience import HANGS


def test_status_tells_how_it_ended() -> None:
    heard: list[ActionStatus] = []
    gate = threading.Event()
    good = ActionStatus.run("wait", lambda: gate.wait(HANGS))
    good.add_callback(heard.append)
    assert not good.done
    assert "running" in repr(good)
    with pytest.raises(TimedOut, match="wait: still running"):
        good.exception()
    gate.set()
    good.wait(HANGS)
    assert good.success
    good.add_callback(heard.append)
    bad = ActionStatus.run("fail", lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        bad.wait(HANGS)
    assert bad.done
    assert not bad.success
    bad.finish()
    assert isinstance(bad.exception(), ZeroDivisionError)
    assert heard == [good, good]


def test_blocks_are_joined_and_holes_stay_holes() -> None:
    def chunk(first: int, values: list[float]) -> Chunk:
        return Chunk("s", first, {"x": np.array(values)}, {"x": "m"})

    arrays = block_arrays(
        [chunk(0, [1.0, 2.0]), chunk(4, [5.0, 6.0, 7.0]), chunk(9, [1.0])], 6, {"x": "m"}
    )
    assert np.array_equal(arrays["x"], [1.0, 2.0, np.nan, np.nan, 5.0, 6.0], equal_nan=True)
    lost = int(Flag.LOST_BEFORE)
    assert arrays["flags"].tolist() == [0, 0, lost, lost, lost, 0]
    assert arrays["flags"].dtype == np.uint16
    assert np.isnan(block_arrays([], 3, {"x": "m"})["x"]).all()


@pytest.mark.parametrize(
    "bad",
    [
        {"samples": 0, "rate": 1.0},
        {"samples": 1, "rate": float("inf")},
        {"samples": 1, "rate": 1.0, "volts": np.zeros(3)},
    ],
)
def test_senseless_plans_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(UnusableInput, match="block"):
        BlockPlan(**bad)  # type: ignore[arg-type]


def _block(bench: Bench, **more: object) -> BlueskyBlock:
    return BlueskyBlock(
        bench.make,
        {"x": "m"},
        wave=bench.wave,
        clock=bench.clock,
        plan=BlockPlan(1000, 2000.0),
        **more,  # type: ignore[arg-type]
    )


def test_a_trigger_that_never_comes_ends_and_is_aborted() -> None:
    bench = Bench("silent")
    block = _block(bench, patience=1.0)
    with pytest.raises(TimedOut, match="0 of 1000 samples"):
        block.trigger().wait(HANGS)
    assert bench.blocks[0].aborted
    assert 1.4 < bench.rig.now < 1.6
    assert np.all(block.read()["block_flags"]["value"] == Flag.LOST_BEFORE)


def test_a_pulled_cable_keeps_what_had_arrived_and_parks() -> None:
    bench = Bench("gone")
    bench.output.power_up()
    block = _block(bench)
    wave = 40.0 * np.sin(np.pi * np.arange(400) / 400.0)
    block.prepare(BlockPlan(1000, 2000.0, wave, 400.0)).wait(HANGS)
    block.kickoff().wait(HANGS)
    with pytest.raises(LinkLost):
        block.complete().wait(HANGS)
    assert bench.blocks[0].aborted
    assert bench.rig.volts == 0.0
    values = block.read()["block_x"]["value"]
    assert 450 < np.isfinite(values).sum() < 600
    assert np.nanmax(values) > 25.0 * GAIN


def test_unsafe_waveforms_never_begin() -> None:
    bench = Bench()
    bench.output.power_up()
    block = _block(bench)
    for wave in (np.full(10, 150.0), np.array([0.0, np.nan]), np.array([0.0, 99.0])):
        with pytest.raises(LimitViolation):
            block.prepare(BlockPlan(100, 2000.0, wave, 1000.0))
    # the step that proves the read-back at power-up
    assert bench.rig.extremes.highest == 2.0
    assert block.plan.volts is None
    alone = BlueskyBlock(bench.make, {"x": "m"}, clock=bench.clock)
    with pytest.raises(UnusableInput, match="give wave="):
        alone.prepare(BlockPlan(100, 2000.0, np.zeros(10), 1000.0))


def test_stopping_in_the_middle_parks() -> None:
    bench = Bench()
    bench.output.power_up()
    block = _block(bench)
    bench.clock.real = 2e-4
    wave = 40.0 * np.sin(np.pi * np.arange(40000) / 40000.0)
    block.prepare(BlockPlan(200, 2000.0, wave, 400.0))
    block.kickoff()
    with pytest.raises(UnusableInput, match="while a block is being taken"):
        block.kickoff()
    while bench.rig.volts < 5.0 and not block.complete().done:
        time.sleep(2e-4)
    block.stop()
    status = block.complete()
    assert isinstance(status.exception(), HardwareError)
    assert bench.rig.volts == 0.0
    assert bench.rig.extremes.highest < 40.0


def test_voltage_refuses_before_anything_is_sent() -> None:
    bench = Bench()
    voltage = BlueskyVoltage(bench.output, clock=bench.clock)
    assert np.isnan(voltage.position)
    with pytest.raises(LimitViolation, match="power_up"):
        voltage.set(10.0).wait(HANGS)
    voltage.stage().wait(HANGS)
    sent = len(bench.raw.history)
    for bad in (150.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(LimitViolation):
            voltage.check_value(bad)
        with pytest.raises(LimitViolation):
            voltage.set(bad)
    assert len(bench.raw.history) == sent
    voltage.set(30.0).wait(HANGS)
    assert voltage.locate() == {"setpoint": 30.0, "readback": 30.0}
    assert bench.rig.extremes.largest_step < 1.0
    voltage.unstage().wait(HANGS)
    assert bench.rig.volts == 0.0
