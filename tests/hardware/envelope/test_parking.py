"""Leaving a block by any way parks its outputs and gives the signals back."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import hardware
from bondgraph.support.errors import UnusableInput
from hardware.envelope import OutputState, parked, parking
from hardware.errors import LinkLost
from tests.hardware.envelope.device import TrueTime
from tests.hardware.envelope.test_guard import Bench, bench
from tests.patience import HANGS

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture(autouse=True)
def signals_come_back() -> Any:
    """Act as in a terminal, whatever the runner ignores; the guard gives that back."""
    usual: list[Any] = [signal.default_int_handler, signal.SIG_DFL, signal.SIG_DFL]
    before = [signal.signal(s, act) for s, act in zip(SIGNALS, usual, strict=True)]
    yield
    after = [signal.getsignal(s) for s in SIGNALS]
    for number, act in zip(SIGNALS, before, strict=True):
        signal.signal(number, act)
    assert after == usual


def driven() -> Bench:
    b = bench()
    b.output.ramp(80.0)
    return b


def pressing(b: Bench, *numbers: signal.Signals, at: float = 40.0) -> None:
    """Send signals while the way down passes a voltage (V)."""
    left = list(numbers)
    sleep = TrueTime.sleep

    def press(seconds: float) -> None:
        sleep(b.clock, seconds)
        if b.device.volts < at and left:
            signal.raise_signal(left.pop(0))

    b.clock.sleep = press  # type: ignore[method-assign]


def test_the_end_of_the_block() -> None:
    b = driven()
    guard = parked(b.output)
    for _ in range(2):
        with guard:
            b.output.ramp(20.0)
        assert b.output.state is OutputState.PARKED


@pytest.mark.parametrize(
    ("number", "kind"),
    [
        (signal.SIGINT, KeyboardInterrupt),
        (signal.SIGTERM, SystemExit),
        (signal.SIGHUP, SystemExit),
    ],
)
def test_a_signal_in_the_block(number: signal.Signals, kind: type[BaseException]) -> None:
    b = driven()
    with pytest.raises(kind) as caught, parked(b.output):
        signal.raise_signal(number)
    assert b.device.volts == 0.0
    if kind is SystemExit:
        assert caught.value.code == 128 + number  # type: ignore[attr-defined]


@pytest.mark.parametrize("number", SIGNALS)
def test_an_ignored_signal_stays_ignored(number: signal.Signals) -> None:
    """Whoever started the program wanted it so (nohup, a shell's background)."""
    signal.signal(number, signal.SIG_IGN)
    try:
        b = driven()
        with parked(b.output):
            assert signal.getsignal(number) is signal.SIG_IGN
            signal.raise_signal(number)
            assert b.device.volts == 80.0
        assert signal.getsignal(number) is signal.SIG_IGN
        assert b.device.volts == 0.0
    finally:
        usual = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        signal.signal(number, usual)


def test_more_signals_on_the_way_down_do_not_cut_it() -> None:
    b = driven()
    pressing(b, signal.SIGINT, signal.SIGINT, signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), parked(b.output):
        raise KeyboardInterrupt
    assert b.device.volts == 0.0


@pytest.mark.parametrize("error", [None, ValueError])
def test_a_signal_on_the_way_down_acts_afterwards(error: type[Exception] | None) -> None:
    b = driven()
    pressing(b, signal.SIGTERM)

    def block() -> None:
        with parked(b.output):
            if error is not None:
                raise error

    with pytest.raises(SystemExit) as caught:
        block()
    assert b.device.volts == 0.0
    assert error is None or isinstance(caught.value.__context__, error)


def test_a_bouncing_key_is_one_signal(monkeypatch: pytest.MonkeyPatch) -> None:
    b = driven()
    now = [100.0]
    monkeypatch.setattr(parking, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with parked(b.output):
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        now[0] += 0.9 * parking.BOUNCE
        signal.raise_signal(signal.SIGINT)
        now[0] += 1.1 * parking.BOUNCE
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert b.device.volts == 0.0


def test_the_first_error_survives_a_lost_link() -> None:
    b = driven()
    b.device.reachable = False
    with pytest.raises(ValueError, match="mine") as caught, parked(b.output):
        raise ValueError("mine")
    assert "could not be parked" in caught.value.__notes__[0]
    assert "output unknown" in caught.value.__notes__[0]
    b = driven()
    with pytest.raises(LinkLost) as lost, parked(b.output):
        b.device.reachable = False
    assert any("could not be parked" in n for n in lost.value.__notes__)


def test_several_outputs_are_parked_each() -> None:
    a, b = driven(), driven()
    with pytest.raises(LinkLost), parked(a.output, b.output):
        a.device.reachable = False
    assert b.device.volts == 0.0


def test_nested_blocks_and_handlers_of_others() -> None:
    seen: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: seen.append(number))
    try:
        a, b = driven(), driven()
        with parked(a.output), parked(b.output):
            signal.raise_signal(signal.SIGTERM)
            assert a.device.volts == 80.0
        assert seen == [signal.SIGTERM]
        a = driven()
        with pytest.raises(KeyboardInterrupt), parked(a.output), parked(b.output):
            signal.raise_signal(signal.SIGINT)
        assert a.device.volts == b.device.volts == 0.0
    finally:
        signal.signal(signal.SIGTERM, before)


def test_one_guard_is_entered_once_at_a_time() -> None:
    b = driven()
    guard = parked(b.output)
    with guard:
        with pytest.raises(UnusableInput, match="make another one"):
            guard.__enter__()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert b.device.volts == 0.0


def test_in_another_thread_leaving_parks_as_well() -> None:
    b = driven()

    def work() -> None:
        with parked(b.output):
            pass

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert b.device.volts == 0.0


PROGRAM = """
import os, signal, sys, time
from hardware.envelope import parked
class Output:
    def stop(self):
        for k in range(5):
            time.sleep(0.01)
        print("parked", flush=True)
guard = parked(Output())
{body}
"""


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("guard.__enter__(); print('ready', flush=True)", 0),
        ("with guard: print('ready', flush=True); time.sleep(600)", 128 + signal.SIGTERM),
    ],
)
def test_the_exit_of_the_interpreter(body: str, code: int) -> None:
    program = textwrap.dedent(PROGRAM).format(body=body)
    root = str(Path(hardware.__file__).parents[1])
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": root},
    )
    with process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            if code:
                process.send_signal(signal.SIGTERM)
            out, _ = process.communicate(timeout=HANGS)
        finally:
            process.kill()
    assert "parked" in out
    assert process.returncode == code
