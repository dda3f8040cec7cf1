"""The guard of waveforms: refusals, ways out, marks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

from hardware.contracts import Flag, WaveOut, WaveProgress
from hardware.envelope import Converter, Dwell, Envelope, GuardedWave, OutputState, RawWave, parked
from hardware.errors import LimitViolation, LinkLost, ProtocolFault
from tests.hardware.envelope.device import RawPlayer, TellingPlayer, TrueTime, unsafe
from tests.hardware.envelope.test_guard import LIMITS, Bench, bench

RATE = 1e3
TIME = np.arange(100) / RATE
WAVE = 40.0 - 40.0 * np.cos(2.0 * np.pi * 10.0 * TIME)


def waves(b: Bench, telling: bool = True) -> tuple[GuardedWave, RawPlayer]:
    player = (TellingPlayer if telling else RawPlayer)(b.device)
    return GuardedWave(b.output, player), player


def test_a_waveform_is_played_and_its_end_stays() -> None:
    b = bench()
    wave, player = waves(b)
    assert isinstance(wave, WaveOut)
    assert isinstance(player, RawWave)
    wave.prepare(WAVE, RATE)
    assert wave.rate == RATE
    reports = list(wave.play())
    assert [r.samples for r in reports] == [20, 40, 60, 80, 100]
    assert b.output.present == pytest.approx(WAVE[-1])
    assert b.output.state is OutputState.DRIVEN
    assert list(wave.play())[-1].samples == 100
    b.output.stop()
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


def test_refused_before_a_byte_leaves() -> None:
    b = bench()
    wave, player = waves(b)
    sent = len(b.device.steps)
    steep = np.array([0.0, 50.0])
    for bad in (WAVE + 50.0, WAVE * math.nan, 5.0 * WAVE, steep, np.zeros(0)):
        with pytest.raises(LimitViolation):
            wave.prepare(bad, RATE)
        with pytest.raises(LimitViolation, match="no waveform is prepared"):
            wave.play()
    assert player.loads == 0
    assert len(b.device.steps) == sent


def test_what_was_checked_is_what_is_played() -> None:
    b = bench()
    wave, player = waves(b)
    mine = WAVE.copy()
    wave.prepare(mine, RATE)
    mine[:] = 1e6
    assert not player.volts.flags.writeable
    for _ in wave.play():
        pass
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


def test_the_step_into_it_counts_when_it_is_played() -> None:
    b = bench(up=False)
    wave, player = waves(b)
    wave.prepare(WAVE + 20.0, RATE)
    assert player.loads == 0
    with pytest.raises(LimitViolation, match="not powered up"):
        wave.play()
    b.output.power_up()
    with pytest.raises(LimitViolation, match=r"ramp\(20\) first"):
        wave.play()
    b.output.ramp(20.0)
    playing = wave.play()
    b.output.ramp(60.0)
    with pytest.raises(LimitViolation, match="entry"):
        next(playing)
    b.output.ramp(20.0)
    assert list(wave.play())[-1].samples == 100
    assert player.loads == 1


@pytest.mark.parametrize("telling", [True, False])
@pytest.mark.parametrize("way", ["close", "throw", "interrupt", "stop", "abandon"])
def test_every_way_out_parks(way: str, telling: bool) -> None:
    b = bench()
    wave, player = waves(b, telling)
    wave.prepare(WAVE, RATE)
    playing = wave.play()
    next(playing)
    next(playing)
    if way == "close":
        playing.close()
    elif way == "throw":
        with pytest.raises(ZeroDivisionError):
            playing.throw(ZeroDivisionError())
    elif way == "interrupt":
        b.interrupts.left = 7
        with pytest.raises(KeyboardInterrupt):
            next(playing)
    elif way == "stop":
        b.output.stop()
        with pytest.raises(LimitViolation, match="ended by another command"):
            next(playing)
    else:
        # the iterator is only dropped later: the guard of the block has to know of it
        with parked(b.output):
            pass
    assert b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED
    assert player.aborted >= 1
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


@pytest.mark.parametrize("place", range(16, 26))
def test_ctrl_c_anywhere_in_a_steep_waveform(place: int) -> None:
    b = bench()
    wave, _ = waves(b)
    rise = np.linspace(0.0, 99.0, 11)
    wave.prepare(np.concatenate([rise, rise[::-1]] * 3), RATE)
    b.interrupts.left = place
    with pytest.raises(KeyboardInterrupt):
        list(wave.play())
    assert b.device.volts == 0.0
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []


def test_an_abort_that_was_interrupted_is_done_again() -> None:
    class Pressed(TellingPlayer):
        pressed = False

        def abort(self) -> None:
            if not self.pressed:
                self.pressed = True
                raise KeyboardInterrupt
            super().abort()

    b = bench()
    player = Pressed(b.device)
    wave = GuardedWave(b.output, player)
    wave.prepare(WAVE, RATE)
    playing = wave.play()

    def interrupted() -> None:
        with parked(b.output):
            next(playing)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not player.running
    assert b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED


def test_abort_leaves_the_voltage_and_ends_the_iterator() -> None:
    b = bench()
    wave, _ = waves(b)
    wave.abort()
    wave.prepare(WAVE, RATE)
    playing = wave.play()
    next(playing)
    with pytest.raises(LimitViolation, match="a waveform is playing"):
        b.output.set(1.0)
    with pytest.raises(LimitViolation, match="a waveform is playing"):
        wave.prepare(WAVE, RATE)
    wave.abort()
    assert b.output.present == pytest.approx(WAVE[19])
    with pytest.raises(LimitViolation, match="ended by another command"):
        next(playing)
    assert b.device.volts == pytest.approx(WAVE[19])


@pytest.mark.parametrize("after", [10, 200, 700])
def test_a_link_lost_within_it(after: int) -> None:
    b = bench()
    wave, _ = waves(b)
    wave.prepare(WAVE, RATE)
    b.device.budget = after
    with pytest.raises(LinkLost):
        list(wave.play())
    assert b.output.state is OutputState.PARKED
    assert b.device.volts == 0.0
    b.output.ramp(0.0)
    wave.prepare(WAVE, RATE)
    b.device.budget = after
    playing = wave.play()
    b.device.reachable = False
    with pytest.raises(LinkLost) as caught:
        list(playing)
    assert "the way down failed too" in caught.value.__notes__[0]
    assert "output unknown" in str(b.output.status)


def test_a_player_that_ends_early_is_a_fault() -> None:
    class Short(TellingPlayer):
        def play(self) -> Iterator[WaveProgress]:
            for written in super().play():
                yield written
                self.running = False

    b = bench()
    wave = GuardedWave(b.output, Short(b.device))
    wave.prepare(WAVE, RATE)
    with pytest.raises(ProtocolFault, match="20 of 100 samples"):
        list(wave.play())
    assert b.output.state is OutputState.PARKED


def test_a_device_that_plays_on_by_itself_is_found_where_it_really_is() -> None:
    class Autonomous:
        """Plays in hardware: reports lag behind, and only abort ends it."""

        def __init__(self) -> None:
            self.position = 0

        def load(self, volts: np.ndarray, rate: float) -> None:
            self.volts = volts

        def play(self) -> Iterator[WaveProgress]:
            for k in range(1, 6):
                for v in self.volts[20 * (k - 1) : 20 * k]:
                    b.device.command(float(v), "wave")
                yield WaveProgress(20 * k, 100)

        def abort(self) -> None:
            for v in self.volts[40:55]:
                b.device.command(float(v), "wave")
            self.position = 55

    b = bench()
    wave = GuardedWave(b.output, Autonomous())
    wave.prepare(WAVE, RATE)
    playing = wave.play()
    next(playing)
    next(playing)
    b.output.stop()
    assert unsafe(b.device, -20.0, 100.0, 10.0) == []
    assert b.device.volts == 0.0


def test_clamped_samples_are_flagged() -> None:
    b = bench(clamp=True)
    wave, player = waves(b)
    wave.prepare(1.4 * WAVE, RATE)
    assert player.volts.max() == 100.0
    flags = np.concatenate([c.flags for r in wave.play() for c in r.chunks])
    np.testing.assert_array_equal(flags == Flag.CLAMPED, 1.4 * WAVE > 100.0)
    assert (flags == Flag.CLAMPED).any()
    with pytest.raises(LimitViolation, match="not finite"):
        wave.prepare(np.full(5, math.inf), RATE)


def test_rounding_is_trimmed() -> None:
    b = bench()
    wave, player = waves(b)
    wave.prepare(WAVE + 20.0 + 1e-8, RATE)
    assert player.volts.max() == 100.0


def test_dwell_goes_on_across_waveforms() -> None:
    b = bench(Envelope(-20.0, 100.0, 1e4, gentle=500.0, dwell=[Dwell(60.0, 0.2)]))
    wave, _ = waves(b)
    up = np.linspace(0.0, 80.0, 100)
    wave.prepare(up, RATE)
    list(wave.play())
    b.clock.sleep(0.12)
    wave.prepare(np.full(100, 80.0), RATE)
    with pytest.raises(LimitViolation, match="before it"):
        wave.play()
    b.clock.sleep(0.1)
    with pytest.raises(LimitViolation, match="ramped to 0 V"):
        b.output.tend()


@pytest.mark.parametrize("found_by", ["tend", "next"])
def test_dwell_holds_while_a_waveform_stalls(found_by: str) -> None:
    b = bench(Envelope(-20.0, 100.0, 1e4, gentle=500.0, dwell=[Dwell(60.0, 0.2)]))
    wave, player = waves(b)
    wave.prepare(np.concatenate([np.linspace(0.0, 80.0, 100), np.linspace(80.0, 0.0, 100)]), RATE)
    playing = wave.play()
    while next(playing).samples < 100:
        b.output.tend()
    b.clock.sleep(0.19)
    b.output.tend()
    b.clock.sleep(0.02)
    look = b.output.tend if found_by == "tend" else playing.__next__
    with pytest.raises(LimitViolation, match=r"21[01] ms beyond 60 V.* ramped to 0 V"):
        look()
    assert not player.running
    assert b.device.volts == 0.0
    assert b.output.state is OutputState.PARKED
    # below the level it may wait as long as it likes
    playing = wave.play()
    assert next(playing).samples == 20
    b.clock.sleep(10.0)
    b.output.tend()
    assert list(playing)[-1].samples == 200


class Alone:
    """Plays on the device's own clock; `heard` is how many samples it says that it has put out."""

    def __init__(self, clock: TrueTime, stands: int) -> None:
        self.clock, self.stands, self.begin = clock, stands, 0.0

    def load(self, volts: np.ndarray, rate: float) -> None:
        self.total, self.rate = volts.size, rate

    def put_out(self) -> int:
        return min(int((self.clock.now() - self.begin) * self.rate) + 1, self.total, self.stands)

    def play(self) -> Iterator[WaveProgress]:
        self.begin = self.clock.now()
        while (count := self.put_out()) < self.total:
            self.clock.sleep(0.02)
            yield WaveProgress(count, self.total)
        yield WaveProgress(self.total, self.total)

    def abort(self) -> None:
        self.stands = self.put_out()


class Telling(Alone):
    @property
    def position(self) -> int:
        return self.put_out()


class Mute(Alone):
    position = None


@pytest.mark.parametrize("kind", [Telling, Mute])
def test_a_player_that_goes_on_by_itself_does_not_stall(kind: type[Alone]) -> None:
    b = bench(Envelope(-20.0, 100.0, 1e4, gentle=500.0, dwell=[Dwell(60.0, 0.2)]))
    wave = GuardedWave(b.output, kind(b.clock, 10**6))
    wave.prepare(np.tile(WAVE, 10), RATE)
    playing = wave.play()
    while next(playing).samples < 40:
        pass
    assert (b.output.present or 0.0) > 60.0
    b.clock.sleep(0.25)
    b.output.tend()
    assert list(playing)[-1].samples == 1000


@pytest.mark.parametrize("kind", [Telling, Mute])
def test_an_end_that_nobody_asked_about_counts_from_when_it_came(kind: type[Alone]) -> None:
    b = bench(Envelope(-20.0, 100.0, 1e4, gentle=500.0, dwell=[Dwell(60.0, 0.5)]))
    wave = GuardedWave(b.output, kind(b.clock, 10**6))
    wave.prepare(WAVE[: int(np.argmax(WAVE)) + 1], RATE)
    playing = wave.play()
    next(playing)
    b.clock.sleep(2.0)
    with pytest.raises(LimitViolation, match="beyond 60 V"):
        list(playing)
    assert b.output.state is OutputState.PARKED


def test_a_player_that_stops_going_on_by_itself_stalls() -> None:
    b = bench(Envelope(-20.0, 100.0, 1e4, gentle=500.0, dwell=[Dwell(60.0, 0.2)]))
    wave = GuardedWave(b.output, Telling(b.clock, 150))
    wave.prepare(np.tile(WAVE, 10), RATE)
    # its reports go on, but tell of nothing new
    with pytest.raises(LimitViolation, match="beyond 60 V"):
        list(islice(wave.play(), 50))
    assert b.output.state is OutputState.PARKED


def test_the_converter_limits_waveforms() -> None:
    b = bench(converter=Converter(-10.0, 60.0))
    wave, _ = waves(b)
    with pytest.raises(LimitViolation, match="converter's own range"):
        wave.prepare(WAVE, RATE)


def test_limits_of_these_tests() -> None:
    assert LIMITS.largest_step(0.0, 100.0) == 10.0


def test_a_player_that_may_hurry_is_judged_at_its_haste() -> None:
    class Hasty(TellingPlayer):
        haste = 1.1

    b = bench()
    low, high = 0.0, b.output.envelope.slew / RATE
    steps = np.array([low, 0.95 * high, low])
    GuardedWave(b.output, TellingPlayer(b.device)).prepare(steps, RATE)
    hasty = GuardedWave(b.output, Hasty(b.device))
    hasty.prepare(0.9 * steps, RATE)
    with pytest.raises(LimitViolation, match="catch up after a stall"):
        hasty.prepare(steps, RATE)
