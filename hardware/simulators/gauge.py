"""A force gauge on a line: it is asked for a reading and answers with one line of text.

The form is that of the gauge of the stack actuator thesis (Imada DS2) as it is commonly told: the
request ``D``, the answer sign, five digits with the point, unit, mode, judgement, CR.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.controllers.serving import Serving, TcpDoorway
from hardware.simulators.noise import white
from hardware.simulators.rig import Rig


@dataclass(frozen=True, slots=True)
class GaugeConfig:
    """What the gauge is pressed against and how it reads.

    Parameters
    ----------
    spring : float
        Force by displacement of the bench (N/m).
    rate : float
        Readings that it makes a second (Hz).
    noise : float
        Standard deviation (N).
    outliers, size : float
        Share of readings that a shake of the table spoils, and by how much (N).
    largest : float
        Range (N); beyond it the judgement is E.
    seed : int
    """

    spring: float = 2e3
    rate: float = 100.0
    noise: float = 0.004
    outliers: float = 0.03
    size: float = 0.8
    largest: float = 5.0
    seed: int = 0


Pressed = Callable[[Array], Array]
"""Force (N) at times (s) that presses the gauge against the bench, instead of its spring."""


@final
class SimulatedGauge:
    """What answers."""

    terminator = b"\r"

    def __init__(self, rig: Rig, config: GaugeConfig, pressed: Pressed | None) -> None:
        self._rig, self._config, self._pressed = rig, config, pressed
        self._waiting = b""

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take bytes and answer the requests that they complete."""
        self._waiting += data
        while b"\r" in self._waiting:
            line, _, self._waiting = self._waiting.partition(b"\r")
            if line.strip() == b"D":
                yield self._reading() + self.terminator
            elif line.strip():
                yield b"E" + self.terminator

    def force(self, number: int) -> float:
        """Return reading `number` since the start of the bench (N)."""
        c = self._config
        when = np.array([number / c.rate])
        if self._pressed is not None:
            force = float(self._pressed(when)[0])
        else:
            force = c.spring * float(self._rig.seen(when).x[0])
        normal, chance, way = (float(white(c.seed, number, 1, s)[0]) for s in (11, 12, 13))
        # chance is normal: its tail of the wanted share
        spoiled = 0.5 * math.erfc(chance / math.sqrt(2.0)) < c.outliers
        return force + c.noise * normal + (math.copysign(c.size, way) if spoiled else 0.0)

    def _reading(self) -> bytes:
        c = self._config
        force = self.force(int(self._rig.now * c.rate + 1e-6))
        held = min(max(force, -1.1 * c.largest), 1.1 * c.largest)
        judgement = "E" if abs(force) > c.largest else "O"
        return f"{held:+.3f}NT{judgement}".encode("ascii")


@final
class GaugeFront(Serving):
    """The gauge behind a TCP port, as a converter of its serial line gives it.

    Parameters
    ----------
    rig : Rig
        The bench.
    config : GaugeConfig, optional
    pressed : callable, optional
    """

    def __init__(
        self, rig: Rig, config: GaugeConfig | None = None, pressed: Pressed | None = None
    ) -> None:
        super().__init__(SimulatedGauge(rig, config or GaugeConfig(), pressed), TcpDoorway())
