"""The three-wire output of the driver: back electrode, active and floating front electrode.

Sections 3.3.1 and 8.2.2 of the stack actuator thesis: 215 kHz on three wires, one front electrode
excited and the other left to float, the roles changed with the sign of the control voltage; every
wire is measured against ground and the back electrode is then subtracted.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from actuators.ultrasonic.data_sheet import M661
from actuators.ultrasonic.driver import Driver, envelope
from actuators.ultrasonic.plate import Plate
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True)
class Electrodes:
    """Capacitances of the plate with three terminals and how the driver feeds them.

    The text prints none of these; they are assumptions. The piezoelectric charge of the vibration
    on the floating electrode is left out, so its voltage is the divider's alone.

    Parameters
    ----------
    front : float
        Either front electrode to the back electrode, F.
    mutual : float
        Between the front electrodes, F.
    stray : float
        Floating electrode with cable, output stage and probe to ground, F.
    balance : float
        Share of the amplitude on the active wire; the back electrode carries the rest in
        opposition. 1 would ground the back electrode, which then needed no subtraction.
    """

    front: float = Plate().capacitance
    mutual: float = 0.06e-9
    stray: float = 0.1e-9
    balance: float = 0.5

    def __post_init__(self) -> None:
        """Refuse negative capacitances and shares beyond the whole."""
        if min(self.front, self.mutual, self.stray) < 0 or not self.front > 0:
            raise UnusableInput(f"Electrodes: capacitances have to be >= 0, front > 0: {self}")
        if not 0.0 <= self.balance <= 1.0:
            raise UnusableInput(f"Electrodes: balance {self.balance:g} is no share of 1")

    def floating(self, active: Array, back: Array) -> Array:
        """Voltage of the floating electrode against ground: its charge stays zero."""
        whole = self.front + self.mutual + self.stray
        return np.asarray((self.front * back + self.mutual * active) / whole)


@dataclass(frozen=True)
class ThreeWire:
    """Waveforms against ground, shape (N,), V.

    Attributes
    ----------
    positive, negative : ndarray
        Front electrode that is active for positive, for negative control voltage.
    """

    time: Array
    amplitude: Array
    back: Array
    positive: Array
    negative: Array

    @property
    def active(self) -> Array:
        """Active front electrode less back electrode (``V_a`` of figure 8.7)."""
        return np.asarray(np.where(self.amplitude >= 0, self.positive, self.negative) - self.back)

    @property
    def passive(self) -> Array:
        """Floating front electrode less back electrode (``V_p`` of figure 8.7)."""
        return np.asarray(np.where(self.amplitude >= 0, self.negative, self.positive) - self.back)


def three_wire(
    time: Array,
    control: Array,
    *,
    driver: Driver | None = None,
    electrodes: Electrodes | None = None,
    frequency: float = M661.frequency,
) -> ThreeWire:
    """Waveforms for a control voltage; the amplitude is proportional to it, 60 V at 10 V.

    Parameters
    ----------
    time : ndarray, shape (N,), s
        Even grid, at least 4 samples a period.
    control : ndarray, shape (N,), V

    Raises
    ------
    UnusableInput
        The grid is too coarse for the carrier.
    """
    electrodes = Electrodes() if electrodes is None else electrodes
    a = envelope(time, control, driver)
    if (step := float(time[1] - time[0])) * frequency > 0.25:
        raise UnusableInput(
            f"three_wire: a step of {step:g} s is too coarse for {frequency:g} Hz; take at most "
            f"{0.25 / frequency:.2g} s"
        )
    wave = M661.amplitude / M661.control * np.abs(a) * np.sin(2 * pi * frequency * time)
    active, back = electrodes.balance * wave, (electrodes.balance - 1.0) * wave
    floating = electrodes.floating(active, back)
    forward = a >= 0
    return ThreeWire(
        np.asarray(time, float),
        a,
        back,
        np.where(forward, active, floating),
        np.where(forward, floating, active),
    )
