"""A digital piezo controller that speaks GCS 2, as a raw output and with its own sensor.

Commands, answers and numbers are those of public documents for the E-712 and E-727 and of PIPython;
none of it was tried on a device here. Start with the actuator unplugged: compare ``VOL?`` with what
was set, then look at the trigger output and at one recording.
"""

from __future__ import annotations

import math
from typing import final

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Clock, Identity, WallClock
from hardware.devices.controllers.gcs_errors import UNKNOWN, forgiven
from hardware.devices.controllers.gcs_setup import GcsSetup
from hardware.devices.controllers.gcs_talk import GcsTalk
from hardware.devices.walking import WalkToRest, walk
from hardware.envelope.limits import Envelope
from hardware.errors import HardwareError, LimitViolation, LinkLost, ProtocolFault, TimedOut

_STOPPED = 10
_SERVO_TIME = 0x0E000200
_TELLING = 2.0
"""Difference of a voltage from where it should be that tells (V); a tenth of large ones."""


def differ(measured: float, expected: float) -> bool:
    """Whether a voltage is not the one that it should be (V)."""
    return abs(measured - expected) > max(_TELLING, 0.1 * abs(measured))


@final
class GcsController:
    """One axis of a GCS controller.

    As a `RawOutput` it checks nothing but that a voltage is a number; only a guard may hold it.

    Parameters
    ----------
    talk : GcsTalk
        The conversation, over TCP, a serial line or a gateway of PIPython.
    setup : GcsSetup, optional
        Axis, scale and safe value.
    clock : Clock, optional
        Time of the program.
    """

    def __init__(
        self, talk: GcsTalk, setup: GcsSetup | None = None, clock: Clock | None = None
    ) -> None:
        self.talk = talk
        self.setup = GcsSetup() if setup is None else setup
        self.clock: Clock = WallClock() if clock is None else clock
        self._identity: Identity | None = None
        self._way = WalkToRest(self.setup.gentle)

    @property
    def identity(self) -> Identity:
        """The device as it answers to ``*IDN?``."""
        if self._identity is None:
            self.open()
        return self._identity or Identity()

    @property
    def has_watchdog(self) -> bool:
        """Whether the setup says so."""
        return self.setup.watchdog

    @property
    def rest(self) -> float:
        """Where it stands after a power-up (V), for the guard."""
        return self.setup.safe

    def open(self) -> None:
        """Connect and identify."""
        answer = self.talk.open()
        # the maker's name may hold commas; the last three do not
        parts = [p.strip() for p in answer.rsplit(",", 3)]
        self._identity = Identity(*parts) if len(parts) == 4 else Identity(model=answer)

    def keep_within(self, envelope: Envelope) -> None:
        """Take the limits of the guard for the way to safe at power-up."""
        self._way = WalkToRest.within(envelope, self.setup.gentle)

    def power_up(self) -> None:
        """Connect where the link is not alive, stop the generator, open the loop, walk to safe.

        Raises
        ------
        ProtocolFault
            If control value and voltage of the device contradict the setup, or tell a voltage
            that is not allowed; nothing was put out.
        """
        self._revive()
        self.stop_wave()
        self.servo(False)
        # of two that agree the control value: steps are those between control values
        stands = self._checked()
        self._way.require(stands, f"{self.talk.address}: stands at")
        walk(self.write, stands, self.setup.safe, self._way, self.clock)

    def write(self, volts: float) -> None:
        """Set the open-loop voltage (V)."""
        self.talk.send(f"SVA {self.setup.axis} {self.control_value(volts):.6f}")

    def read(self) -> float | None:
        """Voltage of the output channel (V); of the control value where there is no ``VOL?``."""
        volts = self.measured()
        return self._expected() if volts is None else volts

    def measured(self) -> float | None:
        """Voltage of the output channel (V); None where there is no ``VOL?``."""
        return forgiven(UNKNOWN, lambda: self._number("VOL?", self.setup.channel))

    def close(self) -> None:
        """Hang up; the output keeps its voltage. Never raises and never hangs."""
        self._identity = None
        self.talk.close()

    def control_value(self, volts: float) -> float:
        """Return the open-loop control value of a voltage (V)."""
        if not math.isfinite(volts):
            raise LimitViolation(f"{self.talk.address}: {volts} V is no voltage; nothing was sent")
        return (volts - self.setup.offset) / self.setup.scale

    def limits(self) -> tuple[float, float]:
        """Return the voltage limits set in the device (V)."""
        low = self._number("VMI?", self.setup.channel)
        return low, self._number("VMA?", self.setup.channel)

    def stage(self) -> str:
        """Return the name of the stage that the controller is set up for."""
        return self._item("CST?", self.setup.axis)

    def travel(self) -> tuple[float, float]:
        """Return the ends of the closed-loop range (m)."""
        low = self._number("TMN?", self.setup.axis)
        return 1e-6 * low, 1e-6 * self._number("TMX?", self.setup.axis)

    def position(self) -> float:
        """Return the position by the device's own sensor (m)."""
        return 1e-6 * self._number("POS?", self.setup.axis)

    def servo(self, on: bool) -> None:
        """Close or open the loop; the controller keeps the output where it is."""
        self.talk.send(f"SVO {self.setup.axis} {int(on)}")

    def move(self, position: float) -> None:
        """Go to a position (m) by the device's own servo, which has to be on."""
        if not math.isfinite(position):
            raise LimitViolation(f"{self.talk.address}: {position} m is no position")
        self.talk.send(f"MOV {self.setup.axis} {1e6 * position:.6f}")

    def on_target(self) -> bool:
        """Whether the servo is there."""
        return self._number("ONT?", self.setup.axis) != 0.0

    def settle(self, timeout: float, period: float = 0.005) -> None:
        """Wait until the servo is on target.

        Parameters
        ----------
        timeout : float
            Longest wait (s, time of the program).
        period : float
            Time between questions (s).
        """
        deadline = self.clock.now() + timeout
        while not self.on_target():
            if self.clock.now() >= deadline:
                raise TimedOut(
                    f"{self.talk.address}: axis {self.setup.axis} not on target within "
                    f"{timeout:g} s; at {1e6 * self.position():.4g} um"
                )
            self.clock.sleep(period)

    def halt(self) -> None:
        """Stop smoothly whatever moves the axis; the voltage stays where it is."""
        forgiven(_STOPPED, lambda: self.talk.send(f"HLT {self.setup.axis}"))

    def stop(self) -> None:
        """Stop everything at once, generator and servo included; the voltage stays."""
        self.talk.code(24, answered=False)
        number = int(self.talk.ask("ERR?") or 0)
        if number not in (0, _STOPPED):
            raise ProtocolFault(f"{self.talk.address}: GCS error {number} after a stop", number)

    def stop_wave(self) -> None:
        """Stop the wave generator if there is one."""
        forgiven(UNKNOWN, lambda: self.talk.send(f"WGO {self.setup.generator} 0"))

    def wave_runs(self) -> bool:
        """Whether the wave generator runs."""
        text = self.talk.code(9)
        try:
            return bool(int(text, 16) & (1 << (self.setup.generator - 1)))
        except ValueError:
            raise self._nonsense("#9", text) from None

    def servo_rate(self) -> float:
        """Return the rate of servo, wave generator and recorder (Hz)."""
        period = self.setup.servo_time or self.parameter("1", _SERVO_TIME)
        if not period > 0.0:
            raise ProtocolFault(f"{self.talk.address}: a servo period of {period:g} s", period)
        return 1.0 / period

    def divider(self, rate: float, what: str) -> int:
        """Return the whole number by which the servo rate has to be divided.

        Raises
        ------
        UnusableInput
            If there is none for this rate (Hz); the nearest rate is named.
        """
        servo = self.servo_rate()
        number = max(round(servo / rate), 1) if rate > 0.0 else 1
        if not rate > 0.0 or abs(servo / number - rate) > 1e-6 * rate:
            raise UnusableInput(
                f"{self.talk.address}: cannot {what} at {rate:g} Hz, only at {servo:g} Hz by a "
                f"whole number; nearest {servo / number:.9g} Hz"
            )
        return number

    def parameter(self, item: str, number: int) -> float:
        """Return a parameter of the device from its volatile memory."""
        return self._value(f"SPA? {item} 0x{number:X}", self.talk.ask(f"SPA? {item} 0x{number:X}"))

    def integer(self, query: str) -> int:
        """Return the integer answered to a question, behind its equals sign if it has one."""
        return int(self._value(query, self.talk.ask(query)))

    def _revive(self) -> None:
        """Open the link unless it answers."""
        if self._identity is not None:
            try:
                self.talk.ask("*IDN?")
                return
            except (LinkLost, TimedOut):
                self.talk.close()
        self.open()

    def _checked(self) -> float:
        """Voltage by ``SVA?`` (V), compared with ``VOL?``; near zero nothing can be told."""
        measured, expected = self.measured(), self._expected()
        if measured is not None and differ(measured, expected):
            raise ProtocolFault(
                f"{self.talk.address}: by its control value it should be at {expected:g} V, but "
                f"VOL? says {measured:g} V; nothing was put out, correct scale, offset or channel "
                "of the setup",
                measured,
            )
        return expected

    def _expected(self) -> float:
        """Voltage (V) that belongs to the present control value."""
        return self.setup.offset + self.setup.scale * self._number("SVA?", self.setup.axis)

    def _number(self, query: str, item: str) -> float:
        return self._value(query, f"{item}={self._item(query, item)}")

    def _item(self, query: str, item: str) -> str:
        answer = self.talk.ask(f"{query} {item}")
        name, equals, value = answer.partition("=")
        if not equals or name.strip() != item:
            raise self._nonsense(f"{query} {item}", answer)
        return value.strip()

    def _value(self, query: str, answer: str) -> float:
        try:
            value = float(answer.rpartition("=")[2])
        except ValueError:
            raise self._nonsense(query, answer) from None
        if not math.isfinite(value):
            raise self._nonsense(query, answer)
        return value

    def _nonsense(self, query: str, answer: str) -> HardwareError:
        return ProtocolFault(
            f"{self.talk.address}: {answer[:60]!r} is no answer to {query!r}; check the axis "
            "and that no other program talks to the device",
            answer,
        )
