"""An inverse operator whose weights follow the actuator: recursive least squares on its plays.

The displacement is ``x = sum w_i play_i[u]``, linear in the weights. They are a random walk seen
through the measured displacement, so the recursion is a Kalman filter: what a sample excites is
corrected, what it does not stays. Slopes are kept positive, so the inverse exists at every sample
(Tan and Baras, 2005, adapt the weights of a Preisach operator in the same way).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from actuators.compensation.feedforward import limited_inverse
from bondgraph.hysteresis import AlJanaideh, PrandtlIshlinskii
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.errors import require_positive
from bondgraph.support.ops import FloatArray

LEAST_SLOPE = 0.1
"""Smallest slope of the adapted operator over its mean slope."""


@dataclass(frozen=True, slots=True)
class AdaptiveInverse:
    """Plays with weights that are learnt while they compensate.

    Parameters
    ----------
    nominal : AlJanaideh or PrandtlIshlinskii
        Where the weights start; V to m.
    spread : float
        What the weights may be off at the start, relative to the mean slope.
    drift : float
        How much they may change in a second, in the same unit.
    noise : float
        Standard deviation of what the plays cannot explain, m.

    Raises
    ------
    UnusableInput
        If a number is not positive.
    """

    nominal: AlJanaideh | PrandtlIshlinskii
    spread: float = 0.05
    drift: float = 0.02
    noise: float = 10e-9

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_positive("AdaptiveInverse", spread=self.spread, noise=self.noise)
        require_positive("AdaptiveInverse", or_zero=True, drift=self.drift)

    @property
    def plays(self) -> PrandtlIshlinskii:
        """The nominal plays."""
        o = self.nominal
        return o.as_prandtl_ishlinskii() if isinstance(o, AlJanaideh) else o

    @property
    def n_states(self) -> int:
        """Plays, weights, their covariance, and the plays of the last two voltages."""
        n = len(self.plays.weights)
        return (n - 1) + n + n * n + 2 * n

    @property
    def start(self) -> FloatArray:
        """First state, shape (n_states,); weights and covariance over the mean slope."""
        n, slope = len(self.plays.weights), float(self.plays.slope_full)
        weights = np.array(self.plays.weights, float) / slope
        covariance = self.spread**2 * np.eye(n)
        return np.concatenate((np.zeros(n - 1), weights, covariance.ravel(), np.zeros(2 * n)))

    def step(
        self, wanted: Any, measured: Any, state: Any, envelope: DriveLimits, step: float
    ) -> tuple[Any, Any, Any, Any]:
        """Learn from a reading, then invert; CasADi in and out.

        Parameters
        ----------
        wanted, measured : expression
            m; the reading belongs to the voltage of the last step but one.
        state : expression, shape (n_states,)
        envelope : DriveLimits
        step : float
            s.

        Returns
        -------
        voltage, reached, excess : expression
            As of `limited_inverse`.
        state : expression
        """
        plays, n = self.plays, len(self.plays.weights)
        slope = float(plays.slope_full)
        memory, rest = state[: n - 1], state[n - 1 :]
        weights, phi, latest = rest[:n], rest[n + n * n : -n], rest[-n:]
        p = ca.reshape(rest[n : n + n * n], n, n) + step * self.drift**2 * ca.DM.eye(n)
        seen = slope * phi
        reach = p @ seen
        gain = reach / (self.noise**2 + ca.dot(seen, reach))
        weights = weights + gain * (measured - ca.dot(seen, weights))
        p = p - gain @ reach.T
        slopes = ca.fmax(ca.cumsum(weights), LEAST_SLOPE)
        weights = ca.vertcat(slopes[0], slopes[1:] - slopes[:-1])
        learnt: InvertibleOperator[Any] = PrandtlIshlinskii(
            plays.thresholds, tuple(slope * weights[i] for i in range(n))
        )
        states = tuple(memory[i] for i in range(n - 1))
        voltage, reached, excess, after = limited_inverse(learnt, wanted, states, envelope)
        # what is read now came of the voltage before the last one
        moved = ca.vertcat(voltage, *after)
        return voltage, reached, excess, ca.vertcat(*after, weights, ca.vec(p), latest, moved)
