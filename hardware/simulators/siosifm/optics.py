"""Light and air of the simulated interferometer: index, phase, quadrature signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware.simulators.arrays import Array

VACUUM = 632.991e-9
"""Vacuum wavelength of the laser (m)."""


@dataclass(frozen=True, slots=True)
class AirAround:
    """The air in the beam; the readings of the sensors follow it once a second.

    Parameters
    ----------
    temperature : float
        degC.
    pressure : float
        Pa.
    humidity : float
        Relative, %.
    warming : float
        Change of the temperature (K/s).
    rising : float
        Change of the pressure (Pa/s).
    """

    temperature: float = 20.0
    pressure: float = 101_325.0
    humidity: float = 50.0
    warming: float = 0.0
    rising: float = 0.0

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Temperature (degC), pressure (Pa) and humidity (%) at instants (s)."""
        t = np.asarray(t, dtype=float)
        return (
            self.temperature + self.warming * t,
            self.pressure + self.rising * t,
            np.full_like(t, self.humidity),
        )


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Signals of the two detectors: ``R cos(phi) + p`` and ``(R/r) sin(phi - a) + q``.

    Parameters
    ----------
    amplitude : float
        R, in counts of the converters.
    offset_cosine, offset_sine : float
        p and q as fractions of R.
    ratio : float
        r.
    phase : float
        a (rad).
    """

    amplitude: float = 8000.0
    offset_cosine: float = 0.0
    offset_sine: float = 0.0
    ratio: float = 1.0
    phase: float = 0.0

    @property
    def ideal(self) -> bool:
        """Whether the figure is a circle about the origin."""
        return (self.offset_cosine, self.offset_sine, self.ratio, self.phase) == (0, 0, 1, 0)


def index_of_air(temperature: Array, pressure: Array, humidity: Array) -> Array:
    """Refraction index at the wavelength of the laser.

    Edlen's formula as revised by Birch and Downs; the vapour pressure by Magnus' formula.

    Parameters
    ----------
    temperature, pressure, humidity : (n,) array
        degC, Pa, %.
    """
    s = (1e-6 / VACUUM) ** 2
    standard = 1e-8 * (8342.54 + 2_406_147.0 / (130.0 - s) + 15_998.0 / (38.9 - s))
    t, p = np.asarray(temperature), np.asarray(pressure)
    vapour = np.asarray(humidity) / 100.0 * 611.2 * np.exp(17.62 * t / (243.12 + t))
    density = (1.0 + 1e-8 * (0.601 - 0.00972 * t) * p) / (1.0 + 0.003661 * t)
    n = 1.0 + p * standard / 96_095.43 * density - vapour * (3.7345 - 0.0401 * s) * 1e-10
    return np.asarray(n)


def signals(phase: Array, level: Array, shape: Quadrature) -> tuple[Array, Array]:
    """Cosine and sine signals (counts) at a phase (rad) and a level of light (0 to 1), ``(n,)``."""
    R = shape.amplitude * level
    u1 = R * np.cos(phase) + shape.amplitude * shape.offset_cosine
    u2 = R / shape.ratio * np.sin(phase - shape.phase) + shape.amplitude * shape.offset_sine
    return np.asarray(u1), np.asarray(u2)
