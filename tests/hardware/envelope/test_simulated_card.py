"""The same guard in front of the simulated card: what the actuator itself has met."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.contracts import WaveProgress
from hardware.devices.amplifier import Amplifier, AnalogueAmplifier, Monitors
from hardware.devices.daq import CardChannel, CardInputs, CardWiring, SoftwareTimedWave
from hardware.envelope import P840_1_UNIPOLAR, GuardedOutput, GuardedWave, OutputState, parked
from hardware.errors import HardwareError, TimedOut
from hardware.simulators.registers import CardFront, Wires
from hardware.simulators.rig import Rig
from tests.hardware.devices.daq.bench import Capacitor, RigClock, card_on

STACK = Amplifier(gain=20.0, lowest=0.0, highest=100.0, monitors=Monitors(voltage=0.05))
STEP = 20.0 * 20.0 / 2**14
"""One step of the converter at the actuator (V)."""

COMMANDS = st.lists(
    st.tuples(
        st.sampled_from(["set", "ramp", "wave", "break", "gone", "back", "stop", "tend"]),
        st.one_of(st.floats(-20.0, 130.0), st.sampled_from([math.nan, math.inf])),
    ),
    max_size=8,
)


@settings(max_examples=25, deadline=None, derandomize=True, database=None)
@given(commands=COMMANDS, monitored=st.booleans())
def test_the_actuator_on_the_rig_never_meets_anything_unsafe(
    commands: list[tuple[str, float]], monitored: bool
) -> None:
    rig = Rig(Capacitor())
    front = CardFront(rig, wires=Wires(noise=0.0))
    card, clock = card_on(front, rig), RigClock(rig)
    inputs = CardInputs(card, (0,)) if monitored else None
    raw = AnalogueAmplifier(CardChannel(card), STACK, inputs, clock=clock)
    output = GuardedOutput(raw, P840_1_UNIPOLAR, clock)
    wave = GuardedWave(output, SoftwareTimedWave(card, STACK, CardWiring()))
    output.power_up()

    def play(volts: float, early: bool) -> None:
        time = np.arange(200) / 2e3
        output.ramp(0.0)
        shape = 0.5 - 0.5 * np.cos(2.0 * np.pi * 20.0 * time)
        wave.prepare(np.nan_to_num(volts, posinf=1e6) * shape, 2e3)
        for written in wave.play():
            if early and written.samples > 50:
                raise ZeroDivisionError

    for name, volts in commands:
        try:
            if name == "set":
                output.set(volts)
            elif name == "ramp":
                output.ramp(volts, 5e3)
            elif name in ("wave", "break"):
                with parked(output):
                    play(volts, name == "break")
            elif name == "stop":
                output.stop()
            elif name == "tend":
                output.tend()
            else:
                front.faults.gone = name == "gone"
        except (HardwareError, ZeroDivisionError):
            pass
        present = output.present
        if present is None:
            assert "unknown" in str(output.status)
        elif not front.faults.gone:
            assert abs(rig.volts - present) <= STEP
    worst = rig.extremes
    assert worst.lowest >= -STEP
    assert worst.highest <= 100.0 + STEP
    front.faults.gone = False
    output.close()
    assert output.state in (OutputState.PARKED, OutputState.UNKNOWN)
    if not any(name == "gone" for name, _ in commands):
        assert worst.largest_step <= P840_1_UNIPOLAR.largest_step(0.0, 100.0) + STEP


class Untold:
    """A player that does not tell how far it came."""

    def __init__(self, inner: SoftwareTimedWave) -> None:
        self.load, self.abort, self._inner = inner.load, inner.abort, inner

    def play(self) -> Iterator[WaveProgress]:
        return self._inner.play()


@pytest.mark.parametrize("tells", [True, False])
def test_a_waveform_that_fails_without_a_voltage_monitor_is_walked_down(tells: bool) -> None:
    rig = Rig(Capacitor())
    front = CardFront(rig, wires=Wires(noise=0.0))
    card, clock = card_on(front, rig), RigClock(rig)
    amplifier = Amplifier(gain=20.0, monitors=Monitors(current=50.0))
    raw = AnalogueAmplifier(CardChannel(card), amplifier, CardInputs(card, (1,)), clock=clock)
    output = GuardedOutput(raw, P840_1_UNIPOLAR, clock)
    player = SoftwareTimedWave(card, amplifier, CardWiring(monitors=(1,)))
    wave = GuardedWave(output, player if tells else Untold(player))
    output.power_up()
    wave.prepare(np.linspace(0.0, 80.0, 4000), 2e3)

    def play() -> None:
        for written in wave.play():
            front.faults.endless = written.samples >= 3800

    with pytest.raises(TimedOut):
        play()
    assert rig.extremes.highest > 75.0
    assert output.state is OutputState.PARKED
    assert rig.volts == 0.0
    assert rig.extremes.largest_step < 3.0
