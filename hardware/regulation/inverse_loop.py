"""PI behind the inverse of an operator: the stack's position loop, and a loop around any gain."""

from __future__ import annotations

from typing import Any, final

from bondgraph.hysteresis import Memory
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.support.errors import UnusableInput, real_number
from bondgraph.support.ops import NUMPY


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
        No finite gains, or an operator that has no inverse.
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
        self._unwind = min(1.0, self._gain / self._kp) if self._kp else 1.0
        self._operator = operator
        self._inverse = operator.inverse()
        self._timed = self._step if operator.timed else 0.0
        self._feedforward = feedforward
        self.begin(0.0, 0.0)

    def begin(self, reading: float, volts: float) -> None:
        """Start from a virgin operator at rest at this voltage, whose output is this reading."""
        self._memory: Memory = self._operator.initial_memory(volts)
        self._zero = float(self._operator.value(NUMPY, volts, self._memory)) - reading
        self._sum = self._wanted = 0.0

    def decide(self, reading: float, reference: float) -> float:
        """Return the wanted voltage (V)."""
        error = reference - reading
        self._sum += self._gain * error
        forward = reference if self._feedforward else 0.0
        self._wanted = self._kp * error + self._sum + forward + self._zero
        states = self._operator.inverse_memory(self._memory)
        return float(self._inverse.value(NUMPY, self._wanted, states, self._timed))

    def applied(self, volts: float) -> None:
        """Follow the voltage that was applied (V)."""
        reached = float(self._operator.value(NUMPY, volts, self._memory, self._timed))
        if self._gain:
            self._sum += self._unwind * (reached - self._wanted)
        self._memory = self._operator.advance(NUMPY, volts, self._memory, self._timed)
