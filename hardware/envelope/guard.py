"""The only holder of a raw output: nothing reaches it that its envelope does not allow."""

from __future__ import annotations

from typing import Any, final

from hardware.contracts import Clock, Identity, RawOutput, WallClock
from hardware.envelope.limits import Converter, Envelope
from hardware.envelope.line import Line
from hardware.envelope.plain_numbers import engineering, finite_number
from hardware.envelope.provenance import provenance
from hardware.envelope.single import check_ramp, check_set
from hardware.envelope.state import OutputState, OutputStatus
from hardware.errors import HardwareError, LimitViolation

__all__ = ["GuardedOutput"]


@final
class GuardedOutput:
    """A `VoltageOut`: one envelope between every command and its device.

    After `power_up` the output is parked or driven. When a transport fails nobody knows what the
    device did: the output is then unknown, `present` is None, and only `stop` and `power_up` are
    allowed. Commands may come from several threads; `stop` overrules a running ramp or waveform.

    Parameters
    ----------
    raw : RawOutput
        Handed over for good: nobody else may keep it. It may be `Fed`, and may have attributes
        ``converter`` (`Converter`) and ``rest`` (V after its power-up; 0).
    envelope : Envelope
    clock : Clock, optional
        Time of the program; the computer's by default.
    clamp : bool
        Cut commands to the allowed voltages instead of refusing them; every cut is marked. Slew,
        current and everything else are refused all the same, and what is no number too.
    converter : Converter, optional
        What the device can produce, if it does not tell itself.

    Raises
    ------
    UnusableInput
        If the value of the device after power-up or the safe value cannot be reached.
    """

    __slots__ = ("_clamp", "_clamped", "_closed", "_converter", "_cuts", "_line")

    def __init__(
        self,
        raw: RawOutput,
        envelope: Envelope,
        clock: Clock | None = None,
        *,
        clamp: bool = False,
        converter: Converter | None = None,
    ) -> None:
        own = getattr(raw, "converter", None)
        converter = own if converter is None and isinstance(own, Converter) else converter
        self._converter = converter
        self._line = Line(raw, envelope, WallClock() if clock is None else clock, converter)
        self._clamp = clamp
        self._clamped = False
        self._cuts = 0
        self._closed = False

    @property
    def identity(self) -> Identity:
        """The device."""
        return self._line.raw.identity

    @property
    def envelope(self) -> Envelope:
        """The limits."""
        return self._line.envelope

    @property
    def converter(self) -> Converter | None:
        """What the device can produce, as far as known."""
        return self._converter

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest voltage that envelope and converter allow (V)."""
        return self._line.low, self._line.high

    @property
    def present(self) -> float | None:
        """Voltage last commanded (V); None while unknown."""
        return None if self.state is OutputState.UNKNOWN else self._line.present

    @property
    def state(self) -> OutputState:
        """Parked, driven or unknown."""
        self._line.judge_silence()
        return self._line.state

    @property
    def status(self) -> OutputStatus:
        """State, reason and what follows; its text is a sentence."""
        present, line = self.present, self._line
        return OutputStatus(line.state, line.reason, present, line.raw.has_watchdog)

    @property
    def clamp(self) -> bool:
        """Whether commands are cut instead of refused."""
        return self._clamp

    @property
    def clamped(self) -> bool:
        """Whether the last command was cut."""
        return self._clamped

    def provenance(self) -> dict[str, Any]:
        """Return limits, device, state and faults as plain values, for a record."""
        return provenance(
            self.identity,
            self.envelope,
            self._converter,
            self.status,
            clamp=self._clamp,
            cuts=self._cuts,
            faults=self._line.faults,
        )

    def power_up(self) -> None:
        """Bring the device to its safe value in its own safe order.

        A driven output is ramped down first. A read-back that contradicts the result leaves the
        output unknown.

        Raises
        ------
        HardwareError
            Of the device; the output is then unknown.
        """
        self._require_open("power_up")
        if self.state is not OutputState.UNKNOWN:
            self.stop()
        line = self._line
        with line.lock:
            epoch = line.new_epoch()
            line.end_wave()
            line.power_up()
        line.walk(self.envelope.safe, self.envelope.ramp_rate, epoch, "powered up")

    def set(self, volts: float) -> None:
        """Jump to a voltage (V), after the rest of the update period if there is any.

        Raises
        ------
        LimitViolation
            Outside the envelope, or the output is unknown; nothing was sent.
        HardwareError
            Of the device; the output is unknown then.
        """
        line, envelope = self._line, self._line.envelope
        with line.lock:
            self._ready("set")
            target = self._cut(volts, "set")
            now = line.clock.now()
            held = line.dwelling.held(now) if envelope.dwell else ()
            check_set(envelope, line.present, target, converter=self._converter, held=held)
            line.settle()
            line.wait_for_turn(now)
            line.new_epoch()
            line.write(target, "set")
            line.beat()

    def ramp(self, volts: float, rate: float | None = None) -> None:
        """Go to a voltage (V) at a rate (V/s), by default the envelope's gentle one.

        Raises
        ------
        LimitViolation
            Outside the envelope, or the output is unknown; nothing was sent.
        HardwareError
            Of the device (the output is unknown then), or another command ended the ramp.
        """
        line = self._line
        with line.lock:
            self._ready("ramp")
            target = self._cut(volts, "ramp")
            held = line.dwelling.held(line.clock.now())
            speed = check_ramp(
                line.envelope, line.present, target, rate, converter=self._converter, held=held
            )
            epoch = line.new_epoch()
        if not line.walk(target, speed, epoch, "ramp"):
            raise HardwareError(f"ramp({target:g}): ended on its way by another command")

    def stop(self) -> None:
        """Park: end what is playing and ramp to the safe value, from wherever the output is.

        An unknown output is looked for by its read-back, else powered up anew. Before the first
        `power_up` and after `close` there is nothing to park.

        Raises
        ------
        HardwareError
            If the device cannot be reached at two attempts; the output is unknown then.
        """
        line = self._line
        if not line.touched or self._closed:
            return
        with line.lock:
            epoch = line.new_epoch()
            line.end_wave()
        try:
            line.park(epoch)
        except Exception as first:
            try:
                line.park(epoch)
            except Exception as second:
                first.add_note(f"a second attempt to park failed too: {second}")
                raise first from None

    def read(self) -> float | None:
        """Voltage at the actuator as the device tells (V); None where it cannot.

        Raises
        ------
        LimitViolation
            Before `power_up`.
        HardwareError
            Of the device; the output is unknown then.
        """
        line = self._line
        with line.lock:
            self._require_open("read")
            if not line.touched:
                raise LimitViolation("read: the output is not powered up; call power_up() first")
            try:
                return line.raw.read()
            except Exception as error:
                line.lose(error, "read")
                raise

    def tend(self) -> None:
        """Feed the watchdog and end what lasts too long; call it in every loop that waits.

        Raises
        ------
        LimitViolation
            A dwell was exceeded; the output has been parked.
        HardwareError
            The watchdog cannot be fed; the output is unknown then.
        """
        line = self._line
        with line.lock:
            if self._closed or self.state is OutputState.UNKNOWN:
                return
            line.beat()
            late = None if line.halt is not None else line.dwelling.exceeded(line.clock.now())
        if late is not None:
            dwell, seconds = late
            self.stop()
            raise LimitViolation(
                f"output: {engineering(seconds, 's')} beyond {dwell.level:g} V, allowed are "
                f"{engineering(dwell.seconds, 's')}; it was ramped to {self.envelope.safe:g} V"
            )

    def close(self) -> None:
        """Park and let go of the device, any number of times."""
        if self._closed:
            return
        try:
            self.stop()
        finally:
            with self._line.lock:
                self._closed = True
                self._line.raw.close()

    def __repr__(self) -> str:
        """Return device, limits and state."""
        return f"<GuardedOutput {self.identity.model}: {self.envelope.describe()}; {self.status}>"

    def _cut(self, volts: object, what: str) -> float:
        """Return the command as a number, cut to the limits if that was asked for."""
        number = finite_number(volts, what)
        low, high = self._line.low, self._line.high
        self._clamped = self._clamp and not low <= number <= high
        if self._clamped:
            self._cuts += 1
            return min(max(number, low), high)
        return number

    def _require_open(self, what: str) -> None:
        if self._closed:
            raise LimitViolation(f"{what}: the output is closed; open the device anew")

    def _ready(self, what: str) -> None:
        """Refuse a command in a state that does not allow it."""
        self._require_open(what)
        if self.state is OutputState.UNKNOWN:
            raise LimitViolation(
                f"{what}: the output is unknown ({self._line.reason}); call stop() or power_up()"
            )
        if self._line.halt is not None:
            raise LimitViolation(f"{what}: a waveform is playing; end it with stop() first")
