"""QCoDeS: its validators, units and snapshots around the guard."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.ecosystem import BlockPlan
from hardware.errors import LimitViolation, LinkLost
from tests.hardware.ecosystem.bench import GAIN, Bench

pytestmark = pytest.mark.filterwarnings("default")

pytest.importorskip("qcodes")


@pytest.fixture
def instruments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    # it looks for its configuration, and writes its logs, in the home
    monkeypatch.setenv("HOME", str(tmp_path))
    from hardware.ecosystem import with_qcodes

    yield with_qcodes
    with_qcodes.QCoDeSVoltage.close_all()


def test_voltage_between_its_limits(instruments: Any) -> None:
    bench = Bench()
    voltage = instruments.QCoDeSVoltage("piezo", bench.output)
    assert math.isnan(voltage.voltage())
    assert voltage.state() == "unknown"
    with pytest.raises(LimitViolation, match="power_up"):
        voltage.voltage(1.0)
    voltage.power_up()
    sent = len(bench.raw.history)
    for bad in (100.1, -0.1, float("inf"), "much"):
        with pytest.raises((ValueError, TypeError)):
            voltage.voltage(bad)
    with pytest.raises(ValueError, match="nan"):
        voltage.voltage(float("nan"))
    assert len(bench.raw.history) == sent
    voltage.voltage(40.0)
    assert voltage.voltage() == 40.0
    assert voltage.measured_voltage() == 40.0
    assert bench.rig.extremes.largest_step < 1.0
    voltage.park()
    assert bench.rig.volts == 0.0
    voltage.voltage(20.0)
    voltage.close()
    assert bench.rig.volts == 0.0


def test_snapshot_holds_units_limits_and_device(instruments: Any) -> None:
    bench = Bench()
    voltage = instruments.QCoDeSVoltage("piezo", bench.output)
    voltage.power_up()
    snapshot = voltage.snapshot(update=True)
    assert snapshot["parameters"]["voltage"]["unit"] == "V"
    assert snapshot["parameters"]["voltage"]["value"] == 0.0
    assert snapshot["metadata"]["envelope"]["v_max"] == 100.0
    assert snapshot["parameters"]["IDN"]["value"]["model"] == "rig output"
    assert "0.0<=v<=100.0" in str(snapshot["parameters"]["voltage"]["validators"])


def test_displacement_in_metres(instruments: Any) -> None:
    bench = Bench()
    length = instruments.QCoDeSDisplacement("length", bench.sensor)
    bench.rig.drive(50.0)
    bench.rig.wait(0.01)
    assert length.displacement() == pytest.approx(50.0 * GAIN)
    assert length.displacement.unit == "m"
    length.zero()
    bench.sensor.flags = Flag.LEVEL_LOW
    assert length.displacement() == 0.0
    assert length.flags() == Flag.LEVEL_LOW
    assert length.get_idn()["serial"] == "8"
    with pytest.raises(NotImplementedError):
        length.displacement(1.0)


def test_blocks_as_arrays_over_time(instruments: Any) -> None:
    bench = Bench()
    block = instruments.BlockInstrument(
        "block", bench.make, {"x": "m"}, plan=BlockPlan(1000, 2000.0), clock=bench.clock
    )
    with pytest.raises(UnusableInput, match="no block of 1000 samples yet"):
        block.x()
    bench.rig.drive(10.0)
    bench.rig.wait(0.01)
    block.take()
    assert block.x() == pytest.approx(np.full(1000, 10.0 * GAIN))
    assert block.x.unit == "m"
    assert block.time()[-1] == pytest.approx(0.4995)
    assert not block.flags().any()
    block.x.validate_consistent_shape()
    with pytest.raises(ValueError, match="0"):
        block.samples(0)
    block.samples(100)
    with pytest.raises(UnusableInput, match="100 samples"):
        block.x()
    block.take()
    assert block.x().shape == (100,)
    bench.fault = "gone"
    block.samples(2000)
    with pytest.raises(LinkLost):
        block.take()
    assert 900 < np.isfinite(block.x()).sum() < 1200
    assert block.flags()[-1] == Flag.LOST_BEFORE
