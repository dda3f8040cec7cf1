"""The guard around card and amplifier, over the real wire: what the stack meets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from hardware.devices.amplifier import Amplifier, AnalogueAmplifier, Monitors
from hardware.devices.daq import (
    MF634,
    CardChannel,
    CardInputs,
    CardWiring,
    SocketRegisters,
    SoftwareTimedWave,
)
from hardware.envelope import P840_1_UNIPOLAR, GuardedOutput, GuardedWave, OutputState
from hardware.errors import LimitViolation, LinkLost
from hardware.simulators.registers import CardFront, Wires
from hardware.simulators.rig import Rig
from tests.hardware.devices.daq.bench import Capacitor, RigClock

STACK = Amplifier(gain=20.0, monitors=Monitors(voltage=0.05, current=50.0))


@dataclass
class Bench:
    rig: Rig
    front: CardFront
    output: GuardedOutput
    wave: GuardedWave


@pytest.fixture
def bench() -> Iterator[Bench]:
    rig = Rig(Capacitor())
    front = CardFront(rig, wires=Wires(noise=0.2e-3))
    registers = SocketRegisters(front.start())
    clock = RigClock(rig)
    card = MF634(registers, clock)
    raw = AnalogueAmplifier(CardChannel(card), STACK, CardInputs(card, (0, 1)), clock=clock)
    output = GuardedOutput(raw, P840_1_UNIPOLAR, clock)
    player = SoftwareTimedWave(card, STACK, CardWiring(monitors=(0, 1), trigger=0))
    yield Bench(rig, front, output, GuardedWave(output, player))
    registers.close()
    front.stop()


def sine(n: int = 1000, rate: float = 2000.0) -> np.ndarray:
    return np.asarray(50.0 - 50.0 * np.cos(2 * np.pi * 2.0 * np.arange(n) / rate))


def test_a_waveform_in_order(bench: Bench) -> None:
    bench.output.power_up()
    bench.wave.prepare(sine(), 2000.0)
    reports = list(bench.wave.play())
    assert reports[-1].samples == 1000
    assert len(bench.rig.trigger_edges) == 1
    bench.output.stop()
    assert bench.rig.volts == pytest.approx(0.0, abs=0.02)
    worst = bench.rig.extremes
    assert -0.02 < worst.lowest
    assert worst.highest <= 100.0
    assert worst.largest_step < 1.5


def test_interrupting_in_the_middle_ramps_down(bench: Bench) -> None:
    bench.output.power_up()
    bench.wave.prepare(sine(), 2000.0)
    playing = bench.wave.play()
    for report in playing:
        if report.samples > 400:
            break
    before = bench.rig.volts
    assert before > 30.0
    playing.close()
    assert bench.rig.volts == pytest.approx(0.0, abs=0.02)
    assert bench.rig.extremes.largest_step < 1.5


def test_a_cut_cable_leaves_an_output_that_is_said_to_be_unknown(bench: Bench) -> None:
    bench.output.power_up()
    bench.wave.prepare(sine(), 2000.0)
    playing = bench.wave.play()
    next(playing)
    bench.front.faults.cut = 2000
    with pytest.raises(LinkLost) as caught:
        list(playing)
    assert bench.output.state is OutputState.UNKNOWN
    assert bench.output.present is None
    assert sum(c.n for c in caught.value.partial) > 0
    # no watchdog: the card holds what was written last
    assert 0.0 < bench.rig.volts < 100.0
    assert bench.rig.extremes.highest <= 100.0


def test_nothing_outside_the_envelope_reaches_the_card(bench: Bench) -> None:
    bench.output.power_up()
    count = len(bench.front.log)
    for wrong in (sine() * 1.1, sine() - 1.0, np.array([0.0, 100.0, 0.0]), sine() * np.nan):
        with pytest.raises(LimitViolation):
            bench.wave.prepare(wrong, 2000.0)
    assert len(bench.front.log) == count
