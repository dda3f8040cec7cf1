"""The position loop around the nonlinear actuator, one reading of the interferometer a sample.

Between two samples the driver, the characteristic and the stage move in steps of at most 0.1 ms;
the whole record is one compiled call.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np

from actuators.ultrasonic.characteristic import DEAD_ZONE, SHARE, VOLTAGE, voltage_force
from actuators.ultrasonic.data_sheet import M661
from actuators.ultrasonic.driver import Driver, fitted_driver, settled_step
from actuators.ultrasonic.motion import Stage, moved
from actuators.ultrasonic.sampled_loop import PositionController
from bondgraph.laws.table import TableLaw
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import CASADI

FINEST = 1e-4
"""Longest step between samples, s."""


@dataclass(frozen=True)
class Sampling:
    """How positions come in and forces go out.

    Parameters
    ----------
    rate : float
        Readings a second, Hz.
    delay : int
        Whole samples from a reading to the force it causes.
    resolution : float
        Of a reading, m; 1 nm as printed for the interferometer.
    tolerance : float
        Error within which the drive is switched off and the integral rests, m.
    """

    rate: float
    delay: int = 1
    resolution: float = 1e-9
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a clock that stands."""
        if not (self.rate > 0 and self.delay >= 0 and self.resolution > 0 and self.tolerance >= 0):
            raise UnusableInput(f"Sampling: rate, resolution > 0, delay, tolerance >= 0: {self}")


@dataclass(frozen=True)
class Answer:
    """A step of the reference and what followed.

    Attributes
    ----------
    time, position : ndarray, shape (N,)
        Between the samples too; s and m.
    start, target : float
        m.
    """

    time: Array
    position: Array
    start: float
    target: float

    @property
    def overshoot(self) -> float:
        """Share of the step by which the target is passed."""
        step = self.target - self.start
        return max(float(np.max((self.position - self.target) / step)), 0.0)

    @property
    def swing(self) -> float:
        """Peak to peak in the last quarter, m: 0 at rest, the limit cycle otherwise."""
        return float(np.ptp(self.position[-self.position.size // 4 :]))

    @property
    def error(self) -> float:
        """Largest distance from the target in the last quarter, m."""
        late = self.position[-self.position.size // 4 :]
        return float(np.max(np.abs(late - self.target)))

    def settling_time(self, band: float = 0.05) -> float:
        """Time (s) until the position stays within `band` of the step.

        Infinite if it still leaves the band in the last quarter.
        """
        outside = np.abs(self.position - self.target) > band * abs(self.target - self.start)
        last = np.flatnonzero(outside)
        if last.size == 0:
            return 0.0
        late = last[-1] >= 0.75 * outside.size
        return float("inf") if late else float(self.time[last[-1] + 1])


def step_answer(
    controller: PositionController,
    sampling: Sampling,
    *,
    stage: Stage | None = None,
    driver: Driver | None = None,
    start: float = 8e-3,
    step: float = 1e-3,
    duration: float = 1.5,
) -> Answer:
    """Position after a step of the reference from a stage at rest.

    Parameters
    ----------
    start, step : float
        m; both ends have to lie within the travel.
    duration : float
        s.
    """
    stage = Stage() if stage is None else stage
    target = start + step
    if not (0 <= min(start, target) and max(start, target) <= stage.travel and step):
        raise UnusableInput(
            f"step_answer: from {start:g} m by {step:g} m is no step within 0 to {stage.travel:g} m"
        )
    count = max(ceil(duration * sampling.rate), 4)
    inner = max(ceil(1 / (sampling.rate * FINEST)), 1)
    run = _runner(controller, sampling, stage, driver or fitted_driver(), inner, count)
    state = np.zeros(5 + sampling.delay)
    state[0] = state[4] = start
    _, fine = run(state, np.full((1, count), target))
    path = np.concatenate([[start], np.asarray(fine.full()).ravel(order="F")])
    return Answer(np.arange(path.size) / (sampling.rate * inner), path, start, target)


@lru_cache(maxsize=64)
def _runner(
    controller: PositionController,
    sampling: Sampling,
    stage: Stage,
    driver: Driver,
    inner: int,
    count: int,
) -> Any:
    """``(state, references) -> (states, positions between samples)``.

    State: x, v, amplitude, integral, last reading, forces under way.
    """
    import casadi as ca

    d = sampling.delay
    decide = decision(ca, controller, sampling)
    motion = _motion(ca, stage, driver, 1 / (sampling.rate * inner)).mapaccum(inner)
    z, r = ca.MX.sym("z", 5 + d), ca.MX.sym("r")
    wanted, integral, reading = decide(z[0], z[3], z[4], r)
    under_way = ca.vertcat(z[5:], wanted)
    volt = _inverse(ca)(under_way[0])
    path = motion(z[:3], ca.repmat(volt, 1, inner))
    after = ca.vertcat(path[:, -1], integral, reading, under_way[1:])
    sample = ca.Function("sample", [z, r], [after, path[0, :].T])
    return sample.mapaccum(count)


def decision(ca: Any, c: PositionController, sampling: Sampling) -> Any:
    """Force from the reading; the integral stands while the force is at its limit."""
    x, integral, last, r = (ca.SX.sym(n) for n in ("x", "i", "last", "r"))
    period = 1 / sampling.rate
    reading = sampling.resolution * ca.floor(x / sampling.resolution + 0.5)
    error = r - reading
    linear = c.gain * (error + integral - c.derivative / period * (reading - last))
    wanted = linear + c.breakaway * ca.sign(error)
    force = ca.fmax(-M661.push_force, ca.fmin(M661.push_force, wanted))
    winding = (wanted - force) * error > 0
    near = ca.fabs(error) <= sampling.tolerance if sampling.tolerance else ca.SX(0)
    resting = ca.logic_or(winding, near)
    more = ca.if_else(resting, 0.0, period / c.integral * error)
    out = [ca.if_else(near, 0.0, force), integral + more, reading]
    return ca.Function("decision", [x, integral, last, r], out)


def _inverse(ca: Any) -> Any:
    """Control voltage from a force: the inverse characteristic, 0 at 0."""
    f = ca.SX.sym("f")
    rising = TableLaw(SHARE[1:-1], VOLTAGE[1:-1])
    size = rising.output(CASADI, ca.fabs(f) / M661.push_force, ())
    return ca.Function("inverse", [f], [ca.sign(f) * size])


def _motion(ca: Any, stage: Stage, driver: Driver, h: float) -> Any:
    """Driver, characteristic and stage over one short step."""
    z, volt = ca.SX.sym("z", 3), ca.SX.sym("volt")
    a = settled_step(ca, z[2], volt, h, driver)
    rest = ca.fmax(0.0, 1.0 - ca.fabs(a) / DEAD_ZONE)
    force = voltage_force().output(CASADI, a, ())
    x, v = moved(ca, stage, h, z[0], z[1], force, rest)
    return ca.Function("motion", [z, volt], [ca.vertcat(x, v, a)])
