"""What is known beforehand of how drive and sensor are wired together."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.support.errors import UnusableInput
from hardware.synchrony.held import Hold
from hardware.synchrony.time_map import TimeMap


@dataclass(frozen=True, slots=True)
class ClockWiring:
    """Clocks, trigger and the way of the voltage.

    Parameters
    ----------
    shared_clock : bool
        The sensor takes its samples on the drive's clock (external sample clock, or one clock for
        both): the ratio is 1 exactly.
    delay : float
        Nominal delay of the sensor's first sample behind the first of the drive (s).
    delay_error : float, optional
        Its standard deviation (s) where the trigger is known to be that good; None: not known.
    most_delay : float, optional
        How far from `delay` to look (s); by default 16 samples of the sensor.
    most_skew : float
        Largest ratio error thought possible.
    hold : {"zero", "linear"}
        What the converter does between its samples.
    lag : float, optional
        First-order lag of the amplifier (s), between the converter and both actuator and copy;
        None: estimated from the copy.
    lag_error : float
        Standard deviation of a given lag (s).
    copy_latency, copy_latency_error : float
        Delay of the copy alone (s), such as that of its own filter, and its standard deviation.
    plant_lag_error : float, optional
        How well the delay of the actuator's own answer is known to be zero (standard deviation,
        s); without it the length alone never gives a delay.
    drifting : bool
        Let the ratio change linearly in time.
    knots : tuple of float
        Instants (s) at which a drifting ratio may bend.

    Raises
    ------
    UnusableInput
        If a number is negative or not finite.
    """

    shared_clock: bool = False
    delay: float = 0.0
    delay_error: float | None = None
    most_delay: float | None = None
    most_skew: float = 1e-3
    hold: Hold = "zero"
    lag: float | None = None
    lag_error: float = 0.0
    copy_latency: float = 0.0
    copy_latency_error: float = 0.0
    plant_lag_error: float | None = None
    drifting: bool = False
    knots: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not math.isfinite(self.delay) or not math.isfinite(self.copy_latency):
            raise UnusableInput("wiring: delay and copy_latency must be finite (s)")
        for name in (
            "delay_error", "most_delay", "most_skew", "lag", "lag_error",
            "copy_latency_error", "plant_lag_error",
        ):  # fmt: skip
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise UnusableInput(f"wiring: {name} = {value} must be finite and not negative")
        if not 0.0 < self.most_skew < 0.1:
            raise UnusableInput(f"wiring: most_skew = {self.most_skew}; give 1e-6 to 0.1")
        if self.shared_clock and self.drifting:
            raise UnusableInput("wiring: one shared clock cannot drift against itself")
        if self.knots and not self.drifting:
            raise UnusableInput("wiring: only a drifting ratio bends; give drifting=True too")
        if not np.isfinite(self.knots).all() or np.any(np.diff(self.knots) <= 0.0):
            raise UnusableInput(f"wiring: knots {self.knots} must be finite and increase (s)")

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the numbers of the time map that are not known beforehand."""
        if self.shared_clock:
            return ("delay",)
        bends = tuple(f"bend {j}" for j in range(len(self.knots)))
        return ("delay", "skew", "drift", *bends) if self.drifting else ("delay", "skew")

    def bent(self, start: TimeMap) -> TimeMap:
        """Return a map that may bend where this allows it."""
        return replace(start, bends=tuple((t, 0.0) for t in self.knots))
