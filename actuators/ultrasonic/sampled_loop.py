"""What sample rate a position loop needs: phase margin with hold and delay, exact poles.

The loop asks the interferometer for a position, computes a force, and holds it: the hold costs
half a sample of delay, transport and computing the rest. The plant is ``1 / (m s^2 + b s)``, the
actuator behind the inverse of its characteristic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import degrees, exp, pi, sqrt

import numpy as np

from actuators.ultrasonic.data_sheet import M661
from actuators.ultrasonic.stage import MOVED_MASS
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput

MARGIN = 45.0
"""Degrees; a usual demand that keeps the overshoot of a step near a quarter."""


@dataclass(frozen=True)
class PositionController:
    """Force (N) from a reading x and its error e = r - x (m), sample by sample.

    ``K (e_k + T / T_i (e_0 + .. + e_(k-1)) - T_d (x_k - x_(k-1)) / T) + breakaway sign(e_k)``,
    limited to the push force. The derivative is of the reading, so a step of the reference r does
    not kick. The sum is over the errors *before* the present one, less those at which the force
    was at its limit in their direction or which lay within `Sampling.tolerance`; there the force
    is 0. `with_present_error` gives the controller that acts as if the present one were in the
    sum, the convention of `actuators.compensation`.

    Parameters
    ----------
    gain : float
        ``K``, N/m.
    integral : float
        ``T_i``, s; infinite leaves it out.
    derivative : float
        ``T_d``, s.
    breakaway: float
        Force added towards the target, N, to overcome dry friction; the linear analysis has
        neither.
    """

    gain: float
    integral: float = float("inf")
    derivative: float = 0.0
    breakaway: float = 0.0

    def __post_init__(self) -> None:
        """Refuse signs that cannot be stable."""
        if not (self.gain > 0 and self.integral > 0 and min(self.derivative, self.breakaway) >= 0):
            raise UnusableInput(f"Controller: gain and integral > 0, the others >= 0, not {self}")


def with_present_error(c: PositionController, rate: float) -> PositionController:
    """Return the controller whose sum before now equals that of `c` with the present error in it.

    From ``K (1 + (T / T_i) z / (z - 1))``: gain and integral time grow by ``1 + T / T_i``.
    """
    more = 1 + 1 / (rate * c.integral)
    return replace(
        c, gain=c.gain * more, integral=c.integral * more, derivative=c.derivative / more
    )


@dataclass(frozen=True)
class SampledLoop:
    """A controller, the linear stage and the way between them.

    Parameters
    ----------
    delay : int
        Whole samples between the reading and the force that it causes; 1 means that a reading is
        fetched during one sample and acted on at the next.
    """

    controller: PositionController
    mass: float = MOVED_MASS
    damping: float = M661.damping
    delay: int = 1

    def __post_init__(self) -> None:
        """Refuse a delay that is no count."""
        if self.delay < 0 or not min(self.mass, self.damping) > 0:
            raise UnusableInput(f"Loop: mass and damping > 0, delay >= 0 samples, not {self}")

    @property
    def time_constant(self) -> float:
        """``m / b``, s."""
        return self.mass / self.damping


def designed(
    crossover: float,
    *,
    mass: float = MOVED_MASS,
    damping: float = M661.damping,
    delay: int = 1,
    integral: float = 10.0,
    derivative: float = 0.0,
) -> SampledLoop:
    """Loop with its crossover at a wanted frequency (Hz) if it were not sampled.

    Parameters
    ----------
    integral : float
        ``T_i`` times the crossover (rad/s): 10 costs 6 degrees.
    derivative : float
        ``T_d``, s; ``m / b`` cancels the pole of the stage.
    """
    if not (crossover > 0 and integral > 0):
        raise UnusableInput("designed: crossover and integral have to be > 0")
    w = 2 * pi * crossover
    lead = w * derivative - 1 / integral
    gain = w * sqrt((mass * w) ** 2 + damping**2) / sqrt(1 + lead**2)
    return SampledLoop(PositionController(gain, integral / w, derivative), mass, damping, delay)


def _held(loop: SampledLoop, period: float) -> tuple[Array, Array]:
    """Exact step of (x, v) under a force held for `period`."""
    tau, b = loop.time_constant, loop.damping
    phi = exp(-period / tau)
    a = np.array([[1.0, tau * (1 - phi)], [0.0, phi]])
    return a, np.array([(period - tau * (1 - phi)) / b, (1 - phi) / b])


def open_loop_response(loop: SampledLoop, rate: float, frequency: Array) -> Array:
    """Complex loop gain at frequencies (Hz) below half the rate: sampled, held, delayed; exact."""
    period = 1 / rate
    z = np.exp(2j * pi * np.asarray(frequency, float) * period)
    a, g = _held(loop, period)
    plant = g[0] / (z - 1) + a[0, 1] * g[1] / ((z - 1) * (z - a[1, 1]))
    c = loop.controller
    control = 1 + period / c.integral / (z - 1) + c.derivative / period * (1 - 1 / z)
    return np.asarray(c.gain * control * plant * z**-loop.delay)


def phase_margin(loop: SampledLoop, rate: float) -> float:
    """Phase margin (degrees) of the sampled loop at its last crossing of gain 1.

    Minus infinity if the gain never falls below 1.
    """
    f = np.geomspace(1e-7, 0.4999, 4000) * rate
    response = open_loop_response(loop, rate, f)
    above = np.flatnonzero(np.abs(response) > 1)
    if above.size == 0 or above[-1] == f.size - 1:
        return float("-inf")
    i = int(above[-1])
    phase = np.unwrap(np.angle(response))
    phase -= 2 * pi * round((phase[0] + pi) / (2 * pi))
    size = np.log(np.abs(response[i : i + 2]))
    share = size[0] / (size[0] - size[1])
    return degrees(phase[i] + share * (phase[i + 1] - phase[i])) + 180.0


def closed_loop_matrix(loop: SampledLoop, rate: float) -> Array:
    """Step of the closed linear loop; states: x, v, integral, last x, forces under way."""
    period, c, d = 1 / rate, loop.controller, loop.delay
    a, g = _held(loop, period)
    n = 4 + d
    m = np.zeros((n, n))
    command = np.zeros(n)
    command[[0, 2, 3]] = (
        -c.gain * (1 + c.derivative / period),
        c.gain,
        c.gain * c.derivative / period,
    )
    acting = command if d == 0 else np.eye(n)[4]
    m[:2, :2] = a
    m[:2] += np.outer(g, acting)
    m[2, 2] = 1.0
    m[2, 0] = -period / c.integral
    m[3, 0] = 1.0
    for k in range(d):
        m[4 + k] = command if k == d - 1 else np.eye(n)[5 + k]
    return m


def spectral_radius(loop: SampledLoop, rate: float) -> float:
    """Largest pole of the closed linear loop; below 1 it is stable."""
    return float(np.abs(np.linalg.eigvals(closed_loop_matrix(loop, rate))).max())


def stability_rate(loop: SampledLoop, *, present: bool = False) -> float:
    """Lowest sample rate (Hz) above which the linear loop is stable, by its exact poles.

    With `present` the integral holds the present error too.
    """

    def excess(rate: float) -> float:
        acting = with_present_error(loop.controller, rate) if present else loop.controller
        return 1.0 - spectral_radius(replace(loop, controller=acting), rate)

    return _lowest(excess, loop)


def margin_rate(loop: SampledLoop, margin: float = MARGIN) -> float:
    """Lowest sample rate (Hz) above which the sampled loop has `margin` degrees; exact."""
    return _lowest(lambda rate: max(phase_margin(loop, rate), -360.0) - margin, loop)


def _lowest(excess: Callable[[float], float], loop: SampledLoop) -> float:
    from scipy.optimize import brentq

    start = 1.0 / (1.5 * loop.time_constant)
    rates = np.geomspace(1e-3 * start, 1e3 * start, 121)
    good = np.array([excess(float(r)) > 0 for r in rates])
    if not good[-1]:
        raise UnusableInput(
            "the loop meets the demand at no sample rate; lower its crossover or add a derivative"
        )
    bad = np.flatnonzero(~good)
    if bad.size == 0:
        return float(rates[0])
    i = int(bad[-1])
    return float(brentq(excess, rates[i], rates[i + 1], rtol=1e-6))
