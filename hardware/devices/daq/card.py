"""Humusoft MF624 and MF634 by their registers.

Addresses and meanings of the bits are those of the public Linux drivers (``uio_mf624``, comedi
``mf6x4``). Neither driver nor this one was tried on a card here; see the tests' register log.

The hazard: after power-up the output registers hold 0x3FFF (+10 V; a public device model says so),
and comedi enables the outputs before it writes a value. Behind a gain of 20 that is +200 V on a
100 V stack. So `Card.power_up` writes 0 V everywhere before it enables anything, and nothing else
here enables outputs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.devices.daq.card_state import CardState
from hardware.devices.daq.codes import HIGHEST, LOWEST, ZERO, dac_codes, dac_volts, input_volts
from hardware.devices.daq.register_map import RegisterMap
from hardware.devices.daq.registers import Access, AccessKind
from hardware.errors import HardwareError, LimitViolation, ProtocolFault, TimedOut

__all__ = ["MF624", "MF634", "Card", "RegisterMap"]

CHANNELS = 8
_BUSY_LOOKS = 64


class Card(CardState):
    """A card behind an accessor of registers; one caller at a time.

    Parameters
    ----------
    registers, clock, timeout
        See `CardState`.
    """

    @property
    def lines(self) -> int:
        """Digital outputs as last written."""
        return self._lines

    def power_up(self) -> None:
        """Bring all outputs to 0 V without ever connecting another value.

        Outputs off, 0 V into every register, loaded, then outputs on; digital lines low.

        Raises
        ------
        LinkLost, ProtocolFault
            The card does not answer, or its control register does not keep what is written.
        """
        m = self.layout
        # the card may have been reset: the list of inputs has to be written again too
        self.forget()
        off = self.control() & ~m.enable
        self._write_control(off & ~m.hold)
        if self.control() & m.enable:
            raise ProtocolFault(
                f"{m.model} ({self.registers.address}): the outputs cannot be switched off; "
                "nothing was enabled: is this the right card?"
            )
        zeros = [
            Access(AccessKind.WRITE16, m.data_bar, m.outputs + 2 * n, ZERO) for n in range(CHANNELS)
        ]
        self.registers.batch([*zeros, Access(AccessKind.WRITE16, m.data_bar, m.digital, 0)])
        self._lines = 0
        # a rising and a falling edge, whichever of the two loads
        self._write_control((off & ~m.enable) | m.hold)
        self._write_control(off & ~m.hold)
        self._write_control((off & ~m.hold) | m.enable)
        if not self.enabled():
            raise ProtocolFault(
                f"{m.model} ({self.registers.address}): the outputs cannot be switched on; "
                "is another driver (comedi) at work on the card?"
            )
        self._ready = True

    def adopt(self) -> bool:
        """Take over outputs that an earlier program left on, at whatever values they have.

        Digital lines go low, as at power-up.

        Returns
        -------
        bool
            False if they are off, or if values wait to be loaded; then only `power_up` is safe.
        """
        self.forget()
        state = self.control()
        self._ready = bool(state & self.layout.enable) and not state & self.layout.hold
        if self._ready:
            self.registers.batch((self.lines_access(0),))
        return self._ready

    def switch_off(self) -> None:
        """Disconnect (ground) all outputs; a step, so ramp down before."""
        off = self.control() & ~self.layout.enable
        self._ready = False
        self._write_control(off)

    def write(self, channel: int, volts: float) -> float:
        """Set an output (V) and return what the converter makes of it (V).

        Raises
        ------
        LimitViolation
            Not a number, or beyond +-10 V; nothing was written.
        ProtocolFault
            Before `power_up`.
        LinkLost
            The card is gone, or something else has switched its outputs off.
        """
        self.require_ready()
        if not math.isfinite(volts) or not LOWEST <= volts <= HIGHEST:
            raise LimitViolation(
                f"{self.layout.model} output {channel}: {volts!r} V is not within "
                f"{LOWEST:g} to {HIGHEST:g} V; nothing was written"
            )
        code = dac_codes(np.array([volts]))
        accesses = (self.output_access(channel, int(code[0])), self.state_access())
        self.require_present(self.registers.batch(accesses)[1])
        return float(dac_volts(code)[0])

    def output_access(self, channel: int, code: int) -> Access:
        """Return the access that writes an output code."""
        if not 0 <= channel < CHANNELS:
            raise LimitViolation(
                f"{self.layout.model}: no output {channel}; choose 0 to {CHANNELS - 1}"
            )
        m = self.layout
        return Access(AccessKind.WRITE16, m.data_bar, m.outputs + 2 * channel, code)

    def lines_access(self, lines: int) -> Access:
        """Return the access that writes the digital outputs, and remember them."""
        self._lines = lines & 0xFF
        return Access(AccessKind.WRITE16, self.layout.data_bar, self.layout.digital, self._lines)

    def set_line(self, bit: int, high: bool) -> None:
        """Set one digital output."""
        mask = 1 << bit
        lines = self._lines | mask if high else self._lines & ~mask
        self.registers.batch((self.lines_access(lines),))

    def read_lines(self) -> int:
        """Digital inputs, 8 bits."""
        word = self.registers.read16(self.layout.data_bar, self.layout.digital)
        if word == 0xFFFF:
            # eight high inputs look the same in 16 bits; the control register decides
            self.control()
        return word & 0xFF

    def convert(self, channels: Sequence[int]) -> NDArray[np.float64]:
        """Sample some inputs at once and return their voltages (V), in the order of `channels`.

        Raises
        ------
        TimedOut
            The conversion does not end.
        LinkLost
            The card is gone.
        """
        self.select(channels)
        words = self.registers.batch((self.start_access(), self.state_access()))
        return self.collect(words[1])

    def select(self, channels: Sequence[int]) -> None:
        """Choose the inputs of later conversions."""
        wanted = tuple(channels)
        if (
            not wanted
            or any(not 0 <= c < CHANNELS for c in wanted)
            or len(set(wanted)) < len(wanted)
        ):
            raise HardwareError(
                f"{self.layout.model}: inputs {wanted}; choose different ones of 0 to 7"
            )
        if wanted == self._scan:
            return
        mask = sum(1 << c for c in wanted)
        # an interruption in between must not leave an old list believed
        self._scan = ()
        self.registers.write16(self.layout.data_bar, self.layout.inputs, mask)
        self._scan = wanted

    def start_access(self) -> Access:
        """Return the read that samples the selected inputs."""
        return Access(AccessKind.READ16, self.layout.data_bar, self.layout.start)

    def state_access(self) -> Access:
        """Return the read of the control register."""
        return Access(AccessKind.READ32, self.layout.control_bar, self.layout.control)

    def collect(self, state: int) -> NDArray[np.float64]:
        """Wait for the conversion, given the control register read last; return volts."""
        m = self.layout
        self._wait_for_conversion(state)
        count = len(self._scan)
        words = self.registers.batch([Access(AccessKind.READ16, m.data_bar, m.inputs)] * count)
        if all(w == 0xFFFF for w in words):
            # 14 bit words with sign can read so only if the card sign-extends; ask it
            self.control()
        # the queue holds them from the lowest channel up
        ordered = sorted(self._scan)
        volts = input_volts(np.array(words))
        return volts[[ordered.index(c) for c in self._scan]]

    def close(self) -> None:
        """Let go of the registers; outputs stay as they are."""
        self._ready = False
        self.registers.close()

    def _wait_for_conversion(self, state: int) -> None:
        looks, start = 0, 0.0
        while True:
            self.require_present(state)
            if not state & self.layout.converting:
                return
            looks += 1
            # a conversion takes some us: look often first, ask the clock only then
            if looks == _BUSY_LOOKS:
                start = self.clock.now()
            elif looks > _BUSY_LOOKS:
                if self.clock.now() - start > self.timeout:
                    # the outputs still obey, so that they can be ramped down
                    self._scan = ()
                    raise TimedOut(
                        f"{self.layout.model} ({self.registers.address}): a conversion did not "
                        f"end within {self.timeout:g} s; switch the card off and on"
                    )
                self.clock.sleep(1e-3)
            state = self.registers.batch((self.state_access(),))[0]


@final
class MF624(Card):
    """The PCI card; BARs 0, 2, 4."""

    layout = RegisterMap("MF624", 0x0624, (0, 2, 4), control_bar=0, control=0x54)


@final
class MF634(Card):
    """The PCI Express card; BARs 0, 2, 3."""

    layout = RegisterMap("MF634", 0x0634, (0, 2, 3), control_bar=3, control=0x68)
