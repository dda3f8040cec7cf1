"""Random sequences of commands and misfortunes: nothing unsafe ever reaches the device."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from hardware.envelope import (
    Capacitance,
    Dwell,
    Envelope,
    GuardedOutput,
    GuardedWave,
    OutputState,
    parked,
)
from hardware.errors import HardwareError, LimitViolation
from tests.hardware.envelope.device import (
    Device,
    FedDevice,
    Interrupts,
    RawDevice,
    RawPlayer,
    TellingPlayer,
    TrueTime,
    unsafe,
)

ENVELOPES = (
    Envelope(-20.0, 100.0, 1e5, i_max=0.2, capacitance=1.875e-6, gentle=5e3, update_period=2e-4),
    Envelope(0.0, 100.0, 2e4, gentle=2e4, update_period=1e-3, dwell=[Dwell(80.0, 0.05)]),
    Envelope(
        -30.0,
        120.0,
        5e4,
        i_max=0.05,
        capacitance=Capacitance((-30.0, 40.0, 50.0, 120.0), (1e-6, 1.2e-6, 3e-6, 2e-6)),
        f_max=50.0,
        f_share=0.02,
        gentle=1e4,
        safe=10.0,
        dwell=[Dwell(90.0, 0.02), Dwell(-20.0, 0.01)],
        update_period=5e-4,
    ),
)
VOLTS = st.one_of(
    st.floats(-40.0, 140.0),
    st.sampled_from(
        [
            math.nan,
            math.inf,
            -math.inf,
            1e308,
            0.0,
            100.0,
            -20.0,
            "50",
            None,
            True,
            1j,
            np.float32(7),
        ]
    ),
)


class Bench(RuleBasedStateMachine):
    """A guarded device, its waveforms, and everything that goes wrong."""

    @initialize(
        envelope=st.sampled_from(ENVELOPES),
        can_read=st.booleans(),
        watchdog=st.sampled_from([0.0, 0.0, 0.3]),
        tells=st.booleans(),
        clamp=st.booleans(),
        powered=st.sampled_from([True, True, True, False]),
    )
    def begin(
        self,
        envelope: Envelope,
        can_read: bool,
        watchdog: float,
        tells: bool,
        clamp: bool,
        powered: bool,
    ) -> None:
        self.interrupts = Interrupts()
        self.clock = TrueTime(self.interrupts)
        self.device = Device(self.clock, watchdog)
        raw = (FedDevice if watchdog else RawDevice)(self.device, can_read)
        self.player = (TellingPlayer if tells else RawPlayer)(self.device)
        self.envelope = envelope
        self.output = GuardedOutput(raw, envelope, self.clock, clamp=clamp)
        self.wave = GuardedWave(self.output, self.player)
        if powered:
            self.output.power_up()

    def attempt(self, command: Callable[[], object], protect: bool = False) -> None:
        """Run a command as a program would; after Ctrl-C it parks, as `parked` does."""
        present, writes = self.output.present, len(self.device.steps)
        try:
            if protect:
                with parked(self.output):
                    command()
            else:
                command()
        except LimitViolation:
            if not protect and self.output.present is not None and len(self.device.steps) == writes:
                assert self.output.present == present
        except HardwareError:
            assert self.output.state in (OutputState.UNKNOWN, OutputState.PARKED)
        except KeyboardInterrupt:
            self.rescue()
        if protect and self.output.state is OutputState.DRIVEN:
            raise AssertionError("left the block without being parked")
        self.interrupts.left = None

    def rescue(self) -> None:
        """Park after Ctrl-C."""
        try:
            self.output.stop()
        except HardwareError:
            assert self.output.state is OutputState.UNKNOWN
        else:
            assert self.output.state is not OutputState.DRIVEN

    @rule(protect=st.booleans())
    def power_up(self, protect: bool) -> None:
        self.attempt(self.output.power_up, protect)

    @rule(volts=VOLTS, protect=st.booleans())
    def set(self, volts: float, protect: bool) -> None:
        self.attempt(lambda: self.output.set(volts), protect)

    @rule(step=st.floats(-20.0, 20.0))
    def small_step(self, step: float) -> None:
        self.attempt(lambda: self.output.set((self.output.present or 0.0) + step))

    @rule(step=st.sampled_from([-19.0, -12.0, 15.0]), place=st.integers(0, 6), again=st.booleans())
    def interrupted_step(self, step: float, place: int, again: bool) -> None:
        self.attempt(lambda: self.output.ramp(70.0))
        self.interrupts.left = place
        try:
            self.output.set((self.output.present or 0.0) + step)
            self.output.set((self.output.present or 0.0) + step)
        except HardwareError:
            pass
        except KeyboardInterrupt:
            if again:
                self.interrupts.left = place
                self.attempt(self.output.stop)
            self.rescue()
        self.interrupts.left = None

    @rule(
        volts=VOLTS,
        rate=st.one_of(st.none(), st.sampled_from([math.nan, -1.0, 0.0, 1e9, 3e3, 1e4])),
        protect=st.booleans(),
    )
    def ramp(self, volts: float, rate: float | None, protect: bool) -> None:
        self.attempt(lambda: self.output.ramp(volts, rate), protect)

    @rule(
        middle=st.sampled_from([0.0, 30.0, 45.0, 60.0]),
        amplitude=st.sampled_from([0.0, 5.0, 20.0, 40.0]),
        frequency=st.sampled_from([2.0, 20.0, 60.0, 500.0]),
        rate=st.sampled_from([500.0, 2e3, 1e4]),
        spoil=st.sampled_from([None] * 9 + [math.nan, 150.0, -math.inf]),
        end=st.sampled_from(
            ["whole", "close", "throw", "leave", "stop", "abort", "set", "prepare"]
        ),
        fresh=st.booleans(),
        protect=st.booleans(),
    )
    def play(
        self,
        middle: float,
        amplitude: float,
        frequency: float,
        rate: float,
        spoil: float | None,
        end: str,
        fresh: bool,
        protect: bool,
    ) -> None:
        time = np.arange(int(0.06 * rate)) / rate
        volts = middle + amplitude * np.sin(2.0 * np.pi * frequency * time)
        if spoil is not None:
            volts[volts.size // 2] = spoil

        def command() -> None:
            if fresh:
                self.output.ramp(middle)
            self.wave.prepare(volts, rate)
            volts[:] = math.nan
            playing = self.wave.play()
            for written in playing:
                if end == "whole" or written.samples == written.total:
                    continue
                if end == "close":
                    playing.close()
                elif end == "throw":
                    playing.throw(RuntimeError("consumer"))
                elif end == "leave":
                    break
                elif end == "stop":
                    self.output.stop()
                elif end == "abort":
                    self.wave.abort()
                elif end == "prepare":
                    with pytest.raises(LimitViolation, match="a waveform is playing"):
                        self.wave.prepare(np.full(9, middle), rate)
                else:
                    self.output.set(middle)
            if end == "leave":
                self.output.stop()

        try:
            self.attempt(command, protect)
        except RuntimeError:
            assert self.output.state is not OutputState.DRIVEN

    @rule(protect=st.booleans())
    def stop(self, protect: bool) -> None:
        self.attempt(self.output.stop, protect)

    @rule(
        outer=st.sampled_from(["stop", "stop", "stop", "set", "ramp", "play", "power_up"]),
        inner=st.sampled_from(["set", "ramp", "stop", "stop", "prepare", "abort", "power_up"]),
        volts=st.sampled_from([5.0, 40.0, 70.0]),
        after=st.integers(0, 12),
        high=st.booleans(),
    )
    def meanwhile(self, outer: str, inner: str, volts: float, after: int, high: bool) -> None:
        """Give a command while another one is on its way."""
        self.attempt(lambda: self.output.ramp(70.0 if high else 20.0))
        wave = np.full(50, self.output.present or 0.0)
        self.attempt(lambda: self.wave.prepare(wave, 1e3))
        commands: dict[str, Callable[[], object]] = {
            "set": lambda: self.output.set(volts),
            "ramp": lambda: self.output.ramp(volts),
            "stop": self.output.stop,
            "power_up": self.output.power_up,
            "play": lambda: list(self.wave.play()),
            "prepare": lambda: self.wave.prepare(np.full(9, volts), 1e3),
            "abort": self.wave.abort,
        }

        def visit() -> None:
            with suppress(HardwareError):
                commands[inner]()
            if outer == "stop" and self.player.running:
                raise AssertionError("a waveform began on the way down")

        self.clock.visits = [_nothing] * after + [visit]
        try:
            commands[outer]()
        except HardwareError:
            pass
        except KeyboardInterrupt:
            self.rescue()
        else:
            if outer == "stop":
                assert self.output.state is not OutputState.DRIVEN
        self.clock.visits = []
        self.interrupts.left = None

    @rule(seconds=st.sampled_from([1e-4, 0.01, 0.1, 0.5]))
    def rest(self, seconds: float) -> None:
        self.attempt(lambda: self.clock.sleep(seconds))
        self.attempt(self.output.tend)

    @rule(count=st.integers(0, 60))
    def cut_link_after(self, count: int) -> None:
        self.device.budget = count

    @rule(count=st.integers(0, 400))
    def cut_link_later(self, count: int) -> None:
        self.device.budget = 20 * count

    @rule(count=st.integers(0, 40))
    def interrupt_after(self, count: int) -> None:
        self.interrupts.left = count

    @rule()
    def power_cycle(self) -> None:
        self.device.power_cycle()

    @rule(there=st.booleans())
    def reach(self, there: bool) -> None:
        self.device.reachable = there

    @rule(seconds=st.sampled_from([-3600.0, -1.0, -1e-4, 1e-4, 1.0, 3600.0]))
    def set_clock(self, seconds: float) -> None:
        self.clock.jump += seconds

    @invariant()
    def nothing_unsafe_arrived(self) -> None:
        if not hasattr(self, "device"):
            return
        e = self.envelope
        # capacitance is judged exactly elsewhere; its smallest value bounds every step here
        largest = e.slew * e.update_period
        if e.curve is not None and e.i_max is not None:
            largest = min(largest, e.i_max / min(e.curve.farads) * e.update_period)
        assert unsafe(self.device, min(e.v_min, 0.0), e.v_max, largest) == []
        self.device.steps.clear()

    @invariant()
    def what_is_known_is_true(self) -> None:
        if not hasattr(self, "device") or self.device.unnoticed:
            return
        present = self.output.present
        if present is None:
            assert self.output.state is OutputState.UNKNOWN
            assert "unknown" in str(self.output.status)
        else:
            assert self.device.volts == pytest.approx(present, abs=1e-6)
        if self.output.state is OutputState.PARKED:
            assert present == self.envelope.safe

    def teardown(self) -> None:
        if hasattr(self, "output"):
            self.interrupts.left = None
            self.attempt(self.output.close)
            self.nothing_unsafe_arrived()


def _nothing() -> None:
    """Visit without doing anything."""


def run(examples: int) -> None:
    run_state_machine_as_test(
        Bench,
        settings=settings(
            max_examples=examples,
            stateful_step_count=20,
            deadline=None,
            derandomize=True,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )


def test_nothing_unsafe_in_random_sequences() -> None:
    run(150)


@pytest.mark.long
def test_nothing_unsafe_in_ten_thousand_random_sequences() -> None:
    run(10_000)
