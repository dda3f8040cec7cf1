"""Whoever wants something else while it goes down, or while a waveform plays."""

from __future__ import annotations

import copy
import pickle
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import count, pairwise
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import hardware.envelope
from hardware.contracts import WaveProgress
from hardware.envelope import Envelope, GuardedOutput, GuardedWave, OutputState
from hardware.errors import HardwareError, LimitViolation, LinkLost
from tests.hardware.envelope.device import (
    Device,
    RawDevice,
    RawPlayer,
    TellingPlayer,
    TrueTime,
    unsafe,
)
from tests.hardware.envelope.test_guard import LIMITS, Bench, bench
from tests.patience import HANGS

GUARD = str(Path(hardware.envelope.__file__).parent)
RISE = np.linspace(0.0, 100.0, 200)


class Yielding(TrueTime):
    """Lets the other threads run at every wait."""

    def sleep(self, seconds: float) -> None:
        super().sleep(seconds)
        time.sleep(5e-5)


def threaded(envelope: Envelope = LIMITS) -> tuple[Device, RawDevice, GuardedOutput]:
    clock = Yielding()
    device = Device(clock)
    raw = RawDevice(device)
    output = GuardedOutput(raw, envelope, clock)
    output.power_up()
    return device, raw, output


class Hammer:
    """A thread that commands over and over."""

    def __init__(self, command: Callable[[], object]) -> None:
        self.command = command
        self.ends = False
        self.refused: list[str] = []
        self.thread = threading.Thread(target=self.run)

    def run(self) -> None:
        while not self.ends:
            try:
                self.command()
            except HardwareError as error:
                self.refused.append(str(error))

    def __enter__(self) -> Hammer:
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.ends = True
        self.thread.join(HANGS)
        assert not self.thread.is_alive()


WIDE = Envelope(0.0, 100.0, 1e5, gentle=1e3, update_period=1e-3)


def test_no_other_thread_overrules_a_stop() -> None:
    device, _, output = threaded(WIDE)
    output.ramp(60.0)
    commands = 0
    parked_at: list[float] = []

    def command() -> None:
        nonlocal commands
        output.set(60.0)
        commands += 1

    stop = output.stop

    def watch() -> None:
        stop()
        parked_at.append(device.volts)

    with Hammer(command) as hammer:
        while commands < 3:
            time.sleep(1e-3)
        begin = len(device.steps)
        watch()
        hammer.ends = True
    down = [s[2] for s in device.steps[begin:]]
    end = down.index(0.0)
    # nothing came in between on the way down
    assert all(b <= a for a, b in pairwise(down[: end + 1]))
    assert hammer.refused
    assert "stop() is on its way to 0 V" in hammer.refused[0]
    assert len(parked_at) == 1


def test_close_shuts_commands_out_before_it_goes_down() -> None:
    device, raw, output = threaded(WIDE)
    output.ramp(60.0)
    with Hammer(lambda: output.set(60.0)) as hammer:
        time.sleep(5e-3)
        output.close()
        assert device.volts == 0.0
        assert raw.closed == 1
        steps = len(device.steps)
        time.sleep(5e-3)
    assert len(device.steps) == steps
    assert "closed" in hammer.refused[0]


def test_two_threads_may_stop_at_once() -> None:
    device, _, output = threaded()
    output.ramp(80.0)
    found: list[float] = []

    def stop() -> None:
        output.stop()
        found.append(device.volts)

    threads = [threading.Thread(target=stop) for _ in range(3)]
    for t in threads:
        t.start()
    for t in threads:
        t.join(HANGS)
    assert found == [0.0] * 3
    assert unsafe(device, -20.0, 100.0, 10.0) == []


def test_a_stop_within_a_stop() -> None:
    b = bench()
    b.output.ramp(80.0)
    sleep, inner = b.clock.sleep, [True]

    def again(seconds: float) -> None:
        sleep(seconds)
        if inner and b.device.volts < 40.0:
            inner.pop()
            b.output.stop()
            with pytest.raises(LimitViolation, match=r"stop\(\) is on its way"):
                b.output.set(1.0)

    b.clock.sleep = again  # type: ignore[method-assign]
    b.output.stop()
    assert b.device.volts == 0.0
    assert not inner
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    b.output.set(1.0)


def within(
    b: Bench, command: Callable[[], object], reached: Callable[[float], bool], why: str = ""
) -> None:
    """Give a command just before the device moves to a voltage, as a signal handler may."""
    move, left = b.device.move, [True]

    def moved(volts: float, cause: str) -> None:
        if left and reached(volts) and why in ("", cause):
            left.pop()
            command()
        move(volts, cause)

    b.device.move = moved  # type: ignore[method-assign]


@pytest.mark.parametrize("way", ["up", "down", "set", "wave"])
@pytest.mark.parametrize("ends", ["stop", "close"])
def test_a_stop_within_a_write_is_not_undone_by_it(way: str, ends: str) -> None:
    b = bench()
    wave = GuardedWave(b.output, TellingPlayer(b.device))
    if way == "down":
        b.output.ramp(80.0)
    elif way == "set":
        b.output.ramp(55.0)
    commands: dict[str, Callable[[], object]] = {
        "up": lambda: b.output.ramp(80.0),
        "down": b.output.stop,
        "set": lambda: b.output.set(61.0),
        "wave": lambda: list(wave.play()),
    }
    wave.prepare(RISE, 1e3)
    within(b, getattr(b.output, ends), lambda v: v < 40.0 if way == "down" else v > 60.0)
    # a way down ends as usual, everything else is told that it was overruled
    with suppress(HardwareError):
        commands[way]()
        assert way == "down"
    assert b.device.volts == 0.0
    assert b.raw.closed == (ends == "close")
    if ends == "stop":
        assert b.output.state is OutputState.PARKED
        assert b.output.present == 0.0
        b.output.set(1.0)
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


@pytest.mark.parametrize("talk", ["read", "feed", "load", "unknown"])
def test_a_stop_within_a_talk_with_the_device_comes_behind_it(talk: str) -> None:
    """Else its commands and answers would mix with those of the talk under way."""
    b = bench(watchdog=0.3 if talk == "feed" else 0.0)
    player = TellingPlayer(b.device)
    wave = GuardedWave(b.output, player)
    b.output.ramp(50.0)
    if talk == "unknown":
        b.device.budget = 3
        with pytest.raises(LinkLost):
            b.output.set(55.0)
    elif talk == "feed":
        b.clock.sleep(0.2)
    commands: dict[str, tuple[Any, str, Callable[[], object]]] = {
        "read": (b.raw, "read", b.output.read),
        "feed": (b.raw, "feed_watchdog", b.output.tend),
        "load": (player, "load", lambda: wave.prepare(RISE, 1e3)),
        "unknown": (b.raw, "read", b.output.stop),
    }
    place, name, command = commands[talk]
    usual, left, during = getattr(place, name), [True], list[int]()

    def struck(*arguments: Any) -> Any:
        if left:
            left.pop()
            begin = len(b.device.steps)
            b.output.stop()
            during.append(len(b.device.steps) - begin)
        return usual(*arguments)

    setattr(place, name, struck)
    command()
    assert during == [0]
    assert b.output.present == b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


@pytest.mark.parametrize("command", ["ramp", "set", "approach"])
def test_a_command_that_a_stop_overrules_in_its_last_step_says_so(command: str) -> None:
    b = bench()
    b.output.ramp(50.0)
    within(b, b.output.stop, lambda v: v == 55.0)
    with pytest.raises(HardwareError, match="another command"):
        getattr(b.output, command)(55.0)
    assert b.output.present == b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED


def lines_of(command: Callable[[], object], act: Callable[[], object], at: int) -> bool:
    """Act before the n-th line that the guard runs within a command; False if it has fewer."""
    seen = 0

    def look(frame: FrameType, event: str, _: object) -> Any:
        nonlocal seen
        if GUARD not in frame.f_code.co_filename:
            return None
        seen += event == "line"
        if event == "line" and seen == at:
            act()
        return look

    before = sys.gettrace()
    sys.settrace(look)
    try:
        command()
    finally:
        sys.settrace(before)
    return seen >= at


def struck_at(way: str, at: int) -> bool:
    """Stop at a line of a command; False if it has fewer."""
    b, inside = bench(LIMITS, probe=0), True
    wave = GuardedWave(b.output, TellingPlayer(b.device))
    wave.prepare(np.array([8.0, 16.0, 24.0]), 100.0)
    b.output.ramp(4.0)
    if way == "stop of unknown":
        b.device.budget = 3
        with pytest.raises(LinkLost):
            b.output.set(12.0)
    commands: dict[str, Callable[[], object]] = {
        "set": lambda: b.output.set(12.0),
        "ramp": lambda: b.output.ramp(6.0),
        "play": lambda: list(wave.play()),
        "power_up": b.output.power_up,
    }
    with suppress(HardwareError):
        inside = lines_of(commands.get(way, b.output.stop), b.output.stop, at)
    assert b.output.present in (None, b.device.volts), f"at line {at}"
    b.output.stop()
    assert b.output.present == b.device.volts == 0.0
    assert unsafe(b.device, -20.0, 100.0, 10.0) == [], f"at line {at}"
    return inside


@pytest.mark.parametrize("way", ["set", "ramp", "stop", "stop of unknown", "power_up", "play"])
def test_a_stop_at_any_line_leaves_neither_a_jump_nor_a_false_voltage(way: str) -> None:
    """Exhaustive: before every line of the guard, where a signal handler may come."""
    assert next(at for at in count(1) if not struck_at(way, at)) > 20


@pytest.mark.parametrize("ends", ["stop", "abort"])
def test_a_stop_within_an_abort_is_not_undone_by_it(ends: str) -> None:
    class Pressed(TellingPlayer):
        pressed = False

        def abort(self) -> None:
            super().abort()
            if not self.pressed:
                self.pressed = True
                b.output.stop()

    b = bench()
    wave = GuardedWave(b.output, Pressed(b.device))
    wave.prepare(RISE, 1e3)
    playing = wave.play()
    while next(playing).samples < 160:
        pass
    (b.output.stop if ends == "stop" else wave.abort)()
    assert b.output.present == b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


@pytest.mark.parametrize("reading", range(2, 15))
def test_a_stop_beside_a_step_of_a_waveform_leaves_no_false_voltage(reading: int) -> None:
    """As of a signal handler; the first reading is of play(), which begins behind such a stop."""
    b = bench()
    wave = GuardedWave(b.output, TellingPlayer(b.device))
    wave.prepare(RISE, 1e3)
    list(wave.play())
    b.output.stop()
    now, left = b.clock.now, [reading]

    def struck() -> float:
        left[0] -= 1
        if not left[0]:
            b.output.stop()
        return now()

    b.clock.now = struck  # type: ignore[method-assign]
    with suppress(HardwareError):
        list(wave.play())
    assert left[0] <= 0
    assert b.output.present == b.device.volts == 0.0
    with suppress(HardwareError):
        b.output.set(81.0)
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


@pytest.mark.parametrize("ends", ["stop", "close"])
def test_a_stop_within_a_power_up_ends_it(ends: str) -> None:
    b = bench()
    b.output.ramp(80.0)
    within(b, getattr(b.output, ends), lambda v: v == 0.0, "power-up")
    with pytest.raises(HardwareError, match="power_up: ended on its way by another command"):
        b.output.power_up()
    assert b.device.volts == 0.0
    assert b.causes()[-2:] == ["power-up", "write"]
    assert b.raw.closed == (ends == "close")
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    if ends == "stop":
        assert b.output.state is OutputState.PARKED
        assert b.output.present == 0.0
        with pytest.raises(LimitViolation, match=r"power_up\(\) has not ended"):
            b.output.set(1.0)
        b.output.power_up()
        b.output.set(1.0)


@pytest.mark.parametrize("command", ["set", "ramp", "power_up", "prepare"])
def test_nothing_but_a_stop_is_taken_within_a_write(command: str) -> None:
    b = bench()
    wave = GuardedWave(b.output, TellingPlayer(b.device))
    refused: list[str] = []

    def nested() -> None:
        try:
            if command == "prepare":
                wave.prepare(RISE, 1e3)
            else:
                getattr(b.output, command)(*((5.0,) if command != "power_up" else ()))
        except LimitViolation as error:
            refused.append(str(error))

    within(b, nested, lambda v: v > 5.0)
    b.output.ramp(10.0)
    assert "by a signal handler" in refused[0]
    assert b.device.volts == 10.0


def test_a_stop_within_a_write_that_fails_comes_all_the_same() -> None:
    b = bench()
    b.output.ramp(50.0)

    def lost() -> None:
        b.output.stop()
        b.device.budget = 0

    within(b, lost, lambda v: v > 52.0)
    with pytest.raises(LinkLost):
        b.output.set(55.0)
    assert b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED


def test_ctrl_c_in_close_leaves_the_link_for_the_way_down() -> None:
    b = bench()
    b.output.ramp(80.0)
    b.interrupts.left = 9
    with pytest.raises(KeyboardInterrupt):
        b.output.close()
    assert b.raw.closed == 0
    with pytest.raises(LimitViolation, match="closed"):
        b.output.set(1.0)
    b.output.close()
    assert b.device.volts == 0.0
    assert b.raw.closed == 1
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


def test_preparing_from_within_the_conversion_cannot_reach_a_playing_waveform() -> None:
    b = bench()
    player = TellingPlayer(b.device)
    wave = GuardedWave(b.output, player)
    playing: list[Iterator[WaveProgress]] = []

    class Playing:
        def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
            wave.prepare(RISE, 1e3)
            playing.append(wave.play())
            for _ in range(5):
                next(playing[0])
            return np.zeros(200)

    with pytest.raises(LimitViolation, match="a waveform is playing"):
        wave.prepare(Playing(), 1e3)
    assert player.loads == 1
    assert list(playing[0])[-1].samples == 200
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


def test_preparing_in_another_thread_cannot_reach_a_playing_waveform() -> None:
    device, _, output = threaded()
    player = TellingPlayer(device)
    wave = GuardedWave(output, player)
    begun, released = threading.Event(), threading.Event()
    refused: list[str] = []

    class Slow:
        def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
            begun.set()
            assert released.wait(HANGS)
            return np.zeros(200)

    def prepare() -> None:
        try:
            wave.prepare(Slow(), 1e3)
        except LimitViolation as error:
            refused.append(str(error))

    thread = threading.Thread(target=prepare)
    thread.start()
    assert begun.wait(HANGS)
    wave.prepare(RISE, 1e3)
    playing = wave.play()
    for _ in range(6):
        next(playing)
    released.set()
    thread.join(HANGS)
    assert list(playing)[-1].samples == 200
    assert "a waveform is playing" in refused[0]
    assert player.loads == 1
    assert unsafe(device, -20.0, 100.0, 10.0) == []


def test_two_guards_of_one_player_play_what_they_have_checked() -> None:
    b = bench()
    player = TellingPlayer(b.device)
    one, other = GuardedWave(b.output, player), GuardedWave(b.output, player)
    one.prepare(RISE, 1e3)
    other.prepare(np.full(7, 60.0), 1e3)
    assert list(one.play())[-1].samples == 200
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


def test_a_stop_waits_for_a_player_of_another_thread() -> None:
    inside, device_clock = threading.Event(), Yielding()
    device = Device(device_clock)

    class Deaf(RawPlayer):
        """Hears an abort only at the end of its slice."""

        position = 0

        def play(self) -> Iterator[WaveProgress]:
            for first in range(0, 200, 20):
                for v in self.volts[first : first + 20]:
                    device.command(float(v), "wave")
                    self.position += 1
                    inside.set()
                    time.sleep(5e-4)
                yield WaveProgress(first + 20, 200)

    output = GuardedOutput(RawDevice(device), LIMITS, device_clock)
    output.power_up()
    wave = GuardedWave(output, Deaf(device))
    wave.prepare(RISE, 1e3)
    ended: list[str] = []

    def play() -> None:
        try:
            list(wave.play())
        except LimitViolation as error:
            ended.append(str(error))

    thread = threading.Thread(target=play)
    thread.start()
    assert inside.wait(HANGS)
    output.stop()
    steps = len(device.steps)
    thread.join(HANGS)
    assert "ended by another command" in ended[0]
    assert len(device.steps) == steps
    assert device.volts == 0.0
    assert output.state is OutputState.PARKED
    assert unsafe(device, -20.0, 100.0, 10.0) == []


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_no_copies(copied: Callable[[object], object]) -> None:
    b = bench()
    for guard in (b.output, GuardedWave(b.output, RawPlayer(b.device))):
        with pytest.raises(TypeError, match="cannot be copied"):
            copied(guard)
    with pytest.raises(TypeError, match="set up already"):
        b.output.__init__(b.raw, LIMITS)


def test_a_stop_that_fails_says_so_and_lets_commands_in_again() -> None:
    b = bench()
    b.output.ramp(50.0)
    b.device.reachable = False
    with pytest.raises(LinkLost):
        b.output.stop()
    assert b.output.state is OutputState.UNKNOWN
    b.device.reachable = True
    b.output.stop()
    b.output.set(1.0)
    assert b.device.volts == 1.0
