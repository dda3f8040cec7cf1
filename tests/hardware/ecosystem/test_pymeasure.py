"""PyMeasure: exact bytes through its own test of protocols, nothing unsafe among them."""

from __future__ import annotations

import contextlib
import math
import socket
from collections.abc import Sequence
from typing import Any

import pytest

from hardware.contracts import Identity, Transport
from hardware.devices.controllers import GcsController, GcsTalk
from hardware.envelope import P840_1_UNIPOLAR
from hardware.errors import LimitViolation, LinkLost, TimedOut
from hardware.simulators.controllers import GcsFront
from tests.hardware.ecosystem.bench import GAIN, Bench
from tests.patience import HANGS

pytestmark = pytest.mark.filterwarnings("default")

expected_protocol = pytest.importorskip("pymeasure.test").expected_protocol

from pymeasure.adapters import Adapter  # noqa: E402

from hardware.ecosystem.with_pymeasure import (  # noqa: E402
    AdapterTransport,
    PyMeasureDisplacement,
    PyMeasureVoltage,
)

Pairs = Sequence[tuple[bytes, bytes | None]]

POWER_UP: Pairs = [(b"ID?\n", b"line output 5\n"), (b"SET 0.000\n", b"OK\n")]


class StillClock:
    """Waits take no time but count."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += max(seconds, 0.0)


class LineOutput:
    """A raw output with a protocol of two lines."""

    identity = Identity("none", "line output")
    has_watchdog = False

    def __init__(self, link: Transport) -> None:
        self._link = link

    def power_up(self) -> None:
        assert self._ask("ID?").startswith("line output")
        self.write(0.0)

    def write(self, volts: float) -> None:
        assert self._ask(f"SET {volts:.3f}") == "OK"

    def read(self) -> float | None:
        return float(self._ask("GET?"))

    def close(self) -> None:
        self._link.close()

    def _ask(self, line: str) -> str:
        self._link.write(line.encode("ascii") + b"\n")
        return self._link.read_until(b"\n", 1.0).decode("ascii").strip()


UP = tuple((f"SET {v:.3f}\n".encode(), b"OK\n") for v in (0.5, 1.0, 1.5, 2.0))
DOWN = tuple((f"SET {v:.3f}\n".encode(), b"OK\n") for v in (1.5, 1.0, 0.5, 0.0))
PROOF: Pairs = [(b"GET?\n", b"0.0\n"), *UP, (b"GET?\n", b"2.0\n"), *DOWN, (b"GET?\n", b"0.0\n")]
"""The step that proves the read-back at power-up."""


def _opened(pairs: Pairs) -> Any:
    return expected_protocol(
        PyMeasureVoltage,
        [*POWER_UP, (b"GET?\n", b"0.0\n"), *PROOF, *pairs],
        driver=LineOutput,
        envelope=P840_1_UNIPOLAR,
        clock=StillClock(),
    )


def test_a_step_is_one_command() -> None:
    with _opened([(b"SET 10.000\n", b"OK\n")]) as instrument:
        assert math.isnan(instrument.voltage)
        instrument.power_up()
        assert instrument.voltage == 0.0
        instrument.step_to(10.0)
        assert instrument.voltage == 10.0


def test_nothing_unsafe_is_written() -> None:
    # the protocol fails on any byte that is not expected
    with _opened([]) as instrument:
        with pytest.raises(LimitViolation, match="power_up"):
            instrument.voltage = 1.0
        instrument.power_up()
        for bad in (150.0, -1.0, float("nan")):
            with pytest.raises(LimitViolation):
                instrument.voltage = bad
        with pytest.raises(LimitViolation, match="exceeds"):
            instrument.step_to(50.0)


def test_setting_the_voltage_ramps_and_shutdown_parks() -> None:
    pairs: Pairs = [
        (b"SET 0.500\n", b"OK\n"),
        (b"SET 1.000\n", b"OK\n"),
        (b"GET?\n", b"0.99\n"),
        (b"SET 0.500\n", b"OK\n"),
        (b"SET 0.000\n", b"OK\n"),
    ]
    with _opened(pairs) as instrument:
        instrument.power_up()
        instrument.voltage = 1.0
        assert instrument.measured_voltage == 0.99
        instrument.shutdown()
        assert instrument.isShutdown


class SocketAdapter(Adapter):  # type: ignore[misc]
    """An adapter of a user: bytes over TCP."""

    def __init__(self, address: str) -> None:
        super().__init__()
        host, _, port = address.rpartition(":")
        self.connection: Any = socket.create_connection((host, int(port)), timeout=HANGS)
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _write_bytes(self, content: bytes, **_: Any) -> None:
        self.connection.sendall(content)

    def _read_bytes(self, count: int, break_on_termchar: bool = False, **_: Any) -> bytes:
        return bytes(self.connection.recv(count))

    def flush_read_buffer(self) -> None:
        self.connection.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            self.connection.recv(65536)
        self.connection.settimeout(HANGS)


def test_our_driver_over_an_adapter_moves_the_simulated_device() -> None:
    bench = Bench()
    front = GcsFront(bench.rig)
    instrument = PyMeasureVoltage(
        SocketAdapter(front.start()),
        lambda link: GcsController(GcsTalk(link), clock=bench.clock),
        P840_1_UNIPOLAR,
        bench.clock,
    )
    try:
        instrument.power_up()
        instrument.voltage = 5.0
        assert bench.rig.volts == pytest.approx(5.0, abs=0.01)
        assert instrument.measured_voltage == pytest.approx(5.0, abs=0.01)
        with pytest.raises(LimitViolation):
            instrument.voltage = 101.0
        instrument.shutdown()
        assert bench.rig.volts == pytest.approx(0.0, abs=0.01)
        assert bench.rig.extremes.highest < 5.1
    finally:
        front.stop()


def test_faults_of_adapters_become_ours() -> None:
    class VisaError(Exception):
        abbreviation = "VI_ERROR_TMO"

    class Broken:
        def __init__(self, fault: Exception | None) -> None:
            self.fault = fault

        def read_bytes(self, count: int) -> bytes:
            if self.fault is None:
                return b""
            raise self.fault

        def close(self) -> None:
            raise OSError("gone")

    for fault, kind in (
        (None, TimedOut),
        (TimeoutError("slow"), TimedOut),
        (VisaError("slow"), TimedOut),
        (OSError("gone"), LinkLost),
        (ZeroDivisionError("a bug"), ZeroDivisionError),
    ):
        link = AdapterTransport(Broken(fault))
        with pytest.raises(kind):
            link.read_until(b"\n", 1.0)
        link.close()
    assert isinstance(link, Transport)


def test_displacement() -> None:
    bench = Bench()
    instrument = PyMeasureDisplacement(bench.sensor)
    bench.rig.drive(10.0)
    bench.rig.wait(0.01)
    assert instrument.displacement == pytest.approx(10.0 * GAIN)
    assert instrument.flags == 0
    instrument.zero()
    assert instrument.displacement == 0.0
