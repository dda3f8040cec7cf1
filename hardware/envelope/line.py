"""The wire behind the guard: the only code that writes to a raw output, and what is known of it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar, final

from bondgraph.signals.quantity import engineering
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Clock, RawOutput
from hardware.envelope.dwelling import Dwelling
from hardware.envelope.limits import PLAUSIBLE, Converter, Dwell, Envelope
from hardware.envelope.state import OutputState
from hardware.envelope.steps import in_steps
from hardware.envelope.watchdog import Heartbeat
from hardware.errors import HardwareError, LimitViolation, ProtocolFault

T = TypeVar("T")
TICK = 2e-3
"""Longest time between two steps of a ramp (s)."""


@final
class OutputLine:
    """A raw output together with all that is known about its voltage.

    Its methods expect commands that were judged before; only `write` has a gate of its own, as
    the last barrier. Callers hold `lock`, except around `walk`, which takes it for each step so
    that a stop from another thread comes in between. `span` holds the voltages between which it
    must be by what was commanded, None if that says nothing.

    Parameters
    ----------
    raw : RawOutput
    envelope : Envelope
    clock : Clock
    converter : Converter or None
    """

    def __init__(
        self, raw: RawOutput, envelope: Envelope, clock: Clock, converter: Converter | None
    ) -> None:
        self.raw = raw
        self.envelope = envelope
        self.clock = clock
        self.rest = float(getattr(raw, "rest", 0.0))
        self.cold = float(getattr(raw, "cold", 0.0))
        self.plausible = PLAUSIBLE * (envelope.v_max - envelope.v_min)
        self.low, self.high = envelope.v_min, envelope.v_max
        if converter is not None:
            self.low, self.high = max(self.low, converter.v_min), min(self.high, converter.v_max)
        for what, volts in (("power-up leaves", self.rest), ("parking needs", envelope.safe)):
            if not self.low <= volts <= self.high:
                raise UnusableInput(
                    f"guard: {what} {volts:g} V, which lies outside {self.low:g} .. {self.high:g} "
                    "V; widen the envelope or use another output"
                )
        # what walks by itself at power-up has to know its limits before
        if (keep := getattr(raw, "keep_within", None)) is not None:
            keep(envelope)
        # and where a player has left it
        self.moved: Callable[[float], None] | None = getattr(raw, "moved", None)
        self.lock = threading.RLock()
        self.epoch = 0
        self.parkers: set[object] = set()
        self.inside: set[int] = set()
        self.deferred: dict[int, Callable[[OutputLine], None]] = {}
        self.charge: int | None = None
        self.parks = 0
        self.closed = False
        self.released = False
        self.touched = False
        self.cleared = False
        self.proven = False
        self.proof = "not proven: not powered up"
        self.doubt = ""
        self.hindrance = ""
        self.span: tuple[float, float] | None = None
        self.restarted = False
        self.loaded: object = None
        self.state = OutputState.UNKNOWN
        self.reason = "not powered up"
        self.present = envelope.safe
        self.interrupted = False
        self.last: float | None = None
        self.dwelling = Dwelling(envelope)
        self.heart = Heartbeat(raw)
        self.halt: Callable[[], tuple[float, float] | None] | None = None
        self.standing: Callable[[float], tuple[float, float] | None] | None = None
        self.faults: list[str] = []

    def new_epoch(self) -> int:
        """Begin a command that overrules those before; return its number."""
        self.epoch += 1
        return self.epoch

    def take_charge(self) -> int:
        """Begin the way down: end what plays, overrule everybody; return the number."""
        with self.lock:
            self.new_epoch()
            self.end_wave()
            # behind a stop that was put off until then
            epoch = self.charge = self.new_epoch()
            return epoch

    def clear(self, *, proven: bool, proof: str) -> None:
        """Allow commands after a power-up."""
        self.cleared, self.proven, self.proof = True, proven, proof
        self.doubt = self.hindrance = ""

    def revoke(self, why: str) -> None:
        """Allow no commands until a power-up has ended in order."""
        self.cleared = self.proven = False
        self.proof = "not proven: " + why
        self.hindrance = why

    def forget(self, reason: str) -> None:
        """Declare the voltage unknown."""
        self.forget_quietly(reason)
        self.faults.append(reason)

    def lose(self, error: BaseException, what: str) -> None:
        """Declare the voltage unknown after an error of the device."""
        # a device that fails so may have been off and on again
        self.restarted = isinstance(error, HardwareError)
        self.forget(f"{what} at {self.present:g} V failed: {type(error).__name__}: {error}")

    def judge_silence(self) -> None:
        """Declare the voltage unknown if the device's watchdog must have acted."""
        if self.heart.timeout is None or self.state is OutputState.UNKNOWN:
            return
        # at rest nothing changes when the watchdog acts
        if self.present == self.rest:
            return
        if self.heart.bitten(self.clock.now()):
            self.restarted = True
            self.forget(
                f"silent for more than the {engineering(self.heart.timeout, 's')} of its watchdog"
            )

    def may_rest(self) -> bool:
        """Whether a watchdog may have parked the device behind the program's back."""
        fed = self.heart.timeout is not None
        return self.heart.bitten(self.clock.now()) if fed else self.raw.has_watchdog

    def write(self, volts: float, what: str, epoch: int) -> bool:
        """Send one voltage (V) unless a command after that of `epoch` has overruled it.

        Returns
        -------
        bool
            False if it is overruled: nothing was sent, or the other one came within it.

        Raises
        ------
        LimitViolation
            The last barrier: not within the limits, NaN, or the device is closed.
        """
        if epoch != self.epoch:
            return False
        if self.released:
            raise LimitViolation(f"{what}: the output is closed; open the device anew")
        if not self.low - self.envelope.slack <= volts <= self.high + self.envelope.slack:
            raise LimitViolation(
                f"{what}: {volts!r} V lies outside {self.low:g} .. {self.high:g} V; not sent"
            )
        self.whole(lambda: self._send(min(max(volts, self.low), self.high), what, epoch))
        return epoch == self.epoch

    def _send(self, volts: float, what: str, epoch: int) -> None:
        # once more: a signal handler may have come on the way here
        if epoch != self.epoch:
            return
        before = self.present, self.span, self.state, self.interrupted
        around = (*(self.span or (self.present,)), volts)
        try:
            # first: wherever Ctrl-C comes in, the device has this voltage or the one before
            self.interrupted = True
            self.span = min(around), max(around)
            self.present = volts
            self.state = OutputState.DRIVEN
            self.raw.write(volts)
            self.reached(volts, what)
            self.interrupted = False
        except LimitViolation as error:
            # the device's own refusal: nothing was sent, unless it tells where it went instead
            self.present, self.span, self.state, self.interrupted = before
            if isinstance(error.partial, float):
                self.reached(error.partial, what)
            raise
        except Exception as error:
            self.present, _, self.state, self.interrupted = before
            self.span = min(around), max(around)
            self.lose(error, what)
            raise
        except BaseException:
            self.reached(volts, what)
            self.span = min(around), max(around)
            raise

    def whole(self, action: Callable[[], T]) -> T:
        """Do something at the device that nothing of the same thread may come in between.

        A signal handler runs within whatever it interrupts, which would go on behind it and undo
        it. So `defer` keeps what it asks for until the action is over.
        """
        me = threading.get_ident()
        outer = me not in self.inside
        error: BaseException | None = None
        try:
            self.inside.add(me)
            return action()
        except BaseException as caught:
            error = caught
            raise
        finally:
            if outer:
                self.inside.discard(me)
                self._do_deferred(me, error)

    def defer(self, action: Callable[[OutputLine], None]) -> bool:
        """Keep an action for the end of what this thread is doing; False if it does nothing."""
        me = threading.get_ident()
        if me not in self.inside:
            return False
        self.deferred[me] = action
        return True

    def _do_deferred(self, me: int, error: BaseException | None) -> None:
        if (action := self.deferred.pop(me, None)) is None:
            return
        try:
            action(self)
        except Exception as second:
            if error is None:
                raise
            error.add_note(f"stop() within it failed too: {second}")

    def reached(self, volts: float, what: str) -> None:
        """Note that the output stands at a voltage (V) from now on."""
        now = self.clock.now()
        self.present = volts
        self.span = volts, volts
        if self.moved is not None:
            self.moved(volts)
        self.restarted = False
        self.last = now
        self.dwelling.moved(volts, now)
        parked = volts == self.envelope.safe
        self.state = OutputState.PARKED if parked else OutputState.DRIVEN
        self.reason = what

    def settle(self, epoch: int) -> None:
        """Send the last voltage again if an interrupt left open whether it had arrived."""
        if self.interrupted:
            self.write(self.present, "repeat", epoch)
            self.clock.sleep(self.envelope.update_period)

    def wait_for_turn(self, now: float) -> None:
        """Wait for the rest of the update period, from `now` (s) on.

        Raises
        ------
        LimitViolation
            The clock does not pass.
        """
        period = self.envelope.update_period
        if self.last is None or now - self.last >= period:
            return
        # a clock that was set back must not make anybody wait for more than one period
        self.clock.sleep(min(period - (now - self.last), period))
        passed = self.clock.now() - max(self.last, now - period)
        if 0.0 <= passed < period * (1.0 - 1e-6):
            raise LimitViolation(
                f"set: {engineering(passed, 's')} after the command before, allowed is "
                f"{engineering(period, 's')}; the clock stands still, check it"
            )

    def overstayed(self) -> tuple[Dwell, float] | None:
        """Return the first dwell that has lasted too long, and how long (s).

        A waveform was judged as a whole; of it only a stall can be too long.
        """
        if not self.envelope.dwell:
            return None
        now = self.clock.now()
        if self.halt is None:
            return self.dwelling.exceeded(now)
        standing = None if self.standing is None else self.standing(now)
        return None if standing is None else self.dwelling.stalled(*standing)

    def beat(self) -> None:
        """Feed the watchdog if it is due."""
        if self.heart.timeout is None:
            return
        self.asked(lambda: self.heart.beat(self.clock.now()), "feeding the watchdog")

    def walk(
        self, target: float, speed: float, epoch: int, what: str, *, always: bool = False
    ) -> bool:
        """Go to a voltage (V) at a speed (V/s) in small steps; False if overruled on the way.

        With `always` it is written even where the output is taken to stand there.
        """
        with self.lock:
            self.settle(epoch)
            if epoch != self.epoch:
                return False
            start = self.present
        if start == target and not always:
            return True
        e = self.envelope
        pause, steps = in_steps(
            start, target, speed, e.ramp_step(start, target), TICK, e.update_period
        )
        for volts in steps:
            self.clock.sleep(pause)
            with self.lock:
                if self.write(volts, what, epoch):
                    self.beat()
                if epoch != self.epoch:
                    return False
        return True

    def power_up(self, epoch: int) -> None:
        """Let the device come up and compare what it tells with where it should be.

        Nothing happens if a command after that of `epoch` has overruled it.
        """
        self.whole(lambda: self._come_up(epoch))

    def _come_up(self, epoch: int) -> None:
        if epoch != self.epoch:
            return
        self.touched = True
        self.forget_quietly("power-up did not end")
        self.span = None
        try:
            self.raw.power_up()
            reading = self.raw.read()
            self.heart.reset(self.clock.now())
        except Exception as error:
            self.lose(error, "power-up")
            raise
        if reading is not None and not abs(reading - self.rest) <= self.plausible:
            self.forget(f"after power-up it reads {reading:g} V instead of {self.rest:g} V")
            raise ProtocolFault(
                f"power_up: the device reads {reading:g} V instead of {self.rest:g} V; check gain, "
                "offset and the wire of the monitor before anything else"
            )
        self.interrupted = False
        self.reached(self.rest, "powered up")

    def forget_quietly(self, reason: str) -> None:
        """Declare the voltage unknown without counting a fault."""
        self.loaded = None
        self.state = OutputState.UNKNOWN
        self.reason = reason

    def end_wave(self) -> None:
        """Stop the waveform that plays, if one does."""
        self.whole(self._end_wave)

    def _end_wave(self) -> None:
        if self.halt is None:
            return
        around = self.halt()
        # an interrupted one is ended again by the next who comes
        self.halt = None
        self.span = None if around is None else (min(around), max(around))
        if self.state is OutputState.UNKNOWN:
            return
        if around is None:
            self.forget_quietly("a waveform was ended and the device cannot tell where")
        else:
            self.reached(around[0], "waveform ended early")
            self.span = min(around), max(around)

    def read(self, what: str) -> float | None:
        """Return what the device tells (V)."""
        with self.lock:
            return self.asked(self.raw.read, what)

    def asked(self, question: Callable[[], T], what: str) -> T:
        """Talk with the device, whole; where that fails the voltage is unknown."""

        def told() -> T:
            try:
                return question()
            except Exception as error:
                self.lose(error, what)
                raise

        return self.whole(told)

    def release(self) -> None:
        """Let go of the device, once."""
        with self.lock:
            if not self.released:
                self.released = True
                self.raw.close()
