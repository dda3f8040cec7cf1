"""The adapters over our own interferometer, through the stub of the vendor's library."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from hardware.contracts import Flag
from hardware.devices.controllers import GcsController, GcsTalk
from hardware.devices.interferometer import Block
from hardware.devices.transport import TcpTransport
from hardware.ecosystem import (
    BlockPlan,
    BlueskyBlock,
    BlueskyDisplacement,
    BlueskyVoltage,
    DisplacementSource,
)
from hardware.envelope import P840_1_UNIPOLAR, GuardedOutput
from hardware.errors import BeamLost, Overrun
from hardware.simulators.controllers import GcsFront
from tests.hardware.devices.interferometer import bench as benches
from tests.patience import HANGS

pytestmark = pytest.mark.filterwarnings("default")


@pytest.fixture
def bench() -> Iterator[benches.Bench]:
    if not benches.has_gcc():
        pytest.skip("the stub of siosifm is C code and there is no gcc")
    with benches.make_bench() as made:
        yield made


def _block(bench: benches.Bench) -> BlueskyBlock:
    return BlueskyBlock(
        lambda n, rate: Block(bench.device, n, rate, start=False),
        {"x": "m"},
        clock=bench.device.clock,
    )


def test_displacement_of_the_interferometer(bench: benches.Bench) -> None:
    assert isinstance(bench.device, DisplacementSource)
    displacement = BlueskyDisplacement(bench.device)
    displacement.stage().wait(HANGS)
    bench.rig.drive(10.0)
    bench.rig.wait(0.05)
    displacement.trigger().wait(HANGS)
    reading = displacement.read()
    assert reading["displacement"]["value"] == pytest.approx(10.0 * benches.GAIN, abs=2e-9)
    assert not reading["displacement_flags"]["value"] & Flag.BEAM_LOST


def test_a_full_block_of_the_interferometer(bench: benches.Bench) -> None:
    block = _block(bench)
    block.prepare(BlockPlan(32768, 1e6)).wait(HANGS)
    block.trigger().wait(HANGS)
    reading = block.read()
    assert reading["block_x"]["value"].shape == (32768,)
    assert np.isfinite(reading["block_x"]["value"]).all()
    assert "SIOS" in str(block.describe()["block_x"]["source"])


def test_what_the_device_refuses_the_adapter_refuses(bench: benches.Bench) -> None:
    block = _block(bench)
    block.prepare(BlockPlan(40000, 1e6)).wait(HANGS)
    with pytest.raises(Overrun):
        block.kickoff()
    bench.device.beam_lost()
    with pytest.raises(BeamLost):
        BlueskyDisplacement(bench.device).trigger().wait(HANGS)


def test_a_scan_over_the_wire(bench: benches.Bench) -> None:
    """RunEngine, guard, GCS over TCP, plant, interferometer's C interface: one bench."""
    engines = pytest.importorskip("bluesky.run_engine")
    plans = pytest.importorskip("bluesky.plans")
    front = GcsFront(bench.rig)
    host, _, port = front.start().rpartition(":")
    clock = bench.device.clock
    raw = GcsController(GcsTalk(TcpTransport(host, int(port))), clock=clock)
    output = GuardedOutput(raw, P840_1_UNIPOLAR, clock)
    voltage = BlueskyVoltage(output, readback=True, clock=clock)
    displacement = BlueskyDisplacement(bench.device)
    events = []
    try:
        engines.RunEngine({}, context_managers=[])(
            plans.list_scan([displacement], voltage, [0.0, 8.0, 20.0, 4.0]),
            {"event": [lambda _, event: events.append(event["data"])]},
        )
    finally:
        raw.close()
        front.stop()
    assert [e["voltage"] for e in events] == [0.0, 8.0, 20.0, 4.0]
    assert [e["voltage_readback"] for e in events] == pytest.approx([0.0, 8.0, 20.0, 4.0], abs=0.01)
    x = [e["displacement"] for e in events]
    assert x == pytest.approx([benches.GAIN * v for v in (0.0, 8.0, 20.0, 4.0)], abs=2e-9)
    assert bench.rig.volts == pytest.approx(0.0, abs=0.01)
    assert bench.rig.extremes.highest < 20.1


@pytest.mark.parametrize("sensor_first", [True, False])
def test_staged_without_waiting_the_zero_is_taken_at_rest(
    bench: benches.Bench, sensor_first: bool
) -> None:
    """An engine stages all devices of a plan before it waits for any of them."""
    front = GcsFront(bench.rig)
    host, _, port = front.start().rpartition(":")
    clock = bench.device.clock
    raw = GcsController(GcsTalk(TcpTransport(host, int(port))), clock=clock)
    displacement = BlueskyDisplacement(bench.device)
    try:
        raw.open()
        raw.write(60.0)
        bench.rig.wait(0.05)
        voltage = BlueskyVoltage(GuardedOutput(raw, P840_1_UNIPOLAR, clock), clock=clock)
        order = (displacement, voltage) if sensor_first else (voltage, displacement)
        for status in [device.stage() for device in order]:
            status.wait(HANGS)
        bench.rig.wait(0.05)
        moved = bench.rig.volts - 60.0
        assert moved < -50.0
        x = bench.device.read().value
    finally:
        raw.close()
        front.stop()
    assert x == pytest.approx(benches.GAIN * moved if sensor_first else 0.0, abs=2e-9)
