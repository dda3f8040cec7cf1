"""What stands on the virtual bench: anything with a state that a voltage moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from hardware.simulators.arrays import Array


class Moved(Protocol):
    """Readings at the ends of steps, by whatever class."""

    @property
    def x(self) -> Array:
        """Displacement (m), ``(n,)``."""
        ...

    @property
    def i(self) -> Array:
        """Current (A), ``(n,)``; NaN if the plant has none."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PlantMotion:
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

    def advance(self, volts: Array) -> Moved:
        """Go on by one step per voltage (V, constant within the step), ``(n,)``."""
        ...


@runtime_checkable
class Rewindable(Protocol):
    """A plant that can look ahead: its state is taken, advanced for a look, and put back."""

    def snapshot(self) -> Any:
        """Return a copy of the whole state."""
        ...

    def restore(self, state: Any) -> None:
        """Put a state back."""
        ...


@runtime_checkable
class EdgeDriven(Protocol):
    """A plant that takes edges inside its steps as they are, not as means of steps."""

    def advance_edges(self, count: int, at: Array, volts: Array) -> Moved:
        """Go on by `count` steps.

        Parameters
        ----------
        count : int
            Steps.
        at : (m,) array
            Where the voltage changes, in steps from now, rising, in [0, count).
        volts : (m + 1,) array
            Voltage before the first change, and after each (V).
        """
        ...
