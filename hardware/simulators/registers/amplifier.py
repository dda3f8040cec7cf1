"""A simulated amplifier between a card and the terminals: gain, offset, saturation, slew."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from hardware.simulators.rig import Rig

_PIECES = 16


@dataclass(frozen=True, slots=True)
class AmplifierData:
    """What the amplifier really does.

    Parameters
    ----------
    gain : float
        Voltage at the terminals per voltage at its input.
    offset : float
        Voltage at the terminals for 0 V (V).
    lowest, highest : float
        Where it saturates (V).
    slew : float
        Largest rate of its output (V/s).
    voltage_monitor : float
        Monitor voltage per voltage at the terminals.
    current_monitor : float
        Monitor voltage per current (V/A).
    """

    gain: float = 20.0
    offset: float = 0.0
    lowest: float = -200.0
    highest: float = 200.0
    slew: float = math.inf
    voltage_monitor: float = 1.0 / 20.0
    current_monitor: float = 50.0


@final
class SimulatedAmplifier:
    """Follows its input and drives the bench.

    A ramp of finite slew is put on the bench as 16 pieces of equal length, each at its mean.

    Parameters
    ----------
    rig : Rig
        The bench.
    data : AmplifierData
        What it does.
    """

    def __init__(self, rig: Rig, data: AmplifierData) -> None:
        self._rig = rig
        self.data = data
        self._start = 0.0
        self._from = 0.0
        self._to = 0.0
        self._ramp = 0

    def settle(self) -> None:
        """Put on the terminals at once what an input of 0 V gives."""
        self._to = self._limited(0.0)
        self._from = self._to
        self._rig.drive(self._to)

    def follow(self, volts: float) -> None:
        """Take a new input voltage (V) now."""
        target = self._limited(volts)
        if target == self._to:
            return
        now = self._rig.now
        level = self._level(now)
        self._start, self._from, self._to = now, level, target
        self._ramp += 1
        duration = abs(target - level) / self.data.slew
        if duration == 0.0:
            self._rig.drive(target)
            return
        piece = duration / _PIECES
        for k in range(_PIECES):
            share = (k + 0.5) / _PIECES
            self._later(now + k * piece, level + share * (target - level))
        self._later(now + duration, target)

    def _limited(self, volts: float) -> float:
        d = self.data
        return min(max(d.gain * volts + d.offset, d.lowest), d.highest)

    def _level(self, now: float) -> float:
        """Output now (V)."""
        reach = self.data.slew * (now - self._start) if now > self._start else 0.0
        way = self._to - self._from
        return self._from + math.copysign(min(abs(way), reach), way)

    def _later(self, instant: float, volts: float) -> None:
        ramp = self._ramp

        def drive() -> None:
            # a newer command has taken over
            if ramp == self._ramp:
                self._rig.drive(volts)

        self._rig.at(instant, drive)
