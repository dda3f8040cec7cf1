"""A player of waveforms that looks at the ends of travel while it plays."""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

from bondgraph.support.arrays import FloatArray as Array
from hardware.contracts import WaveProgress
from hardware.devices.amplifier.ultrasonic_driver import UltrasonicDriver
from hardware.envelope import RawWave
from hardware.errors import LimitViolation


@final
class EndedWave:
    """A `RawWave` of the ultrasonic driver's control voltage; stops where a switch is reached.

    Parameters
    ----------
    inner : RawWave
        Plays on the driver's output.
    driver : UltrasonicDriver
        Knows the switches.
    """

    def __init__(self, inner: RawWave, driver: UltrasonicDriver) -> None:
        self._inner, self._driver = inner, driver
        self._stopped = False
        self.haste = float(getattr(inner, "haste", 1.0))

    @property
    def position(self) -> int | None:
        """Samples put out, as the player tells; None where it does not, or a switch ended it."""
        count: int | None = getattr(self._inner, "position", None)
        return None if self._stopped else count

    def load(self, volts: Array, rate: float) -> None:
        """Transfer a waveform."""
        self._inner.load(volts, rate)

    def play(self) -> Iterator[WaveProgress]:
        """Play, and look at the switches about every 20 ms.

        Raises
        ------
        LimitViolation
            An end of travel was reached; the control voltage is 0 V.
        """
        self._stopped = False
        for state in self._inner.play():
            driven = [c.channels["V"] for c in state.chunks if "V" in c.channels and c.n]
            if driven and self._driver.check_ends(float(driven[-1][-1])):
                self._stopped = True
                self._inner.abort()
                raise LimitViolation(
                    "C-184: the waveform drove the stage into an end of travel, where it was "
                    "stopped; begin further inside, or play a shorter one"
                )
            yield state

    def abort(self) -> None:
        """End playing at once."""
        self._inner.abort()
