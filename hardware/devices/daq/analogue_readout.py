"""One analogue input as a sensor: converted whenever it is polled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput, real_number
from hardware.contracts import Chunk, Clock, Flag, Identity

SATURATED = 9.99
"""From here on an input of +-10 V is at its end (V)."""


class Convertible(Protocol):
    """Inputs of a card."""

    def read(self) -> NDArray[np.float64]:
        """Voltages (V), ``(n,)``."""
        ...


@final
class AnalogueReadout:
    """An `Acquisition` of ``(V - offset) / scale``: a strain gauge, a phase detector, ...

    Parameters
    ----------
    inputs : Convertible
        One input.
    identity : Identity
        The card.
    clock : Clock
        Time of the program, which dates every sample.
    channel, unit : str
        Name and unit of the reading.
    scale, offset : float
        V per unit, V.
    rate : float
        Readings a second that it may be asked for (Hz).
    """

    stream = "readout"
    done = False

    def __init__(
        self,
        inputs: Convertible,
        identity: Identity,
        clock: Clock,
        *,
        channel: str,
        unit: str,
        scale: float,
        offset: float = 0.0,
        rate: float = 10e3,
    ) -> None:
        if real_number("readout: scale", scale) == 0.0:
            raise UnusableInput("readout: a scale of 0 V per unit tells nothing; give V per unit")
        self.identity, self.rate = identity, rate
        self._inputs, self._clock = inputs, clock
        self._channel, self._unit = channel, unit
        self._scale, self._offset = scale, offset
        self._count = 0

    def kickoff(self) -> None:
        """Count from 0."""
        self._count = 0

    def poll(self) -> Sequence[Chunk]:
        """Convert once."""
        volts = float(self._inputs.read()[0])
        value = np.array([(volts - self._offset) / self._scale])
        flag = Flag.SATURATED if abs(volts) >= SATURATED else Flag.GOOD
        units = {self._channel: self._unit, "instant": "s"}
        columns = {self._channel: value, "instant": np.array([self._clock.now()])}
        self._count += 1
        return [Chunk(self.stream, self._count - 1, columns, units, np.array([flag], np.uint16))]

    def finish(self) -> Sequence[Chunk]:
        """Nothing is left."""
        return []

    def abort(self) -> None:
        """Nothing runs."""
