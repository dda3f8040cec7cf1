"""What is to be recorded: a waveform, how it is triggered, what to wait for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput, real_number

Synchronisation = Literal["clock", "start", "none"]
SYNCHRONISATIONS: tuple[Synchronisation, ...] = ("clock", "start", "none")


@dataclass(frozen=True, slots=True, eq=False)
class TakePlan:
    """One take.

    Parameters
    ----------
    volts : ndarray
        (N,), voltage at the actuator (V), one value a period of the output.
    rate : float
        Samples per second of the output, on its own clock (Hz).
    name : str
        Name of the recording.
    synchronisation : {"clock", "start", "none"}
        ``"clock"``: every sample of the output clocks one sample of the sensor. ``"start"``: the
        first sample starts the sensor, which runs on its own clock then. ``"none"``: both run
        free.
    settle : float
        Rest at the first voltage before the wave (s).
    patience : float
        Longest silence of a sensor during the take before it counts as gone (s).
    skew_budget : float
        Largest error of time that the alignment may leave (s); beyond it the recording is marked
        as unsynchronised.
    erase : ndarray, optional
        (M,), played before the take at the same rate and not recorded (V): a decay that
        demagnetises, so that the record does not begin with the history of the actuator.
    asked : mapping
        How a user asked for it, plain values; the journal keeps it.

    Raises
    ------
    UnusableInput
        If shapes or numbers cannot be used.

    Examples
    --------
    >>> plan = TakePlan(np.linspace(0.0, 10.0, 200), 5e3, "ramp", "none")
    >>> plan.volts.size / plan.rate  # s
    0.04
    """

    volts: NDArray[np.float64]
    rate: float
    name: str = "take"
    synchronisation: Synchronisation = "clock"
    settle: float = 0.05
    patience: float = 2.0
    skew_budget: float = 2e-6
    erase: NDArray[np.float64] | None = None
    asked: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check and freeze the waveform."""
        if self.erase is not None:
            object.__setattr__(self, "erase", self._wave(self.erase))
        object.__setattr__(self, "volts", self._wave(self.volts))
        if self.synchronisation not in SYNCHRONISATIONS:
            raise UnusableInput(
                f"{self.name}: synchronisation {self.synchronisation!r} is unknown; choose one of "
                f"{', '.join(SYNCHRONISATIONS)}"
            )
        for what in ("rate", "patience", "skew_budget"):
            if real_number(what, getattr(self, what)) <= 0.0:
                raise UnusableInput(f"{self.name}: {what} must be positive")
        if real_number("settle", self.settle) < 0.0:
            raise UnusableInput(f"{self.name}: settle must not be negative")

    def _wave(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        volts = np.array(values, dtype=np.float64)
        if volts.ndim != 1 or volts.size < 2:
            raise UnusableInput(f"{self.name}: the waveform must be (N,) with N >= 2 values in V")
        if not np.all(np.isfinite(volts)):
            bad = int(np.flatnonzero(~np.isfinite(volts))[0])
            raise UnusableInput(f"{self.name}: sample {bad} of the waveform is not finite")
        volts.setflags(write=False)
        return volts

    @property
    def seconds(self) -> float:
        """Length of the wave (s)."""
        return float(self.volts.size / self.rate)
