"""TCP, serial lines and a gateway of PIPython: the same promises."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import select
import socket
import time
import tty
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Transport
from hardware.devices.controllers import GatewayTransport
from hardware.devices.transport import (
    Link,
    SerialSettings,
    SerialTransport,
    TcpTransport,
)
from hardware.errors import DriverMissing, LinkLost, ProtocolFault, TimedOut
from tests.hardware.waits import waits

SHORT = 0.03


@dataclass
class Ends:
    """A transport of ours and the other side of it."""

    link: Any
    send: Any
    receive: Any
    cut: Any
    near: int = -1


@contextlib.contextmanager
def over_tcp(most: int, gateway: bool = False) -> Iterator[Ends]:
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    link: Link = TcpTransport("127.0.0.1", port, write_timeout=SHORT, most=most)
    if gateway:
        link = GatewayTransport.by_pisocket("127.0.0.1", port, write_timeout=SHORT)
    link.open()
    far, _ = listener.accept()
    try:
        yield Ends(link, far.sendall, lambda: far.recv(1 << 16), far.close)
    finally:
        link.close()
        far.close()
        listener.close()


@contextlib.contextmanager
def over_pty(most: int) -> Iterator[Ends]:
    near, far = os.openpty()
    tty.setraw(far)
    settings = SerialSettings(write_timeout=SHORT, most=most)
    link = SerialTransport(os.ttyname(far), settings)
    link.open()
    opened = [near, far]

    def cut() -> None:
        while opened:
            os.close(opened.pop())

    def receive() -> bytes:
        return os.read(near, 1 << 16)

    try:
        yield Ends(link, lambda data: os.write(near, data), receive, cut, near)
    finally:
        link.close()
        cut()


def over(kind: str, most: int = 1 << 20) -> contextlib.AbstractContextManager[Ends]:
    if kind == "pisocket" and importlib.util.find_spec("pipython") is None:
        pytest.skip("PIPython is not installed (pip install 'bondsight[bench]')")
    return over_pty(most) if kind == "serial" else over_tcp(most, kind == "pisocket")


KINDS = ("tcp", "serial")


@pytest.fixture(params=[*KINDS, "pisocket"])
def ends(request: pytest.FixtureRequest) -> Iterator[Ends]:
    with over(request.param) as e:
        yield e


def test_there_and_back(ends: Ends) -> None:
    assert isinstance(ends.link, Transport)
    ends.link.write(b"POS? 1\n")
    assert ends.receive() == b"POS? 1\n"
    ends.send(b"1=2.5\n0\n")
    assert ends.link.read_until(b"\n", SHORT) == b"1=2.5\n"
    assert ends.link.read_until((b"\r", b"\n"), SHORT) == b"0\n"


def test_first_of_several_ends(ends: Ends) -> None:
    ends.send(b"a\r\nb>c\n")
    got = [ends.link.read_until((b"\r\n", b">", b"\n"), SHORT) for _ in range(3)]
    assert got == [b"a\r\n", b"b>", b"c\n"]


def test_end_that_comes_in_two_pieces(ends: Ends) -> None:
    ends.send(b"a\r")
    with pytest.raises(TimedOut):
        ends.link.read_until(b"\r\n", SHORT)
    ends.send(b"\nrest")
    assert ends.link.read_until(b"\r\n", SHORT) == b"a\r\n"


def test_time_out_keeps_what_came(ends: Ends) -> None:
    ends.send(b"half an ans")
    with waits() as waited, pytest.raises(TimedOut) as late:
        ends.link.read_until(b"\n", SHORT)
    assert 0.0 < waited.seconds <= 2.0 * SHORT
    assert late.value.partial == b"half an ans"
    ends.send(b"wer\n")
    assert ends.link.read_until(b"\n", SHORT) == b"half an answer\n"


def test_drain_forgets_and_does_not_wait(ends: Ends) -> None:
    ends.send(b"one\ntwo\nthr")
    assert ends.link.read_until(b"\n", SHORT) == b"one\n"
    time.sleep(0.005)
    with waits() as waited:
        assert ends.link.drain() == b"two\nthr"
        assert ends.link.drain() == b""
    assert waited.seconds == 0.0
    with pytest.raises(TimedOut) as late:
        ends.link.read_until(b"\n", 0.0)
    assert late.value.partial == b""


@pytest.mark.parametrize("kind", [*KINDS, "pisocket"])
def test_link_cut_in_the_middle(kind: str) -> None:
    with over(kind) as ends:
        ends.send(b"whole\npart")
        assert ends.link.read_until(b"\n", SHORT) == b"whole\n"
        ends.cut()
        with waits() as waited, pytest.raises(LinkLost) as lost:
            ends.link.read_until(b"\n", 5.0)
        assert waited.seconds == 0.0
        # a hung-up terminal throws away what nobody has read
        assert lost.value.partial in (b"part", b"")
        with pytest.raises(LinkLost):
            ends.link.write(b"x\n")
        assert ends.link.drain() == b""


def test_reason_is_kept_where_draining_lost_the_link(ends: Ends) -> None:
    ends.cut()
    assert ends.link.drain() == b""
    for _ in range(2):
        with pytest.raises(LinkLost, match=r"link lost \(.+\); call open\(\) again"):
            ends.link.write(b"x\n")


def test_close_any_number_of_times_and_on_a_dead_link(ends: Ends) -> None:
    ends.cut()
    with waits() as waited:
        ends.link.close()
        ends.link.close()
        with pytest.raises(LinkLost):
            ends.link.write(b"x")
        with pytest.raises(LinkLost):
            ends.link.read_until(b"\n", 1.0)
        assert ends.link.drain() == b""
    assert waited.seconds == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_babble_is_bounded(kind: str) -> None:
    with over(kind, most=1000) as ends:

        def listen() -> None:
            for _ in range(40):
                ends.send(b"x" * 100)
                with contextlib.suppress(TimedOut):
                    ends.link.read_until(b"\n", 0.002)

        with pytest.raises(ProtocolFault, match="without an expected terminator") as fault:
            listen()
        assert fault.value.partial == b"x" * 64
        assert len(ends.link.drain()) < 4000
        ends.send(b"fine\n")
        assert ends.link.read_until(b"\n", SHORT).endswith(b"fine\n")


@pytest.mark.parametrize("kind", KINDS)
def test_other_side_takes_nothing(kind: str) -> None:
    with over(kind) as ends, waits() as waited:
        with pytest.raises(TimedOut) as stuck:
            ends.link.write(b"x" * (64 << 20))
        assert 0 < stuck.value.partial < 64 << 20
        ends.link.close()
        assert waited.seconds <= SHORT


@pytest.mark.parametrize("size", [12, 30_000])
def test_nothing_goes_out_twice_on_a_serial_line_that_nobody_reads(size: int) -> None:
    with over("serial") as ends:
        wanted, surely, stuck = b"", 0, False
        while not stuck:
            line = b"".join(b"%05d\n" % (len(wanted) + k) for k in range(0, size, 6))
            wanted += line
            try:
                ends.link.write(line)
                surely += len(line)
            except TimedOut as error:
                surely += error.partial
                stuck = True
        got = b""
        # the terminal hands on what it holds as room comes
        while select.select([ends.near], [], [], SHORT if len(got) >= surely else 5.0)[0]:
            got += ends.receive()
    assert wanted.startswith(got)
    assert surely <= len(got) <= surely + 256


def test_nobody_there() -> None:
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    listener.close()
    with pytest.raises(LinkLost, match="cannot connect"):
        TcpTransport("127.0.0.1", port).open()
    with pytest.raises(LinkLost, match="cannot connect"):
        SerialTransport("/dev/no-such-line").open()


def test_no_serial_line() -> None:
    with pytest.raises(LinkLost, match="configure port"):
        SerialTransport("/dev/null").open()


def test_strange_speed() -> None:
    near, far = os.openpty()
    with pytest.raises(LinkLost, match="cannot connect"):
        SerialTransport(os.ttyname(far), SerialSettings(baud=1 << 40)).open()
    os.close(near)
    os.close(far)


def test_settings_are_checked() -> None:
    with pytest.raises(UnusableInput):
        SerialSettings(bits=9)  # type: ignore[arg-type]
    with pytest.raises(UnusableInput):
        SerialSettings(baud=0)


def test_without_pyserial(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(DriverMissing, match="pip install"):
        SerialTransport("COM3").open()


def test_reopened() -> None:
    listener = socket.create_server(("127.0.0.1", 0))
    link = TcpTransport("127.0.0.1", listener.getsockname()[1])
    with link:
        first, _ = listener.accept()
        first.sendall(b"old rest")
        first.close()
        with pytest.raises(LinkLost):
            link.read_until(b"\n", 1.0)
        link.open()
        second, _ = listener.accept()
        second.sendall(b"new\n")
        assert link.read_until(b"\n", 1.0) == b"new\n"
        second.close()
    with pytest.raises(LinkLost, match="not open"):  # an older loss is no reason any more
        link.write(b"x")
    listener.close()
