"""The vibrating plate near its resonance: Butterworth-Van Dyke circuit (thesis figure 2.5).

A capacitance beside a series branch ``L_m, C_m, R_m``; the current of the branch is proportional
to the speed of the vibration. Values follow from resonance, quality and resistance.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from actuators.ultrasonic.data_sheet import M661
from actuators.ultrasonic.driver import LOADED_Q
from bondgraph import BondGraph, C, Df, I, One, R, Se, Zero
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True)
class Plate:
    """One excited electrode against the back electrode.

    Parameters
    ----------
    frequency : float
        Series resonance, Hz; printed.
    resistance : float
        ``R_m``, ohm; it takes the printed power at the printed voltage, so an upper bound of what
        the plate takes (the printed power includes the losses of the driver).
    quality : float
        Of the pressed plate. An assumption: thesis table 2.1 has 65 to 350 for free ceramics.
    capacitance : float
        ``C_0``, F. An assumption below the bound that the printed current sets.
    """

    frequency: float = M661.frequency
    resistance: float = M661.load_resistance
    quality: float = LOADED_Q
    capacitance: float = 1.2e-9

    def __post_init__(self) -> None:
        """Refuse a plate that is no resonator."""
        if not min(self.frequency, self.resistance, self.quality, self.capacitance) > 0:
            raise UnusableInput(f"Plate: every value has to be > 0, not {self}")

    @property
    def omega(self) -> float:
        """Series resonance, rad/s."""
        return 2 * pi * self.frequency

    @property
    def half_width(self) -> float:
        """``R / (2 L)``: rate of the build-up and half width of the resonance, rad/s."""
        return self.omega / (2 * self.quality)

    @property
    def inductance(self) -> float:
        """``L_m``, H."""
        return self.quality * self.resistance / self.omega

    @property
    def motional_capacitance(self) -> float:
        """``C_m``, F."""
        return 1 / (self.omega**2 * self.inductance)

    @property
    def coupling(self) -> float:
        """Effective coupling, ``sqrt(C_m / (C_0 + C_m))``."""
        c = self.motional_capacitance
        return float((c / (self.capacitance + c)) ** 0.5)

    @property
    def susceptance(self) -> float:
        """``omega C_0``, S."""
        return self.omega * self.capacitance

    def admittance(self, frequency: Array | float) -> Array:
        """Complex admittance (S) at frequencies (Hz), any shape."""
        w = 2 * pi * np.asarray(frequency, float)
        branch = self.resistance + 1j * (w * self.inductance - 1 / (w * self.motional_capacitance))
        return np.asarray(1 / branch + 1j * w * self.capacitance)


def plate_graph(plate: Plate | None = None, output: float = 1.0) -> BondGraph:
    """Return the plate as a bond graph behind the driver's output resistance (ohm).

    Input ``V`` (volt between the electrodes); outputs ``i`` (the whole current, A) and ``i_m``
    (of the vibration).

    Examples
    --------
    >>> plate_graph().check()
    ()
    """
    plate = Plate() if plate is None else plate
    with BondGraph("ultrasonic_plate") as g:
        lead, electrodes, vibration = One("lead"), Zero("electrodes"), One("vibration")
        Se("V", unit="V") >> lead
        lead >> R("R_out", output, unit="ohm")
        lead >> electrodes >> C("C_0", plate.capacitance, unit="F")
        electrodes >> vibration >> I("L_m", plate.inductance, unit="H")
        vibration >> C("C_m", plate.motional_capacitance, unit="F")
        vibration >> R("R_m", plate.resistance, unit="ohm")
        lead >> Df("i", unit="A")
        vibration >> Df("i_m", unit="A")
    return g
