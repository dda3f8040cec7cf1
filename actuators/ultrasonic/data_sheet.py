"""What the data sheets of the M-661 and its driver C-184.161 say, and whether it agrees.

Numbers of the stack actuator thesis, tables 3.2 and 4.1. Nothing here is measured by us.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt


@dataclass(frozen=True)
class DataSheet:
    """Printed values, SI."""

    travel: float = 18e-3
    max_velocity: float = 0.5
    max_load: float = 5.0
    push_force: float = 1.0
    holding_force: float = 2.0
    voltage_peak_to_peak: float = 120.0
    voltage_rms: float = 42.0
    power: float = 5.0
    current: float = 0.4
    frequency: float = 215e3
    mass: float = 30e-3
    supply: float = 12.0
    control: float = 10.0
    """Largest control voltage, either sign."""

    @property
    def amplitude(self) -> float:
        """Half the peak-to-peak voltage, V."""
        return self.voltage_peak_to_peak / 2

    @property
    def sine_rms(self) -> float:
        """Root mean square of a sine of the printed peak-to-peak voltage, V."""
        return self.amplitude / sqrt(2)

    @property
    def supply_power(self) -> float:
        """Printed current times the printed supply voltage, W."""
        return self.supply * self.current

    @property
    def load_resistance(self) -> float:
        """Resistance that takes the printed power at `sine_rms`, ohm."""
        return self.sine_rms**2 / self.power

    @property
    def largest_capacitance(self) -> float:
        """Capacitance beside `load_resistance` at which the sine draws the printed current, F."""
        admittance = self.current / self.sine_rms
        return sqrt(admittance**2 - self.load_resistance**-2) / (2 * pi * self.frequency)

    @property
    def damping(self) -> float:
        """``b = F / v`` of the mass-damper model at full force and full speed, N s/m."""
        return self.push_force / self.max_velocity

    @property
    def largest_output(self) -> float:
        """Largest mechanical power of a straight force-speed line, ``F v / 4``, W."""
        return self.push_force * self.max_velocity / 4


M661 = DataSheet()

REMARKS: tuple[str, ...] = (
    "120 V peak to peak is 42.4 V rms only for a sine; a square wave would have 60 V",
    "400 mA from the 12 V supply are 4.8 W, the printed 5 W within its one digit; as a current "
    "through the plate they would be an apparent power of 17 VA",
    "the axis of figure 8.9 (force at 10 V) goes to 5 N, the push force is printed as 1 N; 5 N is "
    "also the range of the gauge and the printed maximum load, so the axis settles nothing",
    "figures 8.3, 8.6 to 8.9 exist as drawings only: no number is read from a curve",
)
"""What a reader of the printed numbers has to know."""
