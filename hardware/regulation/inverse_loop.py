"""PI behind the inverse of an operator: the stack's position loop, and a loop around any gain."""

from __future__ import annotations

from typing import Any, final

import casadi as ca
import numpy as np

from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.support.errors import UnusableInput, real_number
from bondgraph.support.ops import CASADI, NUMPY


@final
class InverseLoop:
    """``u = H^-1[r + kp e + ki sum(e) T]`` with the memory of H where the actuator really went.

    The present error is in the sum, the convention of `actuators.compensation`. What the guard
    held back is taken from the sum with the controller's own time constant ``kp / ki``.

    Parameters
    ----------
    operator : InvertibleOperator
        Voltage (V) to reading; one threshold alone is a plain gain.
    proportional : float
        kp, command per error.
    integral : float
        ki (1/s).
    rate : float
        Ticks a second (Hz).
    feedforward : bool
        Whether the reference goes through the inverse too.

    Raises
    ------
    UnusableInput
        Gains that are not stable around any actuator, or an operator that has no inverse.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> operator = PrandtlIshlinskii((0.0, 10.0), (4e-8, 1e-8))  # m over V
    >>> loop = InverseLoop(operator, proportional=0.0, integral=100.0, rate=1e3)
    >>> low, high = loop.reach(0.0, 100.0)
    >>> round(high * 1e6, 2)  # um
    4.9
    """

    def __init__(
        self,
        operator: InvertibleOperator[Any],
        proportional: float,
        integral: float,
        rate: float,
        *,
        feedforward: bool = True,
    ) -> None:
        self._kp = real_number("proportional", proportional)
        self._step = 1.0 / rate
        self._gain = real_number("integral", integral) * self._step
        if self._kp < 0.0 or self._gain < 0.0:
            raise UnusableInput("loop: proportional and integral gain must be 0 or more")
        # poles of z^2 + (kp + ki T - 1) z - kp, the loop around y(k + 1) = u(k)
        if not (self._kp < 1.0 and self._gain + 2.0 * self._kp < 2.0):
            raise UnusableInput(
                f"loop: ki / rate + 2 kp is {self._gain + 2.0 * self._kp:.3g}, which is not stable "
                "even around an actuator that follows within a tick; stay below 2 (and kp below "
                "1): lower the gains, or tick faster"
            )
        self._unwind = min(1.0, self._gain / self._kp) if self._kp else 1.0
        self._operator = operator
        self._feedforward = feedforward
        self._inverse, self._follow = _compiled(operator, self._step)
        self.begin(0.0, 0.0)

    def begin(self, reading: float, volts: float) -> None:
        """Start from a virgin operator at rest at this voltage, whose output is this reading."""
        states = self._operator.initial_memory(volts)
        self._zero = float(self._operator.value(NUMPY, volts, states)) - reading
        self._memory: Any = np.asarray(states, dtype=np.float64)
        self._sum = self._wanted = 0.0

    def reach(self, low: float, high: float) -> tuple[float, float]:
        """Return lowest and highest reading between two voltages (V), from a virgin start."""
        way, _ = self._operator.run(
            np.array([0.0, high, low, high]), step=self._step if self._operator.timed else None
        )
        return float(way.min()), float(way.max())

    def decide(self, reading: float, reference: float) -> float:
        """Return the wanted voltage (V)."""
        error = reference - reading
        self._sum += self._gain * error
        forward = reference if self._feedforward else 0.0
        self._wanted = self._kp * error + self._sum + forward + self._zero
        return float(self._inverse(self._wanted, self._memory))

    def applied(self, volts: float) -> None:
        """Follow the voltage that was applied (V)."""
        reached, self._memory = self._follow(volts, self._memory)
        if self._gain:
            self._sum += self._unwind * (float(reached) - self._wanted)


def _compiled(operator: InvertibleOperator[Any], step: float) -> tuple[Any, Any]:
    """Return ``(output, memory) -> input`` and ``(input, memory) -> (output, memory)``.

    Interpreted expressions: a tick costs some ten microseconds instead of hundreds.
    """
    x, z = ca.SX.sym("x"), ca.SX.sym("z", operator.n_memory)
    states = tuple(z[i] for i in range(operator.n_memory))
    dt = step if operator.timed else 0.0
    inverse = operator.inverse()
    back = inverse.value(CASADI, x, operator.inverse_memory(states, ops=CASADI), dt)
    there = operator.value(CASADI, x, states, dt)
    after = operator.advance(CASADI, x, states, dt)
    return (
        ca.Function("inverse", [x, z], [back]),
        ca.Function("follow", [x, z], [there, ca.vertcat(*after)]),
    )
