"""The position controller of the stage, one decision a tick: what `step_answer` simulates."""

from __future__ import annotations

from typing import final

import casadi as ca

from actuators.ultrasonic.characteristic import control_voltage
from actuators.ultrasonic.closed_loop import Sampling, decision
from actuators.ultrasonic.sampled_loop import PositionController


@final
class StageLoop:
    """PID on the position, its force through the inverse characteristic to a control voltage.

    Parameters
    ----------
    controller : PositionController
    sampling : Sampling
        Rate, resolution and tolerance; its delay is the bench's own.
    """

    def __init__(self, controller: PositionController, sampling: Sampling) -> None:
        self._decide = decision(ca, controller, sampling)
        self.begin(0.0, 0.0)

    def begin(self, reading: float, volts: float) -> None:
        """Start at rest at this position (m)."""
        self._last, self._integral, self._next, self._asked = reading, 0.0, 0.0, volts

    def decide(self, reading: float, reference: float) -> float:
        """Return the control voltage (V) at a position and a reference (m)."""
        force, self._next, last = self._decide(reading, self._integral, self._last, reference)
        self._last = float(last)
        self._asked = float(control_voltage(float(force)))
        return self._asked

    def applied(self, volts: float) -> None:
        """Let the integral stand where the guard held the voltage back (V)."""
        if volts == self._asked:
            self._integral = float(self._next)
