"""Refraction index of air from temperature, pressure and humidity, by Ciddor.

In the form of J. A. Stone and J. H. Zimmerman, "Index of refraction of air", NIST Engineering
Metrology Toolbox, appendix A: P. E. Ciddor, Appl. Opt. 35 (1996) 1566.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput

ZERO_CELSIUS: Final = 273.15
"""0 C (K)."""
HELIUM_NEON: Final = 632.9908e-9
"""Vacuum wavelength (m) of a red helium-neon laser; 1.5e-6 relative standard uncertainty if it
is not stabilised (J. A. Stone et al., Metrologia 46 (2009) 11). A calibrated one has its own."""


@dataclass(frozen=True, slots=True)
class ValidRange:
    """Where values are believed; ends belong to it.

    Parameters
    ----------
    temperature : tuple of float
        K.
    pressure : tuple of float
        Pa.
    humidity : tuple of float
        Relative, 0 to 1.
    wavelength : tuple of float
        In vacuum (m).
    """

    temperature: tuple[float, float]
    pressure: tuple[float, float]
    humidity: tuple[float, float] = (0.0, 1.0)
    wavelength: tuple[float, float] = (300e-9, 1700e-9)

    def contains(self, temperature: ArrayLike, pressure: ArrayLike, humidity: ArrayLike) -> bool:
        """Whether all of the air lies inside; NaN never does."""
        return all(
            _inside(v, ends)
            for v, ends in (
                (temperature, self.temperature),
                (pressure, self.pressure),
                (humidity, self.humidity),
            )
        )


SENSOR_DOMAIN: Final = ValidRange((ZERO_CELSIUS + 4.0, ZERO_CELSIUS + 50.0), (70e3, 120e3))
"""What the air sensors of an interferometer are allowed to say: 4 to 50 C, 70 to 120 kPa."""
FORMULA_DOMAIN: Final = ValidRange((ZERO_CELSIUS - 40.0, ZERO_CELSIUS + 100.0), (10e3, 140e3))
"""Where the formulas themselves hold."""


def saturation_vapour_pressure(temperature: ArrayLike) -> Array:
    """Saturation pressure of water vapour, over ice below 0 C.

    IAPWS industrial formulation 1997 (region 4) over water; over ice W. Wagner, A. Saul and
    A. Pruss, J. Phys. Chem. Ref. Data 23 (1994) 515, both as used by NIST.

    Parameters
    ----------
    temperature : array_like
        K, any shape; 173 to 647.

    Returns
    -------
    ndarray
        Pa.

    Raises
    ------
    UnusableInput
        Outside of the formula.

    Examples
    --------
    >>> round(float(saturation_vapour_pressure(300.0)), 2)
    3536.59
    """
    T = np.asarray(temperature, dtype=np.float64)
    _require("temperature", T, (173.0, 647.0), "K")
    w = T - 2.38555575678e-1 / (T - 6.50175348448e2)
    A = w**2 + 1.16705214528e3 * w - 7.24213167032e5
    B = -1.70738469401e1 * w**2 + 1.20208247025e4 * w - 3.23255503223e6
    C = 1.49151086135e1 * w**2 - 4.82326573616e3 * w + 4.05113405421e5
    water = 1e6 * (2.0 * C / (-B + np.sqrt(B * B - 4.0 * A * C))) ** 4
    s = T / 273.16
    ice = 611.657 * np.exp(-13.928169 * (1.0 - s**-1.5) + 34.7078238 * (1.0 - s**-1.25))
    return np.asarray(np.where(T < ZERO_CELSIUS, ice, water))


def ciddor_index(
    temperature: ArrayLike,
    pressure: ArrayLike,
    humidity: ArrayLike,
    wavelength: float = HELIUM_NEON,
    *,
    carbon_dioxide: float = 450e-6,
    domain: ValidRange = SENSOR_DOMAIN,
) -> Array:
    """Refraction index of air by Ciddor's equation.

    Parameters
    ----------
    temperature, pressure, humidity : array_like
        K, Pa, relative (0 to 1); broadcast.
    wavelength : float
        In vacuum (m).
    carbon_dioxide : float
        Mole fraction; 450e-6 in a room, 400e-6 out of doors.
    domain : ValidRange
        Values outside are refused.

    Raises
    ------
    UnusableInput
        A value outside of the domain, or not finite; which, and what is allowed.

    Examples
    --------
    >>> f"{ciddor_index(293.15, 101325.0, 0.2, 633e-9):.10f}"
    '1.0002716285'
    """
    T, p, h, s = _checked(temperature, pressure, humidity, wavelength, domain)
    _require("carbon dioxide", np.asarray(carbon_dioxide), (0.0, 2000e-6), "")
    t, ppm = T - ZERO_CELSIUS, 1e6 * carbon_dioxide
    enhancement = 1.00062 + 3.14e-8 * p + 5.60e-7 * t * t
    x = enhancement * h * saturation_vapour_pressure(T) / p
    air = 1e-8 * (5792105.0 / (238.0185 - s) + 167917.0 / (57.362 - s))
    air *= 1.0 + 5.34e-7 * (ppm - 450.0)
    vapour = 1.022e-8 * (295.235 + 2.6422 * s - 0.032380 * s**2 + 0.004028 * s**3)
    M = 0.0289635 + 1.2011e-8 * (ppm - 400.0)
    moles = p / (_compressibility(T, p, x) * _GAS * T)
    rho_axs = 101325.0 * M / (0.9995922115 * _GAS * 288.15)
    return np.asarray(
        1.0 + (1.0 - x) * moles * M / rho_axs * air + x * moles * 0.018015 / 0.00985938 * vapour
    )


_GAS: Final = 8.314472


def _compressibility(T: Array, p: Array, x: Array) -> Array:
    """Of moist air, BIPM 1981/91 equation of state; `x` mole fraction of vapour."""
    t, y = T - ZERO_CELSIUS, p / T
    first = 1.58123e-6 - 2.9331e-8 * t + 1.1043e-10 * t * t
    first = first + (5.707e-6 - 2.051e-8 * t) * x + (1.9898e-4 - 2.376e-6 * t) * x * x
    return np.asarray(1.0 - y * first + y * y * (1.83e-11 - 0.765e-8 * x * x))


def _checked(
    temperature: ArrayLike,
    pressure: ArrayLike,
    humidity: ArrayLike,
    wavelength: float,
    domain: ValidRange,
) -> tuple[Array, Array, Array, float]:
    """Arrays, and the squared wave number (um^-2)."""
    T, p, h = (np.asarray(v, dtype=np.float64) for v in (temperature, pressure, humidity))
    _require("temperature", T, domain.temperature, "K")
    _require("pressure", p, domain.pressure, "Pa")
    _require("relative humidity", h, domain.humidity, "(0 to 1)")
    _require("wavelength", np.asarray(wavelength, np.float64), domain.wavelength, "m")
    return T, p, h, (1e-6 / wavelength) ** 2


def _inside(value: ArrayLike, ends: tuple[float, float]) -> bool:
    v = np.asarray(value, dtype=np.float64)
    # the ends are sums such as 273.15 + 50, so they are met to rounding
    slack = 1e-12 * max(abs(ends[0]), abs(ends[1]))
    return bool(np.all((v >= ends[0] - slack) & (v <= ends[1] + slack)))


def _require(name: str, value: Array, ends: tuple[float, float], unit: str) -> None:
    if not _inside(value, ends):
        flat = np.ravel(value)
        worst = flat[~((flat >= ends[0]) & (flat <= ends[1]))][0]
        raise UnusableInput(
            f"air: {name} {worst:g} {unit} is outside of {ends[0]:g} to {ends[1]:g}, "
            "so the refraction index would be wrong; check the sensor and its unit"
        )
