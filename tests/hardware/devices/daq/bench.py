"""A rig with a card in front of it, on virtual time."""

from __future__ import annotations

import numpy as np

from hardware.devices.daq import MF624, MF634, Card, Registers
from hardware.simulators.plant_contract import PlantMotion
from hardware.simulators.registers import CardFront
from hardware.simulators.rig import Rig


class Capacitor:
    """A plant: 10 nm/V at once, current of 1 uF."""

    step = 1e-4

    def __init__(self) -> None:
        self._last = 0.0

    def advance(self, volts: np.ndarray) -> PlantMotion:
        before = np.concatenate([[self._last], volts[:-1]])
        if volts.size:
            self._last = float(volts[-1])
        return PlantMotion(1e-8 * volts, 1e-6 * (volts - before) / self.step)


class RigClock:
    """The program's time is the true time."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig

    def now(self) -> float:
        return self.rig.now

    def sleep(self, seconds: float) -> None:
        self.rig.wait(seconds)


def card_on(front: CardFront, rig: Rig, registers: Registers | None = None) -> Card:
    """The card of the front, by default through its registers in this process."""
    kind = MF624 if front.registers.model == "MF624" else MF634
    return kind(registers or front.registers, RigClock(rig))
