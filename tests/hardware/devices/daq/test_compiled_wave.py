"""The compiled player over plain memory: same record, same faults, a thread of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from bondgraph.support.native import compiler
from hardware.contracts import WaveProgress
from hardware.devices.amplifier import Amplifier, Monitors
from hardware.devices.daq import MF634, CardWiring, CompiledWave, MemoryRegisters, SampleClock
from hardware.devices.daq.codes import STEP
from hardware.errors import HardwareError, LinkLost, ProtocolFault, TimedOut
from hardware.simulators.registers import CardFront
from hardware.simulators.rig import Rig
from tests.benchmarks.players import measure
from tests.hardware.devices.daq.bench import Capacitor, card_on

pytestmark = pytest.mark.skipif(compiler() is None, reason="needs gcc")

STACK = Amplifier(gain=20.0, monitors=Monitors(voltage=0.05, current=50.0))


def player(wiring: CardWiring | None = None) -> tuple[MemoryRegisters, CompiledWave]:
    registers = MemoryRegisters()
    card = MF634(registers, timeout=0.02)
    card.power_up()
    return registers, CompiledWave(card, STACK, wiring)


def joined(reports: list[WaveProgress], name: str) -> np.ndarray:
    return np.concatenate([c.channels[name] for r in reports for c in r.chunks])


def test_all_samples_are_written_and_reported_once() -> None:
    registers, wave = player(CardWiring(output=2, trigger=3))
    volts = np.linspace(0.0, 100.0, 3000)
    wave.load(volts, 50e3)
    begin = time.perf_counter()
    reports = list(wave.play())
    end = time.perf_counter()
    assert reports[-1].samples == reports[-1].total == wave.position == 3000
    assert [c.first for r in reports for c in r.chunks] == [
        0,
        *np.cumsum([c.n for r in reports for c in r.chunks])[:-1],
    ]
    assert np.abs(joined(reports, "V") - volts).max() <= 20.0 * STEP
    at = joined(reports, "instant")
    assert np.diff(at).min() >= 20e-6 / 1.1 - 1e-9
    # on the clock of the program
    assert begin <= at[0] < at[-1] <= end
    assert registers.read16(2, 0x24) == 0x2000 + round(5.0 / STEP)
    assert registers.read16(2, 0x20) == 0x2000
    assert registers.read16(2, 0x10) == 0


def test_the_monitors_are_read_in_the_order_of_the_wiring() -> None:
    _, wave = player(CardWiring(monitors=(4, 1)))
    wave.load(np.zeros(200), 20e3)
    reports = list(wave.play())
    # plain memory answers every input with the list that was written there: bits 1 and 4
    assert np.allclose(joined(reports, "V_mon"), 0b10010 * STEP / 0.05)
    assert np.allclose(joined(reports, "i"), 0b10010 * STEP / 50.0)


@pytest.mark.parametrize("clocking", [SampleClock.TOGGLE, SampleClock.PULSE])
def test_the_lines_end_low(clocking: SampleClock) -> None:
    registers, wave = player(CardWiring(trigger=0, clock=1, clocking=clocking))
    wave.load(np.zeros(51), 20e3)
    assert list(wave.play())[-1].samples == 51
    assert registers.read16(2, 0x10) == 0


@pytest.mark.parametrize(
    ("word", "error", "monitors"),
    [
        (0xFFFFFFFF, LinkLost, ()),
        (0xFFFFFFFF, LinkLost, (0, 1)),
        (0, LinkLost, ()),
        (1 << 26 | 1 << 23, LinkLost, ()),
        (1 << 26 | 1 << 17, TimedOut, (0, 1)),
    ],
)
def test_a_fault_in_the_middle_ends_it_after_what_was_written(
    word: int, error: type[HardwareError], monitors: tuple[int, ...]
) -> None:
    registers, wave = player(CardWiring(monitors=monitors))
    wave.load(np.zeros(100_000), 10e3)
    playing = wave.play()
    next(playing)
    registers.write32(3, 0x68, word)
    got = 0
    with pytest.raises(error):
        got = drained(playing)
    assert got == 0
    assert 0 < wave.position < 50_000
    if error is LinkLost:
        with pytest.raises(ProtocolFault, match="power_up"):
            wave.play()


def drained(playing: Iterator[WaveProgress]) -> int:
    return sum(c.n for r in playing for c in r.chunks)


def test_abort_stops_the_thread_and_the_position_stands() -> None:
    before = threading.active_count()
    _, wave = player()
    wave.load(np.zeros(1_000_000), 10e3)
    playing = wave.play()
    next(playing)
    wave.abort()
    position = wave.position
    assert 0 < position < 1_000_000
    assert drained(playing) >= 0
    assert wave.position == position
    assert threading.active_count() == before

    playing = wave.play()
    next(playing)
    playing.close()  # type: ignore[attr-defined]
    assert threading.active_count() == before
    playing = wave.play()
    wave.abort()
    assert drained(playing) == 0


def test_loading_during_a_wave_changes_nothing_of_it() -> None:
    registers, wave = player()
    volts = np.linspace(0.0, 100.0, 3000)
    wave.load(volts, 50e3)
    playing = wave.play()
    reports = [next(playing)]
    wave.load(np.zeros(5), 10.0)
    reports += playing
    assert reports[-1].samples == reports[-1].total == 3000
    assert np.abs(joined(reports, "V") - volts).max() <= 20.0 * STEP
    assert registers.read16(2, 0x20) == 0x2000 + round(5.0 / STEP)


def test_a_long_period_is_left_at_once() -> None:
    _, wave = player()
    wave.load(np.zeros(10), 0.1)
    playing = wave.play()
    assert [next(playing).samples for _ in range(3)] == [1, 1, 1]
    before = threading.active_count()
    wave.abort()
    # not at the end of the period, where the second sample would be written
    assert wave.position == 1
    assert threading.active_count() < before


def test_a_simulated_card_is_not_in_memory() -> None:
    rig = Rig(Capacitor())
    with pytest.raises(UnusableInput, match="SoftwareTimedWave"):
        CompiledWave(card_on(CardFront(rig), rig), STACK)
    with pytest.raises(UnusableInput, match="haste"):
        CompiledWave(MF634(MemoryRegisters()), STACK, haste=0.5)


def test_the_measurement_tells_rate_and_delay() -> None:
    _, wave = player()
    timing = measure(wave, 5e3, 0.05)
    assert timing.reached <= 5e3 * 1.1
    assert timing.worst >= timing.middle >= 0.0
    assert "reached" in str(timing)
