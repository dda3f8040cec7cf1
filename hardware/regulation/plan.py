"""What a loop is to follow: a reference, its rate, what ends it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput, real_number


@dataclass(frozen=True, slots=True, eq=False)
class LoopPlan:
    """One run of a loop.

    Parameters
    ----------
    reference : ndarray
        (N,), one value a tick, in the unit of the reading; in V where `voltage` says so.
    rate : float
        Ticks a second (Hz), by the program's clock.
    reading : str
        Channel of the sensor that is fed back.
    voltage : bool
        The reference is a voltage: nothing is fed back.
    name : str
        Name of the recording.
    start : float
        Where the output rests before the first tick (V).
    settle : float
        Rest there (s).
    patience : float
        Longest time without a new reading, and longest stall of the program, that the loop
        outlives (s); the output holds meanwhile.
    asked : mapping
        How a user asked for it, plain values; the journal keeps it.

    Raises
    ------
    UnusableInput
        If shapes or numbers cannot be used.

    Examples
    --------
    >>> LoopPlan(4e-6 * np.sin(np.linspace(0.0, 6.0, 500)), rate=1e3).reference.size
    500
    """

    reference: NDArray[np.float64]
    rate: float
    reading: str = "x"
    voltage: bool = False
    name: str = "loop"
    start: float = 0.0
    settle: float = 0.05
    patience: float = 0.1
    asked: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check and freeze the reference."""
        values = np.array(self.reference, dtype=np.float64)
        if values.ndim != 1 or values.size < 2 or not np.isfinite(values).all():
            raise UnusableInput(f"{self.name}: the reference must be (N,), N >= 2, finite")
        values.setflags(write=False)
        object.__setattr__(self, "reference", values)
        for what in ("rate", "patience"):
            if real_number(what, getattr(self, what)) <= 0.0:
                raise UnusableInput(f"{self.name}: {what} must be positive")
        if real_number("settle", self.settle) < 0.0:
            raise UnusableInput(f"{self.name}: settle must not be negative")
        real_number("start", self.start)
