"""What an amplifier needs of a card: one analogue output, some inputs, digital lines."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Identity


@runtime_checkable
class AnalogueChannel(Protocol):
    """One analogue output of any card, in volts at its terminal."""

    @property
    def identity(self) -> Identity:
        """The card."""
        ...

    @property
    def lowest(self) -> float:
        """Lowest voltage (V)."""
        ...

    @property
    def highest(self) -> float:
        """Highest voltage (V)."""
        ...

    @property
    def resolution(self) -> float:
        """Smallest step (V); 0 if unknown."""
        ...

    def adopt(self) -> bool:
        """Take over a voltage that an earlier program left; False if there is none to take over."""
        ...

    def power_up(self) -> None:
        """Bring the card to 0 V from whatever state."""
        ...

    def write(self, volts: float) -> float:
        """Set (V); return what the converter makes of it (V)."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


@runtime_checkable
class AnalogueInputs(Protocol):
    """Some analogue inputs, sampled together."""

    def read(self) -> NDArray[np.float64]:
        """Voltages (V), ``(n,)``."""
        ...


@runtime_checkable
class DigitalLines(Protocol):
    """Digital lines of a card."""

    def set_line(self, bit: int, high: bool) -> None:
        """Set an output."""
        ...

    def read_lines(self) -> int:
        """Return the inputs, one a bit."""
        ...
