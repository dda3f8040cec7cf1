"""What stands on the virtual bench: anything with a state that a voltage moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Motion", "Plant"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Readings at the ends of steps.

    Parameters
    ----------
    x : (n,) array
        Displacement (m).
    i : (n,) array
        Current (A); NaN if the plant has none.
    """

    x: Array
    i: Array


class Plant(Protocol):
    """A machine with its own state, advanced in equal steps.

    Its first state is rest at 0 V.
    """

    @property
    def step(self) -> float:
        """Step (s): small against everything that happens in the plant."""
        ...

    def advance(self, volts: Array) -> Motion:
        """Go on by one step per voltage (V, constant within the step), ``(n,)``."""
        ...
