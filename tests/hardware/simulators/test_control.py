"""The control protocol: time, faults, refusals, and what happens when the last program dies."""

from __future__ import annotations

import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.contracts import Clock
from hardware.simulators.control import (
    BenchClock,
    ConnectionWatchdog,
    ControlFront,
    LocalClock,
    ask,
    client,
)
from hardware.simulators.plants import plain_stack
from hardware.simulators.rig import Rig
from tests.patience import HANGS


def soon(condition: Callable[[], bool]) -> None:
    """Wait for another thread, at most a second."""
    for _ in range(500):
        if condition():
            return
        time.sleep(2e-3)
    raise AssertionError("it did not happen")


@pytest.fixture
def rig() -> Rig:
    """Give a linear stack."""
    return Rig(plain_stack())


@pytest.fixture
def front(rig: Rig) -> Any:
    """Give a front with one fault that notes what it got."""
    noted: list[Mapping[str, float | str]] = []

    def inject(values: Mapping[str, float | str]) -> None:
        if "wrong" in values:
            raise ValueError("no such\nthing")
        noted.append(values)

    made = ControlFront(rig, {"beam": inject}, sealed="abc")
    made.noted = noted  # type: ignore[attr-defined]
    yield made
    made.stop()


def test_waiting_makes_time_pass_at_the_programs_rate(rig: Rig, front: Any) -> None:
    """A program whose clock is 100 ppm slow lets more true time pass, and does not notice."""
    clock = BenchClock(front.start(), ppm=100.0)
    assert isinstance(clock, Clock)
    for _ in range(10):
        clock.sleep(0.5)
    clock.sleep(0.0)
    clock.sleep(-1.0)
    assert rig.now == pytest.approx(5.0 * 1.0001, abs=1e-12)
    assert clock.now() == pytest.approx(5.0, abs=1e-12)
    instant = clock.edge()
    assert rig.trigger_edges == (instant,) == (rig.now,)
    local = LocalClock(rig, ppm=100.0)
    assert isinstance(local, Clock)
    local.sleep(1.0)
    assert local.now() == pytest.approx(6.0, abs=1e-12)
    clock.close()


def test_jitter_makes_waits_longer_only_and_is_the_same_again(rig: Rig, front: Any) -> None:
    """Seeded, one-sided."""
    address = front.start()
    lengths = []
    for _ in range(2):
        clock, begin, found = BenchClock(address, jitter=1e-4, seed=3), rig.now, []
        for _ in range(50):
            clock.sleep(1e-3)
            found.append(rig.now - begin)
        lengths.append(found)
        clock.close()
    assert lengths[0] == pytest.approx(lengths[1], abs=1e-12)
    waits = [b - a for a, b in zip([0.0, *lengths[0]], lengths[0], strict=False)]
    assert min(waits) >= 1e-3 - 1e-12
    assert sum(waits) / 50 - 1e-3 == pytest.approx(1e-4 * 0.8, rel=0.3)


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("NOW", "OK 0.0"),
        ("now", "OK 0.0"),
        ("WAIT 0.25", "OK 0.25"),
        ("VOLTS", "OK 0.0"),
        ("EXTREMES", "OK 0.0 0.0 0.0"),
        ("RATE", "OK 0.0"),
        ("BYE", "OK bye"),
        ("FAULT", "OK beam"),
        ("FAULT beam at=100 kind=soft", "OK beam at 0.0"),
        ("NOW 3", "ERR NOW takes no argument"),
        ("WAIT", "ERR WAIT takes one number of seconds"),
        ("WAIT 1 2", "ERR WAIT takes one number of seconds"),
        ("WAIT nan", "ERR WAIT takes 0 to 3600 s, not nan"),
        ("WAIT inf", "ERR WAIT takes 0 to 3600 s, not inf"),
        ("WAIT -1", "ERR WAIT takes 0 to 3600 s, not -1"),
        ("FAULT nothing", "ERR unknown fault 'nothing'; known: beam"),
        ("FAULT beam at", "ERR fault beam: 'at' is no key=value"),
        ("FAULT beam wrong=1", "ERR no such thing"),
        (
            "TRUTH?",
            "ERR sealed abc; the truth is told when the bench ends, not before",
        ),
    ],
)
def test_every_line_gets_one_line(front: Any, line: str, answer: str) -> None:
    """Known lines."""
    assert front.answer(line) == answer
    if line.startswith("FAULT beam at="):
        assert front.noted == [{"at": 100.0, "kind": "soft"}]


@settings(max_examples=200)
@given(st.text(max_size=80))
def test_no_line_breaks_it(line: str) -> None:
    """Whatever comes, one line goes back."""
    answer = ControlFront(Rig(plain_stack())).answer(line)
    assert answer.startswith(("OK ", "ERR "))
    assert "\n" not in answer


def test_input_is_bounded(front: Any) -> None:
    """A line without end is not collected; the next client is served."""
    host, _, port = front.start().rpartition(":")
    with socket.create_connection((host, int(port)), timeout=HANGS) as client:
        client.sendall(b"NOW\nNO")
        assert client.recv(100) == b"OK 0.0\n"
        client.sendall(b"W\n" + b"x" * 5000)
        got = b""
        while piece := _received(client):
            got += piece
        assert got.startswith(b"OK 0.0\nERR line of more than 1024 bytes")
    assert ask(f"{host}:{port}", "NOW") == "0.0"


def _received(client: socket.socket) -> bytes:
    try:
        return client.recv(1000)
    except ConnectionResetError:
        return b""


def test_a_bench_that_is_gone_is_told_in_one_line(front: Any) -> None:
    """No hang, no traceback of sockets."""
    address = front.start()
    clock = BenchClock(address)
    with pytest.raises(ValueError, match="unknown command"):
        clock.ask("DANCE")
    front.stop()
    front.stop()
    with pytest.raises(ConnectionError, match="is gone"):
        clock.sleep(1.0)
    with pytest.raises(ConnectionError, match="no virtual bench at"):
        BenchClock(address)
    with pytest.raises(ConnectionError, match="no virtual bench at nowhere"):
        BenchClock("nowhere")


@pytest.fixture
def stranger() -> Iterator[Callable[[bytes], str]]:
    """Give what starts a server that is no bench; empty words stand for silence."""
    listeners, links = [], []

    def start(words: bytes) -> str:
        listener = socket.create_server(("127.0.0.1", 0))
        listeners.append(listener)

        def serve() -> None:
            link, _ = listener.accept()
            links.append(link)
            if words:
                link.recv(100)
                link.sendall(words)

        threading.Thread(target=serve, daemon=True).start()
        host, port = listener.getsockname()[:2]
        return f"{host}:{port}"

    yield start
    for link in (*links, *listeners):
        link.close()


def test_something_else_behind_the_port_is_told_soon_and_by_its_words(
    stranger: Callable[[bytes], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A silent server costs 2 s at most; what answers is shown; one line each."""
    assert client._FIRST <= 2.0
    for words, told in (
        (b"", "something listens there but does not answer NOW within 0.05 s"),
        (b"HTTP/1.0 400 Bad request\r\n\r\n", "answers 'HTTP/1.0 400 Bad request' to NOW"),
        (b"\xff\xfe\n", "to NOW; give the address of control"),
        (b"OK soon\n", "answers 'OK soon' to NOW"),
        (b"x" * 70_000, "answers without end"),
    ):
        # the others answer when they can
        monkeypatch.setattr(client, "_FIRST", 60.0 if words else 0.05)
        with pytest.raises(ConnectionError, match=r"^no virtual bench at") as refused:
            BenchClock(stranger(words))
        assert told in str(refused.value)
        assert "\n" not in str(refused.value)
    for port in ("0", "65536", "-1", "99999999999999999999"):
        with pytest.raises(ConnectionError, match="a port is a number from 1 to 65535"):
            BenchClock(f"127.0.0.1:{port}")


def test_an_interrupted_question_does_not_shift_the_answers(rig: Rig, front: Any) -> None:
    """Ctrl-C while a wait is under way: the way down afterwards gets its own answers."""
    clock = BenchClock(front.start())
    rig.at(1.0, lambda: time.sleep(0.1))

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.03)
        with pytest.raises(KeyboardInterrupt):
            clock.sleep(2.0)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert clock.ask("VOLTS") == "0.0"
    assert clock.now() == 2.0
    clock.sleep(1.0)
    assert rig.now == 3.0
    clock.close()


def test_a_watchdog_brings_the_output_back_slowly(rig: Rig) -> None:
    """Only after the last program, after its patience, without a jump."""
    front = ControlFront(rig, watchdog=ConnectionWatchdog(timeout=0.2, fall=0.05, steps=50))
    address = front.start()
    first, second = BenchClock(address), BenchClock(address)
    second.edge()
    for k in range(81):
        rig.drive(float(k))
        first.sleep(1e-3)
    first.close()
    second.sleep(1.0)
    assert ask(address, "VOLTS") == "80.0"
    assert rig.volts == 80.0
    begin = rig.now
    second.close()
    soon(lambda: len(front.departures) == 1 and rig.volts == 0.0)
    assert rig.now == pytest.approx(begin + 0.25)
    assert rig.extremes.largest_step == pytest.approx(80.0 / 50)
    assert "the watchdog brought it to 0 V" in str(front.departures[0])
    assert front.departures[0].volts == 80.0
    front.stop()


def test_without_a_watchdog_it_stays_and_is_told(rig: Rig) -> None:
    """The voltage on the stack outlives the program."""
    front = ControlFront(rig)
    front_address = front.start()
    clock = BenchClock(front_address)
    clock.sleep(0.1)
    rig.drive(63.0)
    clock.close()
    soon(lambda: bool(front.departures))
    assert rig.volts == 63.0
    assert not front.departures[0].returned
    assert ask(front_address, "NOW")
    assert len(front.departures) == 1
    assert "63 V on the stack; no watchdog: the voltage stays" in str(front.departures[0])
    front.stop()


@pytest.mark.parametrize("begin", [1.7, 2.0478125, 3.1, 12.34567])
def test_a_watchdog_reaches_zero_whenever_it_begins(rig: Rig, begin: float) -> None:
    """Sums of floating point numbers in another order are another instant."""
    rig.wait_until(begin)
    rig.drive(40.0)
    for timeout, fall in ((0.2, 0.05), (0.1, 0.07), (0.3, 1.0 / 3.0)):
        rig.drive(40.0)
        ConnectionWatchdog(timeout, fall).expire(rig, lambda: True)
        assert rig.volts == 0.0


def test_a_program_that_comes_back_in_time_is_left_alone(rig: Rig) -> None:
    """On a paced bench the watchdog looks again when its patience ends."""
    front = ControlFront(rig, watchdog=ConnectionWatchdog(timeout=0.2))
    address = front.start()
    now = [0.0]
    rig.pace(lambda: now[0])
    first = BenchClock(address)
    first.edge()
    rig.drive(40.0)
    first.close()
    soon(lambda: len(front.departures) == 1)
    second = BenchClock(address)
    second.edge()
    now[0] = 1.0
    assert rig.volts == 40.0
    second.close()
    soon(lambda: len(front.departures) == 2)
    now[0] = 2.0
    assert rig.volts == 0.0
    front.stop()


@pytest.mark.parametrize("wrong", [{"timeout": -1.0}, {"fall": float("nan")}, {"steps": 0}])
def test_a_watchdog_without_sense_is_refused(wrong: Any) -> None:
    """One line with the name."""
    with pytest.raises(ValueError, match=f"Watchdog: {next(iter(wrong))}"):
        ConnectionWatchdog(**wrong)
