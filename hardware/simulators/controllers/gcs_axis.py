"""The axis of the simulated controller: amplifier, sensor and servo."""

from __future__ import annotations

from typing import final

import numpy as np

from hardware.simulators.controllers.gcs_model import GcsModel, Refusal
from hardware.simulators.noise import white
from hardware.simulators.rig import Rig

_STEP = 1e-3
"""Step of the simulated servo (s)."""


@final
class SimulatedAxis:
    """Voltage out, position in; in between nothing, or a servo.

    Parameters
    ----------
    rig : Rig
        The bench.
    model : GcsModel
        Limits and noise.
    """

    def __init__(self, rig: Rig, model: GcsModel) -> None:
        self._rig = rig
        self._model = model
        self.volts = 0.0
        self.commanded = 0.0
        self.servo = False
        self.target = 0.0
        self._readings = 0
        self._run = 0

    def write(self, volts: float) -> None:
        """Put a voltage on the output (V); the amplifier gives no more than it can."""
        self.volts = float(np.clip(volts, self._model.lowest, self._model.highest))
        self._rig.drive(self.volts)

    def command(self, volts: float) -> None:
        """Obey an open-loop command (V)."""
        if self.servo:
            raise Refusal(303)
        if not np.isfinite(volts):
            raise Refusal(25)
        if not self._model.lowest <= volts <= self._model.highest:
            raise Refusal(302)
        self.commanded = volts
        self.write(volts)

    def move(self, target: float) -> None:
        """Obey a closed-loop command (um)."""
        if not self.servo:
            raise Refusal(5)
        if not np.isfinite(target):
            raise Refusal(25)
        if not self._model.travel[0] <= target <= self._model.travel[1]:
            raise Refusal(7)
        self.target = target

    def position(self) -> float:
        """Read the position sensor (um)."""
        return self._true() + 1e6 * self._model.noise * self._noise()

    def voltage(self) -> float:
        """Read the output (V)."""
        return self.volts + self._model.voltage_noise * self._noise()

    def on_target(self) -> bool:
        """Whether the servo is on and there."""
        return self.servo and abs(self._true() - self.target) <= self._model.tolerance

    def close_loop(self, on: bool) -> None:
        """Switch the servo; either way the output starts from where it is."""
        if on == self.servo:
            return
        self._run += 1
        self.servo = on
        if on:
            self.target = float(np.clip(self._true(), *self._model.travel))
            self._regulate(self._run)
        else:
            self.commanded = self.volts

    def _regulate(self, run: int) -> None:
        if run != self._run:
            return
        m = self._model
        volts_per_um = m.highest / (m.travel[1] - m.travel[0])
        self.write(self.volts + m.closed_gain * volts_per_um * (self.target - self._true()))
        self._rig.at(self._rig.now + _STEP, lambda: self._regulate(run))

    def _true(self) -> float:
        return 1e6 * float(self._rig.seen(np.array([self._rig.now])).x[0])

    def _noise(self) -> float:
        self._readings += 1
        return float(white(self._model.seed, self._readings, 1)[0])
