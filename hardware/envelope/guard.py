"""The only holder of a raw output: nothing reaches it that its envelope does not allow."""

from __future__ import annotations

from typing import Any, NoReturn, final

from numpy.typing import ArrayLike

from hardware.contracts import Clock, Identity, RawOutput, WallClock
from hardware.envelope.limits import Converter, Envelope
from hardware.envelope.line import OutputLine
from hardware.envelope.plain_numbers import finite_number
from hardware.envelope.proof import compare, noise_of, probe_step
from hardware.envelope.provenance import provenance
from hardware.envelope.readiness import overstay, refuse_again, require_open, require_ready
from hardware.envelope.single import check_ramp, check_set, nearest
from hardware.envelope.state import OutputState, OutputStatus
from hardware.envelope.way_down import close, park
from hardware.envelope.way_up import power_up
from hardware.errors import HardwareError, LimitViolation


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
        ``converter`` (`Converter`), ``rest`` (V after its power-up; 0) and ``cold`` (V after it
        was off and on; 0). If it walks by itself at power-up it has methods
        ``keep_within(envelope)`` and, where players share the device, ``moved(volts)``, which is
        told where it stands.
    envelope : Envelope
    clock : Clock, optional
        Time of the program; the computer's by default.
    clamp : bool
        Cut commands to the allowed voltages instead of refusing them; every cut is marked. Slew,
        current and everything else are refused all the same, and what is no number too.
    converter : Converter, optional
        What the device can produce, if it does not tell itself.
    probe : float, optional
        Step (V) by which `power_up` proves that the read-back follows; by default 2 % of the
        range, 0 for no proof.

    Raises
    ------
    UnusableInput
        If the value of the device after power-up or the safe value cannot be reached.

    Examples
    --------
    >>> with virtual_bench() as bench:
    ...     output = bench.output
    ...     _ = output.power_up()
    ...     _ = output.ramp(20.0)
    ...     print(output.present)
    20.0
    """

    __slots__ = ("_clamp", "_clamped", "_converter", "_cuts", "_line", "_probe")

    def __init__(
        self,
        raw: RawOutput,
        envelope: Envelope,
        clock: Clock | None = None,
        *,
        clamp: bool = False,
        converter: Converter | None = None,
        probe: float | None = None,
    ) -> None:
        refuse_again(self)
        own = getattr(raw, "converter", None)
        converter = own if converter is None and isinstance(own, Converter) else converter
        self._converter = converter
        line = OutputLine(raw, envelope, WallClock() if clock is None else clock, converter)
        self._probe = probe_step(line, probe, converter)
        self._line = line
        self._clamp = clamp
        self._clamped = False
        self._cuts = 0

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
            probe=self._probe,
            monitor=self._line.proof,
        )

    def power_up(self) -> None:
        """Bring the device to its safe value in its own safe order, and prove its read-back.

        A driven output is ramped down first. A read-back that contradicts the result, or does not
        follow a small step (`probe`), leaves the output unknown and not to be driven.

        Raises
        ------
        HardwareError
            Of the device; the output is then unknown. Or another command came in between.
        """
        power_up(self._line, self._probe, noise_of(self._converter))

    def set(self, volts: float) -> None:
        """Jump to a voltage (V), after the rest of the update period if there is any.

        Raises
        ------
        LimitViolation
            Outside the envelope, or the output is unknown; nothing was sent.
        HardwareError
            Of the device (the output is unknown then), or another command came in between.
        """
        self._jump(finite_number(volts, "set"), "set")

    def approach(self, volts: float) -> float:
        """Jump as far towards a voltage (V) as one update allows; return where it stands (V).

        For a feedback loop, whose controller need not know the limits. A dwell that is exceeded
        is refused as by `set`.

        Raises
        ------
        LimitViolation
            No finite number, the output is unknown, or a dwell is exceeded; nothing was sent.
        HardwareError
            Of the device (the output is unknown then), or another command came in between.
        """
        return self._jump(finite_number(volts, "loop"), "loop")

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
        number = finite_number(volts, "ramp")
        rate = None if rate is None else finite_number(rate, "ramp: rate")
        require_open(line, "ramp")
        with line.lock:
            require_ready(line, "ramp")
            target = self._cut(number)
            held = line.dwelling.held(line.clock.now())
            speed = check_ramp(
                line.envelope, line.present, target, rate, converter=self._converter, held=held
            )
            epoch = line.new_epoch()
        if not line.walk(target, speed, epoch, "ramp"):
            raise HardwareError(f"ramp({target:g}): ended on its way by another command")

    def stop(self) -> None:
        """Park: end what is playing and ramp to the safe value, from wherever the output is.

        Commands are refused until it has ended, and at its end the safe value is written whatever
        is known. An unknown output is looked for by its read-back, which is believed near the last
        command and, if proven, where a restart leaves the device. Else the last command is given
        again, the way down begins there, and `status` says so; the device is powered up anew only
        where no command is known, a watchdog may have acted, or it cannot be given. Before the
        first `power_up` and after `close` there is nothing to park. In a signal handler that has
        come while this thread talks with the device (a write, a question, a step of a waveform) it
        returns at once, and that talk parks at its end.

        Raises
        ------
        HardwareError
            If the device cannot be reached at two attempts; the output is unknown then.
        """
        line = self._line
        if line.touched and not line.released:
            park(line)

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
            if line.closed:
                raise LimitViolation("read: the output is closed; open the device anew")
            if not line.touched:
                raise LimitViolation("read: the output is not powered up; call power_up() first")
            return line.read("read")

    def compare(self, commanded: ArrayLike, read: ArrayLike, before: int = 0) -> int:
        """Hold readings against their commands; see `check_monitor`.

        Raises
        ------
        LimitViolation
            They do not belong together. After `stop` nothing is driven until `power_up`.
        """
        return compare(self._line, commanded, read, before)

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
            if line.closed or self.state is OutputState.UNKNOWN:
                return
            line.beat()
            late = line.overstayed()
        if late is not None:
            self.stop()
            raise overstay(line, *late)

    def close(self) -> None:
        """Refuse all commands, park and let go of the device, any number of times.

        Ctrl-C on the way down leaves the link open, so that `stop` or another `close` ends it.
        """
        close(self._line)

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        """Refuse copies: there is one guard to a device."""
        raise TypeError("GuardedOutput: cannot be copied or pickled; pass the object itself on")

    def __repr__(self) -> str:
        """Return device, limits and state."""
        return f"<GuardedOutput {self.identity.model}: {self.envelope.describe()}; {self.status}>"

    def _jump(self, number: float, what: str) -> float:
        """Write one voltage (V) after the rest of the update period; return it."""
        line, envelope = self._line, self._line.envelope
        require_open(line, what)
        with line.lock:
            judged = line.epoch
            require_ready(line, what)
            if what == "loop":
                target = nearest(envelope, line.present, number, self.limits)
            else:
                target = self._cut(number)
            now = line.clock.now()
            held = line.dwelling.held(now) if envelope.dwell else ()
            check_set(envelope, line.present, target, converter=self._converter, held=held)
            line.settle(judged)
            line.wait_for_turn(now)
            epoch = line.new_epoch()
            # of a signal handler: this thread has the lock
            if epoch == judged + 1 and line.write(target, what, epoch):
                line.beat()
            if line.epoch != judged + 1:
                raise HardwareError(f"{what}({target:g}): another command came in between")
            return target

    def _cut(self, number: float) -> float:
        """Return the command, cut to the limits if that was asked for."""
        low, high = self.limits
        self._clamped = self._clamp and not low <= number <= high
        if self._clamped:
            self._cuts += 1
            return min(max(number, low), high)
        return number
