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
from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Clock, Identity, WallClock
from hardware.daq.codes import HIGHEST, LOWEST, STEP, ZERO, dac_codes, dac_volts, input_volts
from hardware.daq.registers import Access, Kind, Registers
from hardware.errors import HardwareError, LimitViolation, LinkLost, ProtocolFault, TimedOut

__all__ = ["MF624", "MF634", "Card", "RegisterMap"]

ALL_ONES = 0xFFFFFFFF
CHANNELS = 8
_BUSY_LOOKS = 64


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """Where the registers of a model lie.

    Parameters
    ----------
    model : str
        Name.
    device : int
        PCI device number.
    bars : tuple of int
        Its BARs, in the order of the drivers' maps.
    control_bar, control : int
        The general control register (32 bits).
    data_bar : int
        BAR of the registers below (16 bits each).
    inputs, start, digital, outputs : int
        Input queue (read) and list of inputs (write); start of a conversion (read); digital lines;
        first output (write).
    converting, hold, enable : int
        Bits of the control register: high while a conversion runs; outputs keep their values until
        it falls; outputs are connected (else grounded).
    """

    model: str
    device: int
    bars: tuple[int, ...]
    control_bar: int
    control: int
    data_bar: int = 2
    inputs: int = 0x00
    start: int = 0x20
    digital: int = 0x10
    outputs: int = 0x20
    converting: int = 1 << 17
    hold: int = 1 << 23
    enable: int = 1 << 26


class Card(ABC):
    """A card behind an accessor of registers; one caller at a time.

    Parameters
    ----------
    registers : Registers
        The accessor.
    clock : Clock, optional
        For time-outs.
    timeout : float
        Longest conversion (s).
    """

    layout: ClassVar[RegisterMap]

    def __init__(
        self, registers: Registers, clock: Clock | None = None, timeout: float = 0.1
    ) -> None:
        self.registers = registers
        self.clock: Clock = WallClock() if clock is None else clock
        self.timeout = timeout
        self._lines = 0
        self._scan: tuple[int, ...] = ()
        self._ready = False

    @property
    def identity(self) -> Identity:
        """Maker and model; the card tells no serial number."""
        return Identity(maker="Humusoft", model=self.layout.model)

    @property
    def ready(self) -> bool:
        """Whether `power_up` has been through."""
        return self._ready

    @property
    def lines(self) -> int:
        """Digital outputs as last written."""
        return self._lines

    def control(self) -> int:
        """Read the control register; `LinkLost` if the card is gone."""
        m = self.layout
        word = self.registers.read32(m.control_bar, m.control)
        self.require_present(word)
        return word

    def gone(
        self,
        why: str = (
            "all bits read as one, so the card is gone; check it and its bus, then power up anew: "
            "its outputs are unknown"
        ),
    ) -> LinkLost:
        """Make the error of a card that no longer does what it is told."""
        return LinkLost(f"{self.layout.model} ({self.registers.address}): {why}")

    def enabled(self) -> bool:
        """Whether the outputs are connected, perhaps since an earlier program."""
        return bool(self.control() & self.layout.enable)

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
        zeros = [Access(Kind.WRITE16, m.data_bar, m.outputs + 2 * n, ZERO) for n in range(CHANNELS)]
        self.registers.batch([*zeros, Access(Kind.WRITE16, m.data_bar, m.digital, 0)])
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

        Returns
        -------
        bool
            False if they are off, or if values wait to be loaded; then only `power_up` is safe.
        """
        state = self.control()
        self._ready = bool(state & self.layout.enable) and not state & self.layout.hold
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

    def require_in_range(self, volts: NDArray[np.float64]) -> None:
        """Refuse a record (V) with anything that an output cannot give."""
        bad = ~((volts >= LOWEST) & (volts <= HIGHEST))
        if bad.any():
            n = int(np.argmax(bad))
            raise LimitViolation(
                f"{self.layout.model}: {float(volts.flat[n])!r} V (sample {n}) is not within "
                f"{LOWEST:g} to {HIGHEST:g} V of its outputs; nothing was written"
            )

    def forget_inputs(self) -> None:
        """Take the list of inputs as lost."""
        self._scan = ()

    def forget(self) -> None:
        """Take the outputs as unknown and the list of inputs as lost."""
        self._ready = False
        self._scan = ()

    def require_present(self, state: int) -> None:
        """Raise `LinkLost` if the control register shows a card that is gone or was reset."""
        if state == ALL_ONES:
            self.forget()
            raise self.gone()
        if self._ready and state & (self.layout.enable | self.layout.hold) != self.layout.enable:
            self.forget()
            raise self.gone(
                "its outputs were switched off or are held from outside (a reset, another "
                "program); end that program and power up anew"
            )

    def saturated(self, volts: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which input voltages (V) are at an end of the converter."""
        return np.asarray((volts <= LOWEST) | (volts >= HIGHEST - 1.5 * STEP))

    def require_ready(self) -> None:
        """Refuse to write to a card whose outputs are unknown."""
        if not self._ready:
            raise ProtocolFault(
                f"{self.layout.model} ({self.registers.address}): its outputs are unknown; call "
                "power_up() first"
            )

    def output_access(self, channel: int, code: int) -> Access:
        """Return the access that writes an output code."""
        if not 0 <= channel < CHANNELS:
            raise LimitViolation(
                f"{self.layout.model}: no output {channel}; choose 0 to {CHANNELS - 1}"
            )
        m = self.layout
        return Access(Kind.WRITE16, m.data_bar, m.outputs + 2 * channel, code)

    def lines_access(self, lines: int) -> Access:
        """Return the access that writes the digital outputs, and remember them."""
        self._lines = lines & 0xFF
        return Access(Kind.WRITE16, self.layout.data_bar, self.layout.digital, self._lines)

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
        self.registers.write16(self.layout.data_bar, self.layout.inputs, mask)
        self._scan = wanted

    def start_access(self) -> Access:
        """Return the read that samples the selected inputs."""
        return Access(Kind.READ16, self.layout.data_bar, self.layout.start)

    def state_access(self) -> Access:
        """Return the read of the control register."""
        return Access(Kind.READ32, self.layout.control_bar, self.layout.control)

    def collect(self, state: int) -> NDArray[np.float64]:
        """Wait for the conversion, given the control register read last; return volts."""
        m = self.layout
        self._wait_for_conversion(state)
        count = len(self._scan)
        words = self.registers.batch([Access(Kind.READ16, m.data_bar, m.inputs)] * count)
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

    def _write_control(self, word: int) -> None:
        self.registers.write32(self.layout.control_bar, self.layout.control, word)


@final
class MF624(Card):
    """The PCI card; BARs 0, 2, 4."""

    layout = RegisterMap("MF624", 0x0624, (0, 2, 4), control_bar=0, control=0x54)


@final
class MF634(Card):
    """The PCI Express card; BARs 0, 2, 3."""

    layout = RegisterMap("MF634", 0x0634, (0, 2, 3), control_bar=3, control=0x68)
