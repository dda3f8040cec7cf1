"""What is known of a card: whether it is there and whether its outputs obey."""

from __future__ import annotations

from abc import ABC
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Clock, Identity, WallClock
from hardware.devices.daq.codes import HIGHEST, LOWEST, STEP
from hardware.devices.daq.register_map import RegisterMap
from hardware.devices.daq.registers import Registers
from hardware.errors import LimitViolation, LinkLost, ProtocolFault

ALL_ONES = 0xFFFFFFFF


class CardState(ABC):
    """The control register and what follows from it.

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

    def _write_control(self, word: int) -> None:
        self.registers.write32(self.layout.control_bar, self.layout.control, word)
