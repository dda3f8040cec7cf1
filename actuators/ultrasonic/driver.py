"""The driver's answer to the control voltage: a first-order lag that cannot go faster than a slew.

The text of the stack actuator thesis (section 8.2.3, figure 8.8) gives two facts and no time
scale: from -9 V to 9 V the output settles in about twice the time it takes from -4 V to 4 V, and
the opposite direction takes about 0.1 ms longer. A linear lag would settle in the same time, a
pure slew in 9/4 of it; a slew behind a lag lies between and can have both facts. The lag is the
build-up of the plate's vibration, ``Q / (pi f)``: an assumption that sets the scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import log, pi
from typing import Any

import numpy as np

from actuators.ultrasonic.data_sheet import M661
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput

BAND = 0.05
"""Settled means within this share of the step."""
LOADED_Q = 100.0
"""Of the pressed plate; an assumption within the 65 to 350 of thesis table 2.1."""


@dataclass(frozen=True)
class Driver:
    """Signed amplitude of the output, in volts of control voltage.

    Positive amplitude excites one front electrode, negative the other; zero is passed between.

    Parameters
    ----------
    lag : float
        Time constant, s.
    upward, downward : float
        Slew limits towards positive and towards negative amplitude, V/s.
    """

    lag: float
    upward: float
    downward: float

    def __post_init__(self) -> None:
        """Refuse a driver that stands still."""
        if not min(self.lag, self.upward, self.downward) > 0:
            raise UnusableInput(f"Driver: lag and both slews have to be > 0, not {self}")

    def settling_time(self, start: float, end: float, band: float = BAND) -> float:
        """Time (s) after a step until the amplitude stays within `band` times the step."""
        step = abs(end - start)
        knee = self.lag * (self.upward if end > start else self.downward)
        slewing = max(step - knee, 0.0)
        if slewing > (1.0 - band) * step:
            return (1.0 - band) * step * self.lag / knee
        return self.lag * (slewing / knee + log((step - slewing) / (band * step)))


def build_up_time(quality: float = LOADED_Q, frequency: float = M661.frequency) -> float:
    """Time constant of the vibration's amplitude, ``Q / (pi f)``, s."""
    return quality / (pi * frequency)


def fitted_driver(
    lag: float | None = None,
    *,
    ratio: float = 2.0,
    longer: float = 0.1e-3,
    small: float = 4.0,
    large: float = 9.0,
) -> Driver:
    """Driver with the two facts of figure 8.8, for a given time constant.

    Parameters
    ----------
    lag : float, optional
        s; the build-up time when left out.
    ratio : float
        Settling time from ``-large`` to ``large`` over that from ``-small`` to ``small``.
    longer : float
        What the large step takes more in the opposite direction, s.

    Raises
    ------
    UnusableInput
        No slew gives the ratio: it has to lie between 1 (all lag) and ``large / small`` (all slew).
    """
    from scipy.optimize import brentq

    tau = build_up_time() if lag is None else lag
    if not 1.0 < ratio < large / small:
        raise UnusableInput(
            f"fitted_driver: a ratio of {ratio:g} needs no slew or no lag; between 1 and "
            f"{large / small:g} it can be had"
        )

    def excess(knee: float) -> float:
        d = Driver(tau, knee / tau, knee / tau)
        return d.settling_time(-large, large) / d.settling_time(-small, small) - ratio

    # below a knee of 2 * BAND * small everything is slew; from 2 * large on everything is lag
    grid = np.geomspace(2 * BAND * small, 2 * large, 400)
    values = np.array([excess(k) for k in grid])
    last = int(np.flatnonzero(values > 0)[-1])
    knee = float(brentq(excess, grid[last], grid[last + 1]))
    up = knee / tau
    wanted = Driver(tau, up, up).settling_time(-large, large) + longer
    down = float(
        brentq(
            lambda s: Driver(tau, up, s).settling_time(large, -large) - wanted,
            1e-3 * up,
            up * (1 + 1e-9) if longer > 0 else 1e3 * up,
        )
    )
    return Driver(tau, up, down)


def settled_step(ca: Any, a: Any, command: Any, h: float, driver: Driver) -> Any:
    """Amplitude after `h` seconds under a held command: slew, then lag; exact (CasADi)."""
    gap = command - a
    size = ca.fabs(gap)
    slew = ca.if_else(gap > 0, driver.upward, driver.downward)
    slewing = ca.fmax(0.0, ca.fmin(h, size / slew - driver.lag))
    left = (size - slew * slewing) * ca.exp(-(h - slewing) / driver.lag)
    return command - ca.sign(gap) * left


def envelope(time: Array, control: Array, driver: Driver | None = None) -> Array:
    """Signed amplitude (V of control voltage), shape (N,), of a command held between samples.

    Parameters
    ----------
    time : ndarray, shape (N,), s
        Even grid.
    control : ndarray, shape (N,), V
        The driver clips it to 10 V; it starts settled at the first value.
    """
    driver = fitted_driver() if driver is None else driver
    time, control = np.asarray(time, float), np.asarray(control, float)
    if time.ndim != 1 or time.shape != control.shape or time.size < 2:
        raise UnusableInput(
            f"envelope: time has shape {time.shape}, control {control.shape}; give two equal "
            "rows of at least two samples"
        )
    command = np.clip(control, -M661.control, M661.control)
    run = _runner(driver, float(time[1] - time[0]), time.size - 1)
    later = np.asarray(run(command[0], command[None, :-1]).full()).ravel()
    return np.concatenate([command[:1], later])


@lru_cache(maxsize=16)
def _runner(driver: Driver, h: float, count: int) -> Any:
    import casadi as ca

    a, c = ca.SX.sym("a"), ca.SX.sym("c")
    return ca.Function("driver", [a, c], [settled_step(ca, a, c, h, driver)]).mapaccum(count)
