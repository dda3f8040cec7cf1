"""Blocks: the thesis' superfast mode."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Flag
from hardware.devices.interferometer import Block
from hardware.devices.interferometer.pump import compiled
from hardware.errors import BeamLost, LinkLost, Overrun, TimedOut
from hardware.simulators.rig import DeviceClock
from tests.counted import calls
from tests.hardware.devices.interferometer.bench import GAIN, Bench, flags, joined, make_bench


def test_full_block_is_read_by_the_loop_at_once(bench: Bench) -> None:
    if compiled() is None:
        pytest.skip("no compiler for the loop")
    block = Block(bench.device, 32_768, 1_000_000.0, start=False, extras=("sin", "cos"))
    block.kickoff()
    assert block.rate == 1e6
    bench.rig.wait(0.02)
    assert block.poll() == []
    bench.rig.wait(0.02)
    chunks: list[Chunk] = []
    # not one for every few samples
    assert calls(lambda: chunks.extend(block.poll())) < 3000
    (chunk,) = chunks
    assert (chunk.first, chunk.n) == (0, 32_768)
    assert np.all(np.diff(chunk.channels["sample"]) == 1.0)
    assert block.done
    assert block.finish() == []
    bench.device.read()


def test_too_much_is_refused_before_arming(bench: Bench) -> None:
    sent = len(bench.front.requests)
    with pytest.raises(Overrun, match="40000 samples asked for, its memory holds 32768"):
        Block(bench.device, 40_000, 1000.0)
    with pytest.raises(UnusableInput, match="whole Hz up to 1e"):
        Block(bench.device, 100, 1_500_000.0)
    with pytest.raises(UnusableInput, match="whole Hz"):
        Block(bench.device, 100, 1000.5)
    with pytest.raises(UnusableInput):
        Block(bench.device, 0, 1000.0)
    assert len(bench.front.requests) == sent


def test_the_device_refuses_too(bench: Bench) -> None:
    with pytest.raises(Overrun, match="-4"):
        Block(bench.device, 40_000, 1000.0, memory=100_000).kickoff()
    with pytest.raises(UnusableInput, match="-18"):
        Block(bench.device, 100, 2_000_000.0, fastest=5e6).kickoff()
    assert bench.device.busy is None


def test_start_trigger_and_its_delay() -> None:
    first = []
    for late in (-1, 0, 1):
        with make_bench() as bench:
            bench.faults.late_samples = late
            block = Block(bench.device, 40, 3125.0)
            block.kickoff()
            bench.rig.wait(0.01)
            bench.rig.trigger()
            bench.rig.wait(5.0 / 3125.0)
            bench.rig.drive(10.0)
            bench.rig.wait(0.02)
            x = joined(block.poll(), "x")
            first.append(int(np.flatnonzero(x > 5.0 * GAIN)[0]))
            block.finish()
    assert first == [first[1] + 1, first[1], first[1] - 1]


def test_a_second_trigger_changes_nothing(bench: Bench) -> None:
    block = Block(bench.device, 100, 10_000.0)
    block.kickoff()
    bench.rig.trigger()
    bench.rig.wait(0.003)
    bench.rig.trigger()
    bench.rig.wait(0.00691)
    assert sum(c.n for c in block.poll()) == 100
    block.finish()


def test_external_clock_has_no_skew() -> None:
    with make_bench(DeviceClock(ppm=5000.0)) as bench:
        block = Block(bench.device, 1000, 3125.0, start=False, external=True)
        block.kickoff()
        for k in range(1000):
            bench.rig.drive(0.01 * k)
            bench.rig.wait(1.0 / 3125.0)
            bench.rig.trigger()
        x = joined(block.poll(), "x")
        assert x == pytest.approx(0.01 * GAIN * np.arange(1000), abs=0.5e-9)
        block.finish()


def test_own_clock_shows_the_skew() -> None:
    # the fault of the thesis: 1000 ppm late after 1000 samples is one sample
    with make_bench(DeviceClock(ppm=1000.0)) as bench:
        block = Block(bench.device, 1001, 1000.0, extras=("clock",))
        block.kickoff()
        bench.rig.trigger()
        bench.rig.wait(0.9995)
        bench.rig.drive(10.0)
        bench.rig.wait(0.01)
        chunks = block.poll()
        x = joined(chunks, "x")
        assert int(np.flatnonzero(x > 5.0 * GAIN)[0]) == 999
        assert joined(chunks, "clock")[-1] == pytest.approx(1.0)
        block.finish()


def test_trigger_that_never_comes_cancels_the_block(bench: Bench) -> None:
    bench.faults.no_trigger = True
    block = Block(bench.device, 1000, 10_000.0, patience=0.5)
    block.kickoff()
    bench.rig.trigger()
    with pytest.raises(TimedOut, match="block was cancelled"):
        bench.run(block, 2.0)
    assert bench.rig.now == pytest.approx(0.6, abs=0.03)
    assert bench.front.requests[-1] == "CANCEL"
    block.abort()
    bench.faults.no_trigger = False
    bench.device.read()


def test_beam_loss_in_a_block(bench: Bench) -> None:
    block = Block(bench.device, 500, 10_000.0, start=False)
    bench.faults.beam_loss_at = 321
    block.kickoff()
    bench.rig.wait(0.1)
    with pytest.raises(BeamLost, match="sample 321") as caught:
        block.poll()
    marks = flags(caught.value.partial)
    assert not marks[:321].any()
    assert np.all(marks[321:] & Flag.BEAM_LOST)
    assert marks.size == 500
    block.abort()


def test_cable_pulled_while_a_block_is_handed_over(bench: Bench) -> None:
    block = Block(bench.device, 1000, 100_000.0, start=False)
    block.kickoff()
    bench.rig.wait(0.1)
    bench.faults.cut_after_bytes = 8 + 8 + 40 * 250 + 5  # after the answer that it is ready
    with pytest.raises(LinkLost) as caught:
        block.poll()
    partial = caught.value.partial
    assert sum(c.n for c in partial) == 250
    assert partial[0].first == 0
    block.abort()
    bench.device.reopen()
    with pytest.raises(BeamLost, match="no zero"):
        bench.device.read()


def test_abort_cancels_and_frees(bench: Bench) -> None:
    block = Block(bench.device, 1000, 1000.0)
    block.kickoff()
    block.abort()
    assert bench.front.requests[-1] == "CANCEL"
    block.abort()
    bench.device.read()


def test_unfinished_block_is_cancelled_by_finish(bench: Bench) -> None:
    block = Block(bench.device, 1000, 1000.0)
    block.kickoff()
    assert block.finish() == []
    assert "CANCEL" in bench.front.requests
    bench.device.read()
