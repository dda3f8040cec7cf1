"""Opening, zero, readings, air and health."""

from __future__ import annotations

import ctypes
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.devices.interferometer import VARIABLE, Interferometer, Streaming, VendorLibrary
from hardware.devices.interferometer.quietly import quietly
from hardware.devices.interferometer.signatures import SIGNATURES
from hardware.errors import BeamLost, DriverMissing, LinkLost, ProtocolFault
from hardware.simulators.control.client import LocalClock
from hardware.simulators.rig import Rig
from hardware.simulators.siosifm import AirAround, Quadrature, index_of_air
from tests.hardware.devices.interferometer.bench import GAIN, Bench, Follower, make_bench, stub


def test_no_library_is_said_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DriverMissing, match=r"cannot be loaded.*check the path"):
        VendorLibrary(tmp_path / "nothing.so")
    monkeypatch.delenv(VARIABLE, raising=False)
    with pytest.raises(DriverMissing, match=VARIABLE):
        VendorLibrary()
    monkeypatch.setenv(VARIABLE, str(stub()))
    assert VendorLibrary().path == str(stub())


def test_the_stub_has_every_function_and_doubles_stay_doubles() -> None:
    library = VendorLibrary(stub())
    missing = [name for name in SIGNATURES if not library.has(name)]
    assert missing == []
    assert library.function("IfmLengthValue").restype is ctypes.c_double
    assert library.function("IfmSetDeadPath").argtypes[2] is ctypes.c_int32
    # 632.819 nm: the vendor's figure for He-Ne light at 20 degC, 101.3 kPa, 50 %
    air = library.call("IfmCalculateWavelength", 632.991, 20.0, 101_300.0, 50.0)
    assert air == pytest.approx(632.819, abs=2e-3)


@pytest.mark.parametrize(
    "address", ["usb", "usb:0", "usb:serial=1234", "com:/dev/ttyACM0", "demo", "demo:1"]
)
def test_all_ways_to_open_lead_to_the_device(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS", bench.address)
    with Interferometer(address, library=stub(), clock=LocalClock(bench.rig)) as device:
        assert (device.identity.maker, device.identity.model) == ("SIOS", "RE-10")
        assert device.identity.serial == "B001234"


def test_nobody_there_and_unreadable_addresses(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = LocalClock(bench.rig)
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS", "127.0.0.1:1")
    with pytest.raises(LinkLost, match="no device on USB"):
        Interferometer("usb", library=stub(), clock=clock)
    with pytest.raises(LinkLost, match="check cable"):
        Interferometer("net:127.0.0.1:1", library=stub(), clock=clock)
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS", bench.address)
    with pytest.raises(LinkLost, match="found: 1234"):
        Interferometer("usb:serial=99", library=stub(), clock=clock)
    for address in ("gpib:3", "net:here", "usb:first", ""):
        with pytest.raises(UnusableInput, match="cannot be read"):
            Interferometer(address, library=stub(), clock=clock)


def test_closing_one_device_leaves_the_others_open(bench: Bench) -> None:
    address = f"net:{bench.address}"
    for _ in range(3):
        with Interferometer(address, library=stub(), clock=LocalClock(bench.rig)) as other:
            other.zero()
    assert bench.device.present
    bench.device.close()
    for _ in range(10):  # more than the library has room for at once
        with pytest.raises(LinkLost):
            Interferometer("net:127.0.0.1:1", library=stub(), clock=LocalClock(bench.rig))
    bench.device.reopen()
    bench.device.zero()


def test_reading_follows_the_mirror_and_needs_a_zero() -> None:
    with make_bench(zero=False) as bench:
        with pytest.raises(BeamLost, match=r"zero\(\)"):
            bench.device.read()
        bench.rig.drive(20.0)
        bench.rig.wait(0.01)
        bench.device.zero()
        bench.rig.drive(50.0)
        bench.rig.wait(0.01)
        reading = bench.device.read()
        assert reading.value == pytest.approx(30.0 * GAIN, abs=1e-10)
        assert reading.flags == Flag.GOOD
        assert reading.time == pytest.approx(bench.rig.now)


def test_dead_path_and_preset_are_handed_over_before_the_zero() -> None:
    with make_bench(zero=False) as bench:
        address = f"net:{bench.address}"
        with Interferometer(
            address, library=stub(), clock=LocalClock(bench.rig), dead_path=0.12, preset=5e-6
        ) as device:
            device.zero()
            asked = [r.split()[0] for r in bench.front.requests]
            assert asked.index("DEADPATH") < asked.index("ZERO")
            assert asked.index("PRESET") < asked.index("ZERO")
            assert "DEADPATH 0 120" in bench.front.requests
            assert device.read().value == pytest.approx(5e-6, abs=1e-10)
    with pytest.raises(UnusableInput, match="whole millimetres"):
        Interferometer("net:127.0.0.1:1", library=stub(), dead_path=0.0123456)


def test_dead_path_takes_the_drift_of_the_air_away() -> None:
    # 1 K on 100 mm of air is about 93 nm
    shift = []
    for told in (0.0, 0.1):
        rig = Rig(Follower(), keep=5.0)
        air = AirAround(warming=0.01)
        with make_bench(zero=False, air=air, dead_path=0.1) as bench:
            rig = bench.rig
            with Interferometer(
                f"net:{bench.address}", library=stub(), clock=LocalClock(rig), dead_path=told
            ) as device:
                device.zero()
                rig.wait(100.0)
                shift.append(device.read().value)
    assert shift[0] == pytest.approx(-93e-9, abs=3e-9)
    assert shift[1] == pytest.approx(0.0, abs=1.5e-9)


def test_air_is_told_with_index_and_age(bench: Bench) -> None:
    environment = bench.device.environment()
    air = environment.air
    assert (air.temperature, air.pressure, air.humidity) == (293.15, 101_325.0, 0.5)
    assert air.measured
    assert environment.problems == ()
    index = float(index_of_air(np.array(20.0), np.array(101_325.0), np.array(50.0)))
    assert air.index == pytest.approx(index, abs=1e-12)
    assert environment.wavelength == pytest.approx(environment.vacuum_wavelength / index)
    bench.rig.wait(0.5)
    assert bench.device.environment().air.age == pytest.approx(0.5, abs=0.02)


def test_silent_sensors_become_stale_after_four_seconds(bench: Bench) -> None:
    bench.device.environment()
    bench.faults.stale_air = True
    bench.device.environment()
    bench.rig.wait(5.0)
    environment = bench.device.environment()
    assert environment.air.age > 4.0
    assert any("stale" in p for p in environment.problems)
    assert environment.flag == Flag.AIR_STALE
    assert bench.device.read().flags & Flag.AIR_STALE
    bench.device.correct_for_air(False)
    assert bench.device.environment().flag == Flag.GOOD
    bench.device.correct_for_air(True)
    bench.faults.stale_air = False
    assert bench.device.environment().problems == ()


@pytest.mark.parametrize(
    ("name", "value", "inside"),
    [
        ("temperature", 3.9, 4.1), ("temperature", 50.1, 49.9),
        ("pressure", 69e3, 71e3), ("pressure", 121e3, 119e3),
        ("humidity", 2.0, 4.0), ("humidity", 99.5, 98.5),
    ],
)  # fmt: skip
def test_air_out_of_range_is_marked(bench: Bench, name: str, value: float, inside: float) -> None:
    setattr(bench.faults, name, value)
    environment = bench.device.environment()
    assert any(p.startswith(name) and "outside" in p for p in environment.problems)
    assert not environment.air.measured
    assert bench.device.read().flags & Flag.AIR_STALE
    setattr(bench.faults, name, inside)
    assert bench.device.environment().problems == ()


def test_air_may_be_told_where_there_are_no_sensors(bench: Bench) -> None:
    bench.faults.stale_air = True
    bench.device.tell_air(298.15, 99e3, 0.3)
    environment = bench.device.environment()
    assert environment.air.temperature == pytest.approx(298.15)
    assert environment.air.humidity == pytest.approx(0.3)
    index = float(index_of_air(np.array(25.0), np.array(99e3), np.array(30.0)))
    assert environment.air.index == pytest.approx(index, abs=1e-12)
    assert not environment.air.measured
    assert environment.flag == Flag.GOOD
    with pytest.raises(UnusableInput, match="give K"):
        bench.device.tell_air(25.0, 99e3, 0.3)
    bench.faults.stale_air = False
    bench.device.use_sensors()
    assert bench.device.air() == replace(bench.device.environment().air, age=0.0)
    assert bench.device.environment().air.measured


def test_a_call_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    hanging, asked, join = threading.Event(), [], threading.Thread.join

    def joining(thread: threading.Thread, timeout: float | None = None) -> None:
        asked.append(timeout)
        join(thread, timeout)

    monkeypatch.setattr(threading.Thread, "join", joining)
    # it would never come back, and gets no more patience than told
    assert not quietly(hanging.wait, 0.02)
    assert asked == [0.02]
    hanging.set()
    assert quietly(lambda: 1 / 0)


def test_ellipse_correction_of_the_device() -> None:
    shape = Quadrature(offset_cosine=0.03, offset_sine=-0.04, ratio=1.07, phase=np.radians(4.0))
    with make_bench(quadrature=shape) as bench:
        told = bench.device.ellipse()
        assert not told.active
        assert told.cosine_offset == pytest.approx(0.03 * 8000.0)
        assert (told.ratio, told.phase) == (1.07, np.radians(4.0))


def test_one_measurement_at_a_time(bench: Bench) -> None:
    stream = Streaming(bench.device)
    stream.kickoff()
    with pytest.raises(ProtocolFault, match="measurement runs"):
        Streaming(bench.device).kickoff()
    with pytest.raises(ProtocolFault, match="zero while"):
        bench.device.zero()
    bench.rig.wait(0.01)
    assert bench.device.read().flags == Flag.GOOD  # the newest value; it stays in the stream
    assert sum(c.n for c in stream.poll()) == 161
    stream.abort()
    stream.abort()
    bench.device.zero()


def test_after_a_lost_link_a_zero_is_required(bench: Bench) -> None:
    bench.front.cut()
    with pytest.raises(LinkLost, match="IfmSetTrigger"):
        bench.device.read()
    assert not bench.device.zeroed
    bench.device.reopen()
    with pytest.raises(BeamLost, match="no zero"):
        bench.device.read()
    with pytest.raises(BeamLost, match="no zero"):
        Streaming(bench.device).kickoff()
    bench.device.zero()
    assert bench.device.read().flags == Flag.GOOD


def test_read_of_a_lost_beam_raises_and_refuses_further_readings(bench: Bench) -> None:
    bench.faults.beam_loss_at = 0
    with pytest.raises(BeamLost, match="beam lost") as caught:
        bench.device.read()
    assert caught.value.partial.flags & Flag.MISCOUNT
    assert abs(caught.value.partial.value) == pytest.approx(316.4e-9, abs=0.2e-9)
    assert bench.device.health().beam_broken
    with pytest.raises(BeamLost, match="no zero"):
        bench.device.read()
    bench.device.zero()
    assert not bench.device.health().beam_broken
    assert bench.device.read().value == 0.0


def test_close_ends_even_if_the_device_is_silent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS_TIMEOUT", "0.05")
    with make_bench() as bench:
        bench.faults.silent = True
        with pytest.raises(LinkLost):
            bench.device.read()
        bench.device.close()
        bench.device.close()
        with pytest.raises(LinkLost, match="reopen"):
            bench.device.zero()
