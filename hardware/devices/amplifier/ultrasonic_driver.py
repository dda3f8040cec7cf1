"""The driver electronics of the ultrasonic plate actuator: C-184.161 for the M-661.

What is public (stack actuator thesis, ch. 4 and table 4.1): an analogue input of -10 to +10 V whose
amplitude controls the velocity and whose sign gives the direction; 12 V supply; it makes the
215 kHz on three wires (120 V peak to peak, 400 mA) by itself; its frequency is tuned by a
potentiometer on the board. It has no digital interface.

What is not public: whether the board has an enable input or an error output, its bandwidth, its
dead zone and what it does at power-up. So none of these is used. A contact that switches the 12 V
supply and travel limit switches are parts of the bench, not of the board; they are optional here
and sit on digital lines of the card, because a velocity command alone would run the stage into its
end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import final

from hardware.contracts import Identity
from hardware.devices.amplifier.channel import AnalogueChannel, DigitalLines
from hardware.devices.amplifier.data import Amplifier
from hardware.envelope.limits import Converter
from hardware.errors import HardwareError, LimitViolation

_RANGE = 10.0


@dataclass(frozen=True, slots=True)
class UltrasonicLimits:
    """Limits of the control voltage, and what the bench adds to the board.

    Parameters
    ----------
    largest : float
        Largest amplitude of the control voltage (V), at most 10.
    supply : int, optional
        Digital output whose high level switches the supply of the board on.
    lower_end, upper_end : int, optional
        Digital inputs of switches at the ends of travel towards which negative and positive
        voltages drive.
    closed_is_high : bool
        Level of a switch that the stage has reached. False suits switches that open then (a broken
        wire reads as an end) with a pull-up.
    """

    largest: float = _RANGE
    supply: int | None = None
    lower_end: int | None = None
    upper_end: int | None = None
    closed_is_high: bool = True

    def __post_init__(self) -> None:
        """Refuse a range that the board does not have."""
        if not 0.0 < self.largest <= _RANGE:
            raise LimitViolation(
                f"C-184 control voltage: the largest amplitude is {self.largest} V; the input "
                f"takes up to {_RANGE:g} V"
            )


@final
class UltrasonicDriver:
    """A `RawOutput` whose voltage is the control voltage of the board (V), 0 V at rest.

    Parameters
    ----------
    channel : AnalogueChannel
        Output to the board's input.
    limits : UltrasonicLimits, optional
        What the bench allows.
    lines : DigitalLines, optional
        The card's lines, needed if `limits` names any.
    """

    def __init__(
        self,
        channel: AnalogueChannel,
        limits: UltrasonicLimits | None = None,
        lines: DigitalLines | None = None,
    ) -> None:
        self._channel = channel
        self._limits = UltrasonicLimits() if limits is None else limits
        wanted = (self._limits.supply, self._limits.lower_end, self._limits.upper_end)
        if lines is None and any(bit is not None for bit in wanted):
            raise LimitViolation("C-184: the limits name digital lines, but no lines were given")
        self._lines = lines
        self._present = 0.0

    @property
    def identity(self) -> Identity:
        """The board and the card."""
        card = self._channel.identity
        return replace(card, model=f"C-184.161 behind {card.model}".strip())

    @property
    def amplifier(self) -> Amplifier:
        """The control voltage as that of an amplifier of gain 1, for playing waveforms.

        A player does not look at the ends of travel: call `check_ends` with the last voltage of
        every report, and abort the player if it stops the stage.
        """
        largest = self._limits.largest
        return Amplifier(
            1.0, lowest=-largest, highest=largest, name="C-184.161 input", source="its range"
        )

    @property
    def converter(self) -> Converter:
        """What can be produced at the board's input, for the guard."""
        largest = self._limits.largest
        return Converter(-largest, largest, self._channel.resolution)

    @property
    def has_watchdog(self) -> bool:
        """False: the board follows its input as long as it is supplied."""
        return False

    @property
    def limits(self) -> UltrasonicLimits:
        """What the bench allows."""
        return self._limits

    def power_up(self) -> None:
        """Supply off where it can be switched, input to 0 V, then supply on."""
        self._supply(False)
        self._channel.power_up()
        self._present = 0.0
        # power_up lowers all lines of the card, so the supply is off until here
        self._supply(True)

    def write(self, volts: float) -> None:
        """Set the control voltage (V).

        Raises
        ------
        LimitViolation
            Not allowed; or towards an end that was reached, with the 0 V where it stands then as
            `partial`.
        """
        if not math.isfinite(volts) or abs(volts) > self._limits.largest:
            raise LimitViolation(
                f"C-184 control voltage {volts!r} V is not within +-{self._limits.largest:g} V; "
                "nothing was written"
            )
        end = self._reached(volts)
        if end:
            self._channel.write(0.0)
            self._present = 0.0
            raise LimitViolation(
                f"C-184: {volts:g} V would drive on into the {end} end of travel; the control "
                "voltage was set to 0 V: drive the other way",
                0.0,
            )
        self._present = self._channel.write(volts)

    def check_ends(self, volts: float | None = None) -> bool:
        """Look at the switches, and stop if the stage drives into an end; call it while it moves.

        Parameters
        ----------
        volts : float, optional
            Control voltage now (V), where a player gives it; by default what `write` has set.

        Returns
        -------
        bool
            Whether it had to be stopped.
        """
        if not self._reached(self._present if volts is None else volts):
            return False
        self._channel.write(0.0)
        self._present = 0.0
        return True

    def read(self) -> float | None:
        """None: nothing measures the control voltage."""
        return None

    def close(self) -> None:
        """Stop the stage, switch the supply off where possible, let go of the card."""
        try:
            self._channel.write(0.0)
            self._supply(False)
        except HardwareError:
            pass
        try:
            self._channel.close()
        except (HardwareError, OSError):
            return

    def _supply(self, on: bool) -> None:
        if self._limits.supply is not None and self._lines is not None:
            self._lines.set_line(self._limits.supply, on)

    def _reached(self, volts: float) -> str:
        """Name of the reached end towards which a voltage would drive; empty if there is none."""
        bit = self._limits.upper_end if volts > 0.0 else self._limits.lower_end
        if volts == 0.0 or bit is None or self._lines is None:
            return ""
        high = bool(self._lines.read_lines() >> bit & 1)
        if high is not self._limits.closed_is_high:
            return ""
        return "upper" if volts > 0.0 else "lower"
