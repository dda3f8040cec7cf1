"""The software-timed player: schedule, trigger, clock line, monitors, faults."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag, WallClock, WaveProgress
from hardware.devices.amplifier import EPA_104, Amplifier, Monitors
from hardware.devices.daq import (
    MF634,
    Access,
    CardWiring,
    MemoryRegisters,
    SampleClock,
    Schedule,
    SocketRegisters,
    SoftwareTimedWave,
    dac_codes,
)
from hardware.errors import HardwareError, LimitViolation, LinkLost, ProtocolFault, TimedOut
from hardware.simulators.registers import CardFront, Wires
from hardware.simulators.registers.model import WRITE16
from hardware.simulators.rig import Rig
from tests.hardware.devices.daq.bench import Capacitor, RigClock, card_on

STACK = Amplifier(gain=20.0, monitors=Monitors(voltage=0.05, current=50.0))


def player(
    wiring: CardWiring | None = None, wires: Wires | None = None
) -> tuple[Rig, CardFront, SoftwareTimedWave]:
    rig = Rig(Capacitor())
    front = CardFront(rig, wires=wires or Wires(noise=0.0))
    card = card_on(front, rig)
    card.power_up()
    return rig, front, SoftwareTimedWave(card, STACK, wiring)


def sine(n: int, rate: float, hertz: float = 10.0) -> np.ndarray:
    return np.asarray(50.0 - 50.0 * np.cos(2 * np.pi * hertz * np.arange(n) / rate))


def joined(reports: list[WaveProgress], name: str) -> np.ndarray:
    return np.concatenate([c.channels[name] for r in reports for c in r.chunks])


def test_samples_are_written_at_their_instants_without_drift() -> None:
    rig, front, wave = player(CardWiring(trigger=0))
    volts = sine(2000, 1000.0)
    wave.load(volts, 1000.0)
    reports = list(wave.play())
    written = [e for e in front.log if e.kind == WRITE16 and e.offset == 0x20][1:]
    at = np.array([e.instant for e in written])
    assert len(at) == 2000
    assert np.abs(at - at[0] - np.arange(2000) / 1000.0).max() < 1e-9
    assert list(rig.trigger_edges) == pytest.approx([at[0]])
    assert np.abs(joined(reports, "V") - volts).max() <= 20.0 * 10.0 / 16384 + 1e-9
    assert np.abs(joined(reports, "instant") - at).max() < 1e-9
    assert reports[-1].samples == reports[-1].total == 2000
    assert reports[-1].late == 0
    assert len(reports) == 100
    assert [c.first for r in reports for c in r.chunks] == list(range(0, 2000, 20))


def test_a_monitor_reading_is_the_settled_voltage_before_its_sample() -> None:
    _, _, wave = player(CardWiring(monitors=(0, 1)))
    volts = sine(500, 1000.0)
    wave.load(volts, 1000.0)
    reports = list(wave.play())
    shown, sent = joined(reports, "V_mon"), joined(reports, "V")
    assert np.abs(shown[1:] - sent[:-1]).max() <= 20.0 * 10.0 / 16384
    current = joined(reports, "i")
    peak = 1e-6 * 50.0 * 2 * np.pi * 10.0 * 10.0
    # the plant's step is a tenth of a sample: the charge of a sample flows in its first tenth
    assert np.abs(current).max() < peak


@pytest.mark.parametrize(
    ("clocking", "both", "edges"),
    [(SampleClock.TOGGLE, True, 400), (SampleClock.PULSE, False, 400)],
)
def test_the_clock_line_gives_an_edge_for_every_sample(
    clocking: SampleClock, both: bool, edges: int
) -> None:
    rig, _, wave = player(
        CardWiring(trigger=1, clock=0, clocking=clocking), Wires(noise=0.0, both_edges=both)
    )
    wave.load(sine(400, 2000.0), 2000.0)
    list(wave.play())
    seen = np.array(rig.trigger_edges)[:edges]
    assert seen.size == edges
    assert np.abs(np.diff(seen) - 1 / 2000.0).max() < 1e-9


class Stalling:
    """A clock whose sleeper oversleeps once."""

    def __init__(self, rig: Rig, after: float, by: float) -> None:
        self.rig, self.after, self.by = rig, after, by

    def now(self) -> float:
        return self.rig.now

    def sleep(self, seconds: float) -> None:
        if self.rig.now > self.after:
            seconds, self.by = seconds + self.by, 0.0
        self.rig.wait(seconds)


def test_after_a_stall_samples_are_late_and_flagged_but_never_come_in_a_burst() -> None:
    rig = Rig(Capacitor())
    front = CardFront(rig)
    card = card_on(front, rig)
    card.power_up()
    wave = SoftwareTimedWave(card, STACK, clock=Stalling(rig, 0.2, 0.0104))
    wave.load(sine(1000, 1000.0), 1000.0)
    reports = list(wave.play())
    at = joined(reports, "instant")
    assert np.diff(at).min() == pytest.approx(1e-3 / 1.1, rel=1e-6)
    flags = np.concatenate([c.flags for r in reports for c in r.chunks])
    lateness = at - at[0] - np.arange(1000) / 1000.0
    assert ((flags & Flag.LATE) > 0).tolist() == (lateness > 0.5e-3).tolist()
    assert reports[-1].late == int((lateness > 0.5e-3).sum()) > 90
    assert lateness[-1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("stalled", [0, 21, 22])
def test_a_stall_between_the_clock_and_the_write_brings_no_burst(
    stalled: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, front, wave = player()
    batch, written = front.registers.batch, [0]

    def late(accesses: list[Access]) -> list[int]:
        accesses = list(accesses)
        if any(a[0] == WRITE16 and a[2] == 0x20 for a in accesses):
            if written[0] == stalled:
                rig.wait(0.0105)
            written[0] += 1
        return batch(accesses)

    monkeypatch.setattr(front.registers, "batch", late)
    wave.load(sine(200, 1000.0), 1000.0)
    list(wave.play())
    at = np.array([e.instant for e in front.log if e.kind == WRITE16 and e.offset == 0x20][1:])
    assert len(at) == 200
    assert np.diff(at).min() >= 1e-3 / 1.1 - 1e-9
    # and it catches up
    assert at[-1] - at[0] == pytest.approx(0.199 - (0.0105 if stalled == 0 else 0.0), abs=1e-6)


class Costly:
    """A clock that passes only while somebody waits or writes."""

    time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds


@pytest.mark.parametrize("odd", [10e-6, 70e-6, 5e-3])
def test_one_odd_write_does_not_slow_the_schedule_down(odd: float) -> None:
    clock = Costly()
    schedule = Schedule(clock, 200e-6, 1.1)
    schedule.begin(0.0)
    late = []
    for k in range(600):
        late.append(schedule.wait(k)[0])
        clock.time += odd if k == 100 else 40e-6
        schedule.written()
    assert late[-1] == pytest.approx(0.0, abs=1e-9)


def test_two_stalls_in_a_row_bring_no_burst_either() -> None:
    clock = Costly()
    schedule = Schedule(clock, 200e-6, 1.1)
    schedule.begin(0.0)
    ends = []
    for k in range(20):
        schedule.wait(k)
        clock.time += 5e-3 if k in (10, 11) else 1e-6
        schedule.written()
        ends.append(clock.time)
    assert np.diff(ends).min() >= 200e-6 / 1.1 - 5e-6


def test_a_slow_waveform_still_reports_every_20_ms() -> None:
    rig, front, wave = player()
    wave.load(np.array([0.0, 1.0, 2.0, 3.0]), 2.0)
    seen = []
    for report in wave.play():
        seen.append((rig.now, report.samples))
    assert np.diff([t for t, _ in seen]).max() < 0.031
    assert seen[-1][1] == 4
    at = [e.instant for e in front.log if e.offset == 0x20 and e.kind == WRITE16][1:]
    assert np.diff(at) == pytest.approx(0.5)


def test_abort_and_closing_stop_where_the_output_is_and_lower_the_trigger() -> None:
    rig, front, wave = player(CardWiring(trigger=0))
    wave.load(sine(1000, 1000.0), 1000.0)
    playing = wave.play()
    first = next(playing)
    held = rig.volts
    playing.close()  # type: ignore[attr-defined]
    assert (first.samples, rig.volts) == (20, held)
    assert front.log[-1].offset == 0x10
    assert front.log[-1].value == 0

    playing = wave.play()
    next(playing)
    wave.abort()
    rest = list(playing)
    assert sum(c.n for r in rest for c in r.chunks) == 0
    assert wave.position == 20

    playing = wave.play()
    wave.abort()
    assert [r.samples for r in playing] == [0]
    assert (wave.position, rig.volts) == (0, held)


@pytest.mark.parametrize(
    ("fault", "error", "monitors"),
    [
        ("gone", LinkLost, (0, 1)),
        ("gone", LinkLost, ()),
        ("reset", LinkLost, (0, 1)),
        ("reset", LinkLost, ()),
        ("endless", TimedOut, (0, 1)),
    ],
)
def test_a_fault_in_the_middle_carries_what_was_written(
    fault: str, error: type[HardwareError], monitors: tuple[int, ...]
) -> None:
    rig, front, wave = player(CardWiring(monitors=monitors))
    wave.load(sine(1000, 1000.0), 1000.0)

    def strike() -> None:
        if fault == "reset":
            front.registers.power_cycle()
        else:
            setattr(front.faults, fault, True)

    rig.at(0.0305, strike)
    playing = wave.play()
    assert next(playing).samples == 20
    with pytest.raises(error) as caught:
        next(playing)
    (chunk,) = caught.value.partial
    assert chunk.first == 20
    assert 8 <= chunk.n <= 10
    assert rig.extremes.highest < 100.0
    if error is LinkLost:
        with pytest.raises(ProtocolFault, match="power_up"):
            wave.play()


@pytest.mark.parametrize("bad", [np.nan, np.inf, 101.0, -0.5])
def test_a_waveform_outside_the_limits_is_refused_before_anything_is_written(bad: float) -> None:
    _, front, wave = player()
    before = len(front.log)
    with pytest.raises(LimitViolation, match="sample 3"):
        wave.load(np.array([0.0, 1.0, 2.0, bad]), 1000.0)
    assert len(front.log) == before


def test_misuse_is_one_line() -> None:
    rig, front, wave = player()
    with pytest.raises(ProtocolFault, match="load"):
        wave.play()
    with pytest.raises(UnusableInput):
        wave.load(np.zeros(0), 1000.0)
    with pytest.raises(UnusableInput):
        wave.load(np.zeros(3), 0.0)
    with pytest.raises(UnusableInput, match="name one input for each"):
        SoftwareTimedWave(card_on(front, rig), EPA_104, CardWiring(monitors=(0, 1)))


def test_over_tcp_a_waveform_and_its_monitors_arrive_as_in_the_process() -> None:
    rig = Rig(Capacitor())
    front = CardFront(rig, wires=Wires(noise=0.0))
    registers = SocketRegisters(front.start())
    try:
        card = MF634(registers, RigClock(rig))
        card.power_up()
        wave = SoftwareTimedWave(card, STACK, CardWiring(monitors=(0, 1), trigger=0))
        wave.load(sine(200, 1000.0), 1000.0)
        reports = list(wave.play())
    finally:
        registers.close()
        front.stop()
    assert reports[-1].samples == 200
    assert np.abs(joined(reports, "V_mon")[1:] - joined(reports, "V")[:-1]).max() < 0.02


def test_on_the_wall_clock_the_player_keeps_time_over_plain_memory() -> None:
    registers = MemoryRegisters()
    card = MF634(registers, WallClock())
    card.power_up()
    wave = SoftwareTimedWave(card, STACK)
    wave.load(sine(200, 2000.0), 2000.0)
    at = joined(list(wave.play()), "instant")
    # a shared machine may stall: the middle of the distribution has to be right
    assert abs(np.median(np.diff(at)) - 5e-4) < 50e-6
    assert np.diff(at).min() >= 5e-4 / 1.1 - 1e-9


def test_the_schedule_tells_how_late_a_sample_is() -> None:
    rig = Rig(Capacitor())
    schedule = Schedule(RigClock(rig), 0.01)
    schedule.begin(0.05)
    assert list(schedule.wait(0)) == pytest.approx([0.0, 0.05])
    rig.wait(0.025)
    assert list(schedule.wait(1)) == pytest.approx([0.015, 0.075])
    assert schedule.wait(2)[0] == pytest.approx(0.075 + 0.01 / 1.1 - 0.07)


def test_loading_during_a_wave_changes_nothing_of_it() -> None:
    _, front, wave = player(CardWiring(monitors=(0, 1)))
    volts = sine(300, 1000.0)
    wave.load(volts, 1000.0)
    playing = wave.play()
    reports = [next(playing)]
    wave.load(np.full(1000, 100.0), 10e3)
    reports += playing
    sent = [e for e in front.log if e.kind == WRITE16 and e.offset == 0x20][1:]
    codes = dac_codes(STACK.input_record(volts)).tolist()
    assert [e.value for e in sent] == codes
    assert np.diff([e.instant for e in sent]) == pytest.approx(1e-3)
    assert dac_codes(STACK.input_record(joined(reports, "V"))).tolist() == codes
    assert wave.rate == 10e3
    assert next(wave.play()).total == 1000


def test_writes_that_take_longer_and_longer_do_not_come_in_a_burst() -> None:
    """While it catches up, too."""
    clock = Costly()
    schedule = Schedule(clock, 1e-3, 1.1)
    schedule.begin(0.0)
    ends = []
    for k in range(40):
        schedule.wait(k)
        clock.time += {10: 5e-3, 14: 0.4e-3, 15: 0.8e-3}.get(k, 0.2e-3)
        schedule.written()
        ends.append(clock.time)
    assert np.diff(ends).min() >= 1e-3 / 1.1 - 1e-9
