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

from bondgraph.hysteresis.checks import numbers
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


def chain_elements(
    creep: KelvinVoigtCreep, stiffness: float
) -> tuple[float, tuple[tuple[float, float], ...]]:
    """Return the chain that creeps so under a force: a spring, then (spring, damper) pairs.

    Parameters
    ----------
    creep : KelvinVoigtCreep
        With a positive gain, and weights of 0 or more.
    stiffness : float
        Such that the displacement is ``F/stiffness`` times the answer of `creep`, N/m.

    Returns
    -------
    elastic : float
        N/m.
    units : tuple of (float, float)
        Spring (N/m) and damper (N s/m), in parallel; units with weight 0 are left out.
    """
    if not 0 < stiffness < inf:
        raise UnusableInput(f"Kelvin-Voigt: stiffness = {stiffness:g} N/m must be positive")
    gain, weights = numbers("gain", (creep.gain,))[0], numbers("weights", creep.weights)
    if not (gain > 0 and min(weights) >= 0):
        raise UnusableInput(
            f"Kelvin-Voigt: no chain has the gain {gain:g} and weights {weights}, which would give "
            "energy; creep this strong needs a smaller gamma or fewer decades"
        )
    pairs = zip(weights, numbers("times", creep.times), strict=True)
    units = tuple((stiffness / g, stiffness / g * tau) for g, tau in pairs if g > 0)
    return stiffness / gain, units


def fit_kelvin_voigt(
    creep: LogarithmicCreep, decades: float = 5.0, units: int = 7
) -> tuple[KelvinVoigtCreep, float]:
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
    model : KelvinVoigtCreep
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
    model = KelvinVoigtCreep(
        1 + creep.gamma * float(offset),
        tuple((creep.gamma * gains[:-2]).tolist()),
        tuple((creep.reference * 10.0**exponents).tolist()),
    )
    return model, float(error)
