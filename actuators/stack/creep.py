"""Logarithmic creep, and springs and dampers that creep like it over given decades.

After a step a stack moves on as ``x(t) = x_0 (1 + gamma log10(t/t_0))`` (stack actuator thesis,
sec. 2.4.2). The logarithm has no beginning and no end; a chain of Kelvin-Voigt units has both, and
as an operator it answers any input.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

_POINTS_PER_DECADE = 100


@final
@dataclass(frozen=True, slots=True)
class LogarithmicCreep:
    """``1 + gamma log10(t/t_0)`` times the displacement at ``t_0``.

    Parameters
    ----------
    gamma : float
        Part of the displacement gained in a decade; 0.01 to 0.02 are usual.
    reference : float
        ``t_0``, s.

    Examples
    --------
    >>> float(LogarithmicCreep(0.01).factor(10.0))
    1.02
    """

    gamma: float
    reference: float = 0.1

    def __post_init__(self) -> None:
        """Refuse values out of their domain."""
        if not isfinite(self.gamma) or not 0 < self.reference < inf:
            raise UnusableInput(
                f"creep: gamma = {self.gamma:g} must be finite and reference = "
                f"{self.reference:g} s positive"
            )

    def factor(self, time: ArrayLike) -> FloatArray:
        """Return displacement over ``x_0`` at `time` (s after the step, any shape), same shape.

        Raises
        ------
        UnusableInput
            A time before ``t_0``, where the step itself still acts.
        """
        t = np.asarray(time, dtype=np.float64)
        if not ((t >= self.reference) & (t < inf)).all():
            raise UnusableInput(
                f"creep: time {t.min():g} s is before the reference {self.reference:g} s; the law "
                "describes what follows the step, choose a smaller reference"
            )
        return np.asarray(1 + self.gamma * np.log10(t / self.reference))


@final
@dataclass(frozen=True, slots=True)
class KelvinVoigt:
    """``elastic + sum g_j (1 - exp(-t/tau_j))``: an elastic part and units of spring and damper.

    Parameters
    ----------
    elastic : float
        Output per input at once.
    gains : tuple of float, shape (n,)
        ``g_j >= 0``, output per input gained by each unit in the end.
    times : tuple of float, shape (n,)
        ``tau_j > 0``, s.
    """

    elastic: float
    gains: tuple[float, ...]
    times: tuple[float, ...]

    def __post_init__(self) -> None:
        """Store tuples of floats and refuse units that would give energy."""
        for name in ("gains", "times"):
            object.__setattr__(self, name, tuple(float(v) for v in getattr(self, name)))
        if len(self.gains) != len(self.times):
            raise UnusableInput(
                f"Kelvin-Voigt: {len(self.gains)} gains and {len(self.times)} times; give pairs"
            )
        if not 0 < self.elastic < inf:
            raise UnusableInput(
                f"Kelvin-Voigt: elastic = {self.elastic:g} must be positive; creep this strong "
                "needs a smaller gamma or fewer decades"
            )
        for j, (g, tau) in enumerate(zip(self.gains, self.times, strict=True)):
            if not (0 <= g < inf and 0 < tau < inf):
                raise UnusableInput(
                    f"Kelvin-Voigt: unit {j} has gain {g:g} and time {tau:g} s; the gain must be "
                    "0 or more, the time positive"
                )

    def factor(self, time: ArrayLike) -> FloatArray:
        """Return the answer to a step of 1 at `time` (s after it, >= 0, any shape), same shape."""
        t = np.asarray(time, dtype=np.float64)
        if not (t >= 0).all():
            raise UnusableInput("Kelvin-Voigt: times before the step are negative; leave them out")
        growth = -np.expm1(-t[..., None] / np.array(self.times))
        return np.asarray(self.elastic + growth @ np.array(self.gains))

    def operator(self) -> KelvinVoigtCreep:
        """Return the operator that answers any input, for records and for elements of a graph."""
        return KelvinVoigtCreep(self.elastic, self.gains, self.times)

    def elements(self, stiffness: float) -> tuple[float, tuple[tuple[float, float], ...]]:
        """Return the chain that creeps so under a force: a spring, then (spring, damper) pairs.

        Parameters
        ----------
        stiffness : float
            Such that the displacement is ``F/stiffness`` times `factor`, N/m.

        Returns
        -------
        elastic : float
            N/m.
        units : tuple of (float, float)
            Spring (N/m) and damper (N s/m), in parallel; units with gain 0 are left out.
        """
        if not 0 < stiffness < inf:
            raise UnusableInput(f"Kelvin-Voigt: stiffness = {stiffness:g} N/m must be positive")
        pairs = zip(self.gains, self.times, strict=True)
        units = tuple((stiffness / g, stiffness / g * tau) for g, tau in pairs if g > 0)
        return stiffness / self.elastic, units


def fit_kelvin_voigt(
    creep: LogarithmicCreep, decades: float = 5.0, units: int = 7
) -> tuple[KelvinVoigt, float]:
    """Fit Kelvin-Voigt units to logarithmic creep from its reference over some decades.

    Parameters
    ----------
    creep : LogarithmicCreep
        With ``gamma > 0``.
    decades : float
        How many decades after the reference to cover.
    units : int
        Their time constants are spread evenly over the logarithm of the time covered.

    Returns
    -------
    model : KelvinVoigt
    error : float
        Largest deviation in the interval, relative to the creep over it, ``gamma * decades``.

    Raises
    ------
    UnusableInput
        A value is out of its domain.

    Notes
    -----
    Non-negative least squares for the gains. The elastic part is free: at ``t_0`` the fast units
    have already moved, so the model starts a little below ``x_0``.

    Examples
    --------
    >>> model, error = fit_kelvin_voigt(LogarithmicCreep(0.02))
    >>> error < 0.0043
    True
    """
    from scipy.optimize import nnls

    if creep.gamma <= 0:
        raise UnusableInput(f"creep: gamma = {creep.gamma:g}; only growing creep has such a chain")
    if units < 1 or not 0 < decades < 100:
        raise UnusableInput(
            f"creep: {units} units over {decades:g} decades; give at least one unit and a positive "
            "number of decades"
        )
    span = np.linspace(0.0, decades, max(50, round(_POINTS_PER_DECADE * decades)))
    exponents = np.linspace(0.0, decades, units) if units > 1 else np.array([decades / 2])
    growth = -np.expm1(-(10.0 ** (span[:, None] - exponents)))
    one = np.ones((span.size, 1))
    # two columns of opposite sign leave the constant free
    gains, _ = nnls(np.hstack([growth, one, -one]), span)
    offset = gains[-2] - gains[-1]
    error = np.abs(growth @ gains[:-2] + offset - span).max() / decades
    model = KelvinVoigt(
        1 + creep.gamma * float(offset),
        tuple((creep.gamma * gains[:-2]).tolist()),
        tuple((creep.reference * 10.0**exponents).tolist()),
    )
    return model, float(error)
