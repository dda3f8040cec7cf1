"""How the refraction index, and a length with it, follows from errors of the air sensors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hardware.optics.refraction import (
    FORMULA_DOMAIN,
    HELIUM_NEON,
    SENSOR_DOMAIN,
    ValidRange,
    ciddor_index,
)

IndexFormula = Callable[..., NDArray[np.float64]]

_EQUATION: Final = 1e-8


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Derivatives of the index.

    Parameters
    ----------
    temperature : float
        1/K; about -9.5e-7 in a laboratory.
    pressure : float
        1/Pa; about 2.7e-9.
    humidity : float
        By the relative humidity as 0 to 1; about -8.5e-7.
    """

    temperature: float
    pressure: float
    humidity: float


@dataclass(frozen=True, slots=True)
class SensorUncertainty:
    """Standard uncertainties of the air sensors.

    Parameters
    ----------
    temperature : float
        K.
    pressure : float
        Pa.
    humidity : float
        Of the relative humidity as 0 to 1.
    equation : float
        Of the index by the formula itself; 1e-8 is the third of what Birch and Downs claim at
        three standard deviations.
    """

    temperature: float
    pressure: float
    humidity: float
    equation: float = _EQUATION


@dataclass(frozen=True, slots=True)
class IndexUncertainty:
    """Index with its standard uncertainty and what it is made of.

    Parameters
    ----------
    index : float
        Refraction index.
    standard : float
        Combined standard uncertainty.
    from_temperature, from_pressure, from_humidity, from_equation : float
        Contributions, combined by squares.
    """

    index: float
    standard: float
    from_temperature: float
    from_pressure: float
    from_humidity: float
    from_equation: float

    def of_length(self, displacement: float, dead_path: float = 0.0) -> float:
        """Return the standard uncertainty (m) of a displacement (m) beside a dead path (m)."""
        return self.standard * (abs(displacement) + abs(dead_path)) / self.index


def sensitivity(
    temperature: float,
    pressure: float,
    humidity: float,
    wavelength: float = HELIUM_NEON,
    *,
    formula: IndexFormula = ciddor_index,
    domain: ValidRange = SENSOR_DOMAIN,
) -> Sensitivity:
    """Return the derivatives of the index by the state of the air, by central differences.

    Parameters
    ----------
    temperature, pressure, humidity, wavelength, domain
        As in `edlen_index`.
    formula : callable
        `ciddor_index` or `edlen_index`.

    Returns
    -------
    Sensitivity

    Examples
    --------
    >>> round(sensitivity(293.15, 101325.0, 0.5).temperature * 1e7, 1)
    -9.5
    """
    formula(temperature, pressure, humidity, wavelength, domain=domain)
    here = np.array([temperature, pressure, humidity])
    # the steps stay inside of the physical range of the humidity
    up = np.array([0.5, 50.0, min(0.05, 1.0 - humidity)])
    down = np.array([0.5, 50.0, min(0.05, humidity)])
    slopes = []
    for k in range(3):
        e = np.eye(3)[k]
        ends = np.stack([here + up * e, here - down * e], axis=1)
        n = formula(*ends, wavelength, domain=FORMULA_DOMAIN)
        slopes.append(float((n[0] - n[1]) / (up[k] + down[k])))
    return Sensitivity(*slopes)


def index_uncertainty(
    temperature: float,
    pressure: float,
    humidity: float,
    sensors: SensorUncertainty,
    wavelength: float = HELIUM_NEON,
    *,
    formula: IndexFormula = ciddor_index,
    domain: ValidRange = SENSOR_DOMAIN,
) -> IndexUncertainty:
    """Propagate the uncertainty of the air sensors to the index (first order, independent errors).

    All but `sensors` is as in `sensitivity`.

    Parameters
    ----------
    sensors : SensorUncertainty
        Standard uncertainties.

    Returns
    -------
    IndexUncertainty
    """
    s = sensitivity(temperature, pressure, humidity, wavelength, formula=formula, domain=domain)
    parts = (
        abs(s.temperature) * sensors.temperature,
        abs(s.pressure) * sensors.pressure,
        abs(s.humidity) * sensors.humidity,
        sensors.equation,
    )
    n = float(formula(temperature, pressure, humidity, wavelength, domain=domain))
    return IndexUncertainty(n, math.hypot(*parts), *parts)
