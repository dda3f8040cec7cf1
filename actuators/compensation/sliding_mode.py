"""Sliding mode around an inverse operator, as in chapter 7's survey of the thesis.

The surface is ``s = e + lambda integral(e)``. Behind an inverse the actuator is nearly a gain of 1,
so what switches is the rate of the command: ``w' = rate sat(s / layer)``. Outside of the boundary
layer the command runs at its rate whatever the error's cause, inside it is linear and does not
chatter (Slotine and Li, Applied Nonlinear Control, 1991, chapter 7).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from actuators.compensation.margins import ProportionalIntegral
from bondgraph.support.errors import require_positive

LAYER = 200e-9
"""Half width of the boundary layer of `sliding_like`, m."""


@dataclass(frozen=True, slots=True)
class SlidingMode:
    """Sliding-mode controller with integral surface and boundary layer.

    Parameters
    ----------
    rate : float
        Of the command, m/s; more than what disturbs changes.
    layer : float
        Half width of the boundary layer, m.
    surface : float
        lambda, 1/s.

    Raises
    ------
    UnusableInput
        If a number is not positive.
    """

    n_states: ClassVar[int] = 2

    rate: float
    layer: float
    surface: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_positive("SlidingMode", rate=self.rate, layer=self.layer)
        require_positive("SlidingMode", or_zero=True, surface=self.surface)

    def decide(self, error: Any, state: Any, step: float) -> tuple[Any, Any]:
        """Return what is added to the command (m), and the next state."""
        total = state[1] + step * error
        s = (error + self.surface * total) / self.layer
        added = state[0] + step * self.rate * ca.fmin(ca.fmax(s, -1.0), 1.0)
        return added, ca.vertcat(added, total)

    def unwound(self, state: Any, missing: Any, step: float) -> Any:
        """Return the state without what the limits did not let through (m)."""
        return ca.vertcat(state[0] + missing, state[1])


def sliding_like(linear: ProportionalIntegral) -> SlidingMode:
    """Return the sliding mode that is inside its layer as fast as a linear controller.

    Its surface is a tenth of the integral gain, which costs 6 degrees of phase.
    """
    return SlidingMode(linear.integral * LAYER, LAYER, 0.1 * linear.integral)
