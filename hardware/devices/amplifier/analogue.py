"""An analogue amplifier behind a converter: an unguarded output in volts at the actuator."""

from __future__ import annotations

from dataclasses import replace
from typing import final

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Clock, Identity, WallClock
from hardware.devices.amplifier.channel import AnalogueChannel, AnalogueInputs
from hardware.devices.amplifier.data import Amplifier
from hardware.devices.walking import WalkToRest, walk
from hardware.envelope.limits import Converter, Envelope
from hardware.errors import HardwareError, LimitViolation, TimedOut


@final
class AnalogueAmplifier:
    """A `RawOutput`: voltage at the actuator to voltage of the converter and back.

    The amplifier has no digital interface: it cannot be asked, and nothing in it or in the card
    brings the voltage down when the program is gone. So `has_watchdog` is False, and after a crash
    the output has to be taken as unknown.

    Parameters
    ----------
    channel : AnalogueChannel
        The converter.
    amplifier : Amplifier
        Gain, offset, limits.
    inputs : AnalogueInputs, optional
        Monitor inputs, in the order of ``amplifier.monitors.channels()``.
    clamp : bool
        Cut commands to the limits instead of refusing them; every cut is counted in `clamped`.
    clock : Clock, optional
        For ramping down at power-up.
    gentle : float
        Rate of that ramp (V/s) where no guard says how (`keep_within`).
    """

    def __init__(
        self,
        channel: AnalogueChannel,
        amplifier: Amplifier,
        inputs: AnalogueInputs | None = None,
        *,
        clamp: bool = False,
        clock: Clock | None = None,
        gentle: float = 100.0,
    ) -> None:
        self._channel = channel
        self._amplifier = amplifier
        self._inputs = inputs
        self._clamp = clamp
        self._clock: Clock = WallClock() if clock is None else clock
        self._last: float | None = None
        self.clamped = 0
        ends = sorted((channel.lowest, channel.highest))
        reach = sorted(amplifier.gain * v + amplifier.offset for v in ends)
        lowest, highest = max(amplifier.lowest, reach[0]), min(amplifier.highest, reach[1])
        # what the converter cannot give is refused like what the actuator cannot stand
        a = replace(amplifier, lowest=min(lowest, 0.0), highest=max(highest, 0.0))
        self._amplifier = a
        self._way = WalkToRest(gentle, lowest=a.lowest, highest=a.highest)

    @property
    def amplifier(self) -> Amplifier:
        """Gain, offset, and the limits that hold with this converter."""
        return self._amplifier

    @property
    def identity(self) -> Identity:
        """Amplifier and card."""
        card = self._channel.identity
        return replace(card, model=f"{self._amplifier.name} behind {card.model}".strip())

    @property
    def converter(self) -> Converter:
        """What can be produced at the actuator, for the guard."""
        a = self._amplifier
        return Converter(a.lowest, a.highest, abs(a.gain) * self._channel.resolution)

    @property
    def has_watchdog(self) -> bool:
        """False: neither the amplifier nor the card notices a dead program."""
        return False

    def keep_within(self, envelope: Envelope) -> None:
        """Take the limits and the pace of the guard for the way to 0 V at power-up.

        Raises
        ------
        UnusableInput
            Its offset alone is more than the actuator may have.
        """
        way, offset = WalkToRest.within(envelope), self._amplifier.offset
        if not way.allows(offset):
            raise UnusableInput(
                f"{self._amplifier.name}: its offset puts {offset:g} V on the actuator while the "
                f"card gives nothing, outside {way.lowest:g} .. {way.highest:g} V; turn the offset "
                "down, or widen the envelope"
            )
        self._way = way

    def moved(self, volts: float) -> None:
        """Take note of a voltage at the actuator (V) that a player has written."""
        self._last = volts

    def power_up(self) -> None:
        """Bring the actuator to 0 V by a ramp.

        A card that is off comes up at 0 V, so that the ramp begins at the amplifier's offset. If
        the card is giving a voltage already, it begins at what was written last or, at the start
        of a program, at what the monitor tells. Where neither is known the card goes to 0 V in one
        step.

        Raises
        ------
        ProtocolFault
            The monitor tells a voltage that is not allowed; nothing was written.
        """
        if self._channel.adopt():
            present = self._found()
        else:
            self._channel.power_up()
            present = self._last = self._amplifier.offset
        walk(self._write_held, present, 0.0, self._way, self._clock)

    def write(self, volts: float) -> None:
        """Set the voltage at the actuator (V) now.

        Raises
        ------
        LimitViolation
            Not a number (always), or outside the limits (unless clamping was asked for).
        """
        a = self._amplifier
        if self._clamp and volts == volts and not a.lowest <= volts <= a.highest:
            volts = min(max(volts, a.lowest), a.highest)
            self.clamped += 1
        given = a.input_volts(volts)
        self._last = volts
        self._channel.write(given)

    def read(self) -> float | None:
        """Voltage at the actuator (V) by the monitor; None without one."""
        return self._measured()

    def read_current(self) -> float | None:
        """Return the current into the actuator (A) by the monitor; None without one."""
        return self._monitored("i")

    def provenance(self) -> dict[str, float | str]:
        """Return the numbers that a recording has to keep."""
        monitors = self._amplifier.monitors
        told: dict[str, float | str] = dict(self._amplifier.provenance())
        told["converter"] = self._channel.identity.model
        for name, scale in (("voltage", monitors.voltage), ("current", monitors.current)):
            if scale is not None and self._inputs is not None:
                told[f"monitor_{name}"] = scale
        return told

    def close(self) -> None:
        """Let go of the card; the voltage stays as it is."""
        try:
            self._channel.close()
        except (HardwareError, OSError):
            return

    def _found(self) -> float | None:
        """Voltage that the card is giving (V), as well as it can be known."""
        # a converter holds what it was given; a monitor may be broken, floating or wrongly scaled
        if self._last is not None:
            return self._last
        try:
            measured = self._measured()
        except TimedOut:
            return None
        if measured is not None:
            self._way.require(measured, f"{self._amplifier.name}: its voltage monitor tells")
        return measured

    def _measured(self) -> float | None:
        return self._monitored("V_mon")

    def _monitored(self, name: str) -> float | None:
        monitors = self._amplifier.monitors
        names = monitors.channels()
        if self._inputs is None or name not in names:
            return None
        volts = self._inputs.read()
        if volts.size < len(names):
            raise LimitViolation(
                f"{self._amplifier.name}: {volts.size} inputs for the monitors {', '.join(names)}"
            )
        n = names.index(name)
        return float(monitors.scaled(name, volts[n : n + 1])[0])

    def _write_held(self, volts: float) -> None:
        """Write a voltage (V) of the way down, within what the amplifier has."""
        self.write(min(max(volts, self._amplifier.lowest), self._amplifier.highest))
