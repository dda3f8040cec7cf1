"""Why the actuator cannot be driven slowly in open loop: the stage sticks where friction is high.

Section 8.3 of the stack actuator thesis: 3 V, slightly more than the dead zone, gives no motion at
all, or motion that gets stuck before the end. No friction is printed; `friction_along` draws one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuators.ultrasonic.characteristic import DEAD_ZONE, control_voltage, force
from actuators.ultrasonic.data_sheet import M661
from actuators.ultrasonic.driver import Driver, envelope
from actuators.ultrasonic.motion import Stage, move
from bondgraph.laws.table import TableLaw
from bondgraph.support.arrays import Array

STEP = 1e-4
STILL = 1e-4
"""m; less is no motion."""


def friction_along(
    seed: int, *, mean: float = 0.25, cell: float = 0.5e-3, travel: float = M661.travel
) -> TableLaw:
    """Dry friction over the position, straight between drawn levels.

    The levels are uniform between 0 and twice the mean, an assumption: a quarter of the push
    force, an eighth of the printed holding force.

    Parameters
    ----------
    seed : int
        Draw of the guide.
    mean : float
        N.
    cell : float
        Distance between the drawn levels, m.
    """
    n = max(round(travel / cell), 1)
    levels = np.random.default_rng(seed).uniform(0.0, 2.0 * mean, n + 1)
    return TableLaw(
        tuple(np.linspace(0.0, travel, n + 1).tolist()), tuple(levels.tolist()), unit="N"
    )


def guided_stage(seed: int, *, mean: float = 0.25, holding: float = 0.0) -> Stage:
    """Return a stage on a drawn guide that reaches the printed speed against the mean friction."""
    damping = (M661.push_force - mean) / M661.max_velocity
    return Stage(damping=damping, friction=friction_along(seed, mean=mean), holding=holding)


@dataclass(frozen=True)
class Runs:
    """Stages that were started at random places and driven by one constant voltage.

    Attributes
    ----------
    time : ndarray, shape (N + 1,), s
    position, speed : ndarray, shape (n, N + 1)
    """

    control: float
    travel: float
    time: Array
    position: Array
    speed: Array

    @property
    def final(self) -> Array:
        """Last positions, shape (n,), m."""
        return np.asarray(self.position[:, -1])

    @property
    def moved(self) -> Array:
        """Distances gone, shape (n,), m."""
        return np.asarray(self.final - self.position[:, 0])

    @property
    def not_started(self) -> float:
        """Share that never moved."""
        return float(np.mean(np.abs(self.moved) < STILL))

    @property
    def arrived(self) -> float:
        """Share at the end stop that the voltage drives to."""
        return float(np.mean(self._at_end))

    @property
    def stuck(self) -> float:
        """Share that moved and stands before the end."""
        still = np.abs(self.speed[:, -1]) < 1e-9
        return float(np.mean(still & ~self._at_end & (np.abs(self.moved) >= STILL)))

    @property
    def _at_end(self) -> Array:
        left = self.final if self.control < 0 else self.travel - self.final
        return np.asarray(left <= 1e-9 * self.travel)

    @property
    def spread(self) -> float:
        """Standard deviation of the last positions, m."""
        return float(np.std(self.final))

    @property
    def relative_spread(self) -> float:
        """Standard deviation of the distances over their mean; infinite if nothing moved."""
        mean = abs(float(np.mean(self.moved)))
        return float(np.std(self.moved)) / mean if mean > 0 else float("inf")


def constant_voltage(
    control: float,
    *,
    duration: float = 0.6,
    runs: int = 64,
    seed: int = 0,
    stage: Stage | None = None,
    driver: Driver | None = None,
    starts: float = 0.5,
) -> Runs:
    """Drive `runs` stages from random places with one voltage that is switched on at 0 s.

    Parameters
    ----------
    control : float
        V; negative drives towards the low end.
    duration : float
        s.
    seed : int
        Draw of the starts and, unless `stage` is given, of the friction.
    starts : float
        Share of the travel, from the low end, in which the starts lie.
    """
    stage = guided_stage(seed) if stage is None else stage
    count = round(duration / STEP)
    time = np.arange(count + 1) * STEP
    command = np.full(count + 1, control)
    command[0] = 0.0
    amplitude = envelope(time, command, driver)[1:]
    start = np.random.default_rng([seed, 1]).uniform(0.0, starts * stage.travel, runs)
    rest = np.clip(1.0 - np.abs(amplitude) / DEAD_ZONE, 0.0, 1.0)
    position, speed = move(stage, start, force(amplitude), STEP, rest)
    return Runs(control, stage.travel, time, position, speed)


def lowest_sure_voltage(stage: Stage, largest: float = 1.0) -> float:
    """Voltage whose force is the highest friction along the way, V."""
    highest = max(stage.friction.values) if isinstance(stage.friction, TableLaw) else stage.friction
    return float(control_voltage(highest, largest))


def speed_at_sure_voltage(stage: Stage) -> float:
    """Speed that the lowest sure force reaches where friction is lowest, m/s.

    Slower cannot be commanded in open loop without sticking somewhere.
    """
    if not isinstance(stage.friction, TableLaw):
        return 0.0
    return (max(stage.friction.values) - min(stage.friction.values)) / stage.damping
