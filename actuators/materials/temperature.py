"""Laws of temperature: a factor over temperature for a constant, and thermal expansion.

It cannot be said in general how a ceramic depends on temperature; manufacturers supply
coefficients or charts (stack actuator thesis, sec. 2.4.2).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf, isfinite
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray


def kelvin(celsius: float) -> float:
    """Return a temperature on the Celsius scale in K.

    Examples
    --------
    >>> kelvin(20.0)
    293.15
    """
    return celsius + 273.15


def thermal_expansion(length: float, coefficient: float, difference: ArrayLike) -> FloatArray:
    """Return the change of length ``l alpha dT``, m, shape of `difference`.

    Parameters
    ----------
    length : float
        m.
    coefficient : float
        1/K; may be negative, as along the poling of some ceramics.
    difference : array
        Change of temperature, K.

    Examples
    --------
    >>> float(round(1e9 * thermal_expansion(18e-3, -4e-6, 10.0)))  # nm
    -720.0
    """
    if not 0 < length < inf or not isfinite(coefficient):
        raise UnusableInput(
            f"thermal expansion: length = {length:g} m must be positive, "
            f"coefficient = {coefficient:g} 1/K finite"
        )
    return np.asarray(length * coefficient * np.asarray(difference, dtype=np.float64))


class TemperatureLaw(ABC):
    """A factor over temperature; abstract. Subclasses give `factor` of a temperature in K."""

    __slots__ = ()

    @property
    @abstractmethod
    def domain(self) -> tuple[float, float]:
        """Lowest and highest temperature, K."""

    @abstractmethod
    def _factor(self, temperature: FloatArray) -> FloatArray:
        """Return the factor of a temperature inside the domain."""

    @final
    def factor(self, temperature: ArrayLike) -> FloatArray:
        """Return the factor at `temperature` (K, any shape), same shape.

        Raises
        ------
        UnusableInput
            The temperature is outside the domain of the law, or the factor is not positive.
        """
        t = np.asarray(temperature, dtype=np.float64)
        low, high = self.domain
        if not ((t >= low) & (t <= high)).all():
            bad = t[~((t >= low) & (t <= high))].flat[0]
            raise UnusableInput(
                f"temperature {bad:g} K is outside {low:g} to {high:g} K, where the law was "
                "stated; widen it only with data (and give K, not degC)"
            )
        found = self._factor(t)
        if not (found > 0).all():
            raise UnusableInput(
                f"temperature law: the factor falls to {found.min():g}; check the coefficients, "
                "they are per K and per K^2"
            )
        return found


@final
@dataclass(frozen=True, slots=True)
class TemperaturePolynomial(TemperatureLaw):
    """``1 + a (T - T_ref) + b (T - T_ref)^2``.

    Parameters
    ----------
    linear : float
        a, 1/K.
    quadratic : float
        b, 1/K^2.
    reference : float
        ``T_ref``, K.
    lower, upper : float
        Where the law holds, K; default -20 to 80 degC, the range of low-voltage stacks.

    Examples
    --------
    >>> float(TemperaturePolynomial(1e-3).factor(kelvin(40.0)).round(12))
    1.02
    """

    linear: float
    quadratic: float = 0.0
    reference: float = 293.15
    lower: float = 253.15
    upper: float = 353.15

    def __post_init__(self) -> None:
        """Refuse values that are not finite or out of order."""
        if not all(map(isfinite, (self.linear, self.quadratic))):
            raise UnusableInput("temperature law: a coefficient is not finite")
        if not 0 <= self.lower <= self.reference <= self.upper < inf:
            raise UnusableInput(
                f"temperature law: {self.lower:g} <= {self.reference:g} <= {self.upper:g} K is "
                "not so; lower, reference and upper must be in order, in K"
            )

    @property
    def domain(self) -> tuple[float, float]:
        """Lowest and highest temperature, K."""
        return self.lower, self.upper

    def _factor(self, temperature: FloatArray) -> FloatArray:
        d = temperature - self.reference
        return np.asarray(1 + self.linear * d + self.quadratic * d * d)


@final
@dataclass(frozen=True, slots=True)
class TemperatureTable(TemperatureLaw):
    """Points read from a chart, joined without overshoot (monotone cubic).

    Parameters
    ----------
    temperatures : tuple of float, shape (n,), n >= 2
        K, rising.
    values : tuple of float, shape (n,)
        Of the constant, positive, in any unit.
    reference : float
        K; the factor is the value over the value here.
    """

    temperatures: tuple[float, ...]
    values: tuple[float, ...]
    reference: float = 293.15

    def __post_init__(self) -> None:
        """Store tuples of floats and refuse tables that are no function."""
        t, v = (tuple(float(x) for x in s) for s in (self.temperatures, self.values))
        object.__setattr__(self, "temperatures", t)
        object.__setattr__(self, "values", v)
        if len(t) != len(v) or len(t) < 2:
            raise UnusableInput(
                f"temperature table: {len(t)} temperatures and {len(v)} values; give pairs, at "
                "least two"
            )
        for i in range(1, len(t)):
            if not t[i - 1] < t[i] < inf:
                raise UnusableInput(
                    f"temperature table: temperatures[{i}] = {t[i]:g} K does not rise; sort it"
                )
        for i, x in enumerate(v):
            if not 0 < x < inf:
                raise UnusableInput(f"temperature table: values[{i}] = {x:g} must be positive")
        if not t[0] <= self.reference <= t[-1]:
            raise UnusableInput(
                f"temperature table: the reference {self.reference:g} K is outside {t[0]:g} to "
                f"{t[-1]:g} K; choose one inside"
            )

    @property
    def domain(self) -> tuple[float, float]:
        """Lowest and highest temperature, K."""
        return self.temperatures[0], self.temperatures[-1]

    def _factor(self, temperature: FloatArray) -> FloatArray:
        from scipy.interpolate import PchipInterpolator

        curve = PchipInterpolator(self.temperatures, self.values)
        return np.asarray(curve(temperature) / curve(self.reference))
