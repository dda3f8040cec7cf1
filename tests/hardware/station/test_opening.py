"""Stations of other kinds than a card, opened from their tables and used for a take."""

from __future__ import annotations

import argparse
import contextlib
import shutil
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondsight.cli.acquire import add_acquire_command
from bondsight.cli.bench_serve import station_writer
from hardware.contracts import Clock
from hardware.errors import LinkLost, ProtocolFault
from hardware.recorder import TakePlan, record
from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.siosifm import build
from hardware.station import open_station, opening, read_settings, settings_from
from hardware.station.outputs import Driven
from hardware.station.virtual import station_table
from hardware.storage import Provenance
from tests.hardware.envelope.device import Device, RawDevice, RawPlayer, TrueTime, unsafe

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="the stub library is C code")


@pytest.mark.parametrize("kind", ["gcs", "pipython"])
def test_a_gcs_controller_drives_a_take(kind: str, tmp_path: Path) -> None:
    if kind == "pipython":
        pytest.importorskip("pipython")
    config = config_from(
        {"plant": {"effect": "none", "seed": 5}, "fronts": ["interferometer", "gcs"]}
    )
    with BenchServer(config) as server:
        table = station_table(server.addresses, config, str(build(tmp_path / "stub")))
        table["output"]["kind"] = kind
        with open_station(settings_from(table)) as bench:
            volts = 30.0 + 20.0 * np.sin(np.linspace(0.0, 12.0, 500))
            plan = TakePlan(volts, 5e3, "gcs", "start")
            taken = record(bench.station(plan), plan, tmp_path / "take")
        assert server.rig.volts == 0.0
        assert server.extremes.highest <= 50.1
    x = taken.recording["x"]
    k = np.polyfit(taken.recording["V"], x, 1)
    # an actuator of some 50 nm/V, seen by the interferometer while the controller drives it
    assert 20e-9 < k[0] < 100e-9
    assert np.std(x - np.polyval(k, taken.recording["V"])) < 0.2 * np.std(x)
    assert Provenance.of(taken.recording).output_end == "parked"


def test_errors_of_the_virtual_clock_are_those_of_a_device(tmp_path: Path) -> None:
    server = BenchServer(config_from({"plant": {"effect": "none", "seed": 5}, "fronts": ["card"]}))
    table = station_table(server.start(), server.config, "")
    with open_station(settings_from(table)) as bench:
        assert isinstance(bench.clock, Clock)
        before = bench.clock.now()
        bench.clock.sleep(0.5)
        assert bench.clock.now() == pytest.approx(before + 0.5)
        with pytest.raises(ProtocolFault, match="WAIT takes 0 to 3600 s"):
            bench.clock.sleep(1e9)
        server.stop()
        for ask in (bench.clock.now, lambda: bench.clock.sleep(0.1)):
            with pytest.raises(LinkLost, match=r"virtual bench at .* is gone") as lost:
                ask()
            assert "\n" not in str(lost.value)
    table["clock"]["bench"] = "127.0.0.1:70000"
    with pytest.raises(LinkLost, match="1 to 65535"):
        open_station(settings_from(table))


@pytest.mark.parametrize(
    ("front", "way"), [("card", "clock"), ("gcs", "start")], ids=["card", "gcs"]
)
def test_the_acquire_line_that_bench_serve_prints_can_be_used(
    front: str, way: str, tmp_path: Path
) -> None:
    config = config_from(
        {"plant": {"effect": "none", "seed": 5}, "fronts": ["interferometer", front]}
    )
    parser = argparse.ArgumentParser()
    add_acquire_command(parser.add_subparsers())
    with BenchServer(config) as server:
        (line,) = station_writer(tmp_path / "station.toml", config)(server.addresses)
        options = parser.parse_args(line.split()[1:])
        assert options.synchronise == way
        with open_station(read_settings(options.station)) as bench:
            bench.station(TakePlan(np.array([1.0, 2.0, 1.0]), 1e3, "t", options.synchronise))


@pytest.mark.parametrize("by_signal", [True, False])
def test_ctrl_c_while_a_station_closes_parks_before_it_cuts_the_link(
    by_signal: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = TrueTime()
    device = Device(clock)
    cut: list[float] = []

    def opened_output(*arguments: Any) -> Driven:
        arguments[-1].callback(lambda: cut.append(device.volts))
        return Driven(raw, lambda way: RawPlayer(device))

    raw = RawDevice(device)
    write, left = raw.write, [20]

    def interrupted(volts: float) -> None:
        left[0] -= 1
        if left[0] == 0:
            if not by_signal:
                raise KeyboardInterrupt
            signal.raise_signal(signal.SIGINT)
        write(volts)

    monkeypatch.setattr(opening, "open_output", opened_output)
    monkeypatch.setattr(opening, "_clock", lambda *_: clock)
    settings = settings_from(
        {"envelope": {"preset": "P-840.1-unipolar"}, "output": {"kind": "mf634"}}
    )
    bench = open_station(settings)
    bench.output.power_up()
    bench.output.ramp(90.0)
    monkeypatch.setattr(raw, "write", interrupted)
    with pytest.raises(KeyboardInterrupt) if by_signal else contextlib.nullcontext():
        bench.close()
    assert left[0] < 0
    assert cut == [0.0]
    assert unsafe(device, 0.0, 100.0, 3.0) == []


def test_synchronisation_that_the_wiring_does_not_allow_is_refused(tmp_path: Path) -> None:
    config = config_from({"plant": {"effect": "none", "seed": 5}})
    with BenchServer(config) as server:
        table = station_table(server.addresses, config, str(build(tmp_path / "stub")))
        del table["output"]["clock"]
        with open_station(settings_from(table)) as bench:
            plan = TakePlan(np.array([1.0, 2.0, 1.0]), 1e3, "t", "clock")
            with pytest.raises(ValueError, match=r"needs \[output\] clock"):
                bench.station(plan)
        assert server.extremes.highest == 0.0
