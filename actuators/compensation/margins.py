"""Gain, phase and delay margins of the sampled loop, and gains that keep them.

The loop: the measurement arrives one sample late, the controller is
``kp e + ki dt (sum of e)``, the converter holds, the actuator is linear for small signals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import expm

from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

_POINTS = 6000
_SHAPES = 25


@dataclass(frozen=True, slots=True)
class ProportionalIntegral:
    """Discrete proportional-integral controller.

    Parameters
    ----------
    proportional : float
        kp, command per error.
    integral : float
        ki, 1/s.
    """

    n_states: ClassVar[int] = 1

    proportional: float = 0.0
    integral: float = 0.0

    def decide(self, error: Any, state: Any, step: float) -> tuple[Any, Any]:
        """Return what is added to the command, and the next sum of errors."""
        total = state + self.integral * step * error
        return self.proportional * error + total, total

    def unwound(self, state: Any, missing: Any, step: float) -> Any:
        """Return the sum without what could not be reached.

        It is taken back with the controller's own time constant.
        """
        if not self.integral:
            return state
        kp = self.proportional
        return state + (min(1.0, self.integral * step / kp) if kp else 1.0) * missing


OPEN = ProportionalIntegral()
"""No feedback."""


@dataclass(frozen=True, slots=True)
class SampledPlant:
    """A linear plant behind a hold, ``x+ = A x + b u``, ``y = c x``, its gain included.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n,)
    c : ndarray, shape (n,)
    step : float
        s.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    step: float

    @classmethod
    def from_continuous(
        cls, a: FloatArray, b: FloatArray, c: FloatArray, step: float
    ) -> SampledPlant:
        """Discretise ``x' = a x + b u`` for an input held over `step` s, exactly."""
        n = a.shape[0]
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = a, b
        both = expm(block * step)
        return cls(both[:n, :n], both[:n, n], c, step)

    def scaled(self, gain: float) -> SampledPlant:
        """Return the plant with its output multiplied."""
        return SampledPlant(self.a, self.b, gain * self.c, self.step)

    @property
    def static_gain(self) -> float:
        """Output per constant input."""
        return float(self.c @ np.linalg.solve(np.eye(self.b.size) - self.a, self.b))

    def response(self, omega: FloatArray) -> np.ndarray:
        """Return the frequency response, complex, shape of `omega` (rad/s)."""
        z = np.exp(1j * omega * self.step)
        shifted = z[:, None, None] * np.eye(self.b.size) - self.a
        states = np.linalg.solve(shifted, self.b[:, None].astype(complex)[None])
        return np.asarray(states[:, :, 0] @ self.c)


@dataclass(frozen=True, slots=True)
class Margins:
    """How far a loop is from instability.

    Attributes
    ----------
    gain : float
        Factor on the loop gain at which it becomes unstable; inf if none does.
    phase : float
        Smallest distance from -180 degrees where the loop gain is 1, degrees.
    delay : float
        Additional delay that makes it unstable, s.
    crossover : float
        Highest frequency with loop gain 1, Hz; nan if there is none.
    resonance : float
        Loop gain at the highest peak above the first crossover.
    radius : float
        Largest modulus of the closed loop's poles: stable below 1.
    """

    gain: float
    phase: float
    delay: float
    crossover: float
    resonance: float
    radius: float


def margins(plant: SampledPlant, controller: ProportionalIntegral) -> Margins:
    """Return the margins of the loop of a controller and a plant.

    Parameters
    ----------
    plant : SampledPlant
    controller : ProportionalIntegral

    Raises
    ------
    UnusableInput
        If the controller is off.
    """
    if controller == OPEN:
        raise UnusableInput("margins: both gains of the controller are 0, there is no loop")
    omega = _grid(plant)
    loop = plant.response(omega) * _controller(controller, omega, plant.step)
    return _margins(omega, loop, pole_radius(plant, controller))


def choose_gains(
    plants: Sequence[SampledPlant], *, gain: float = 2.0, phase: float = 60.0
) -> ProportionalIntegral:
    """Return a controller with as much integral gain as the margins of all plants allow.

    For each of a row of ratios kp/ki the largest admissible gain is found by bisection. The
    integral gain sets the error in slow motion; of the ratios within 5 % of the best the one with
    the most proportional part is taken, for its phase lead. A resonance must stay below
    ``1 / gain`` whatever its phase, because payload and hysteresis move it.

    Parameters
    ----------
    plants : sequence of SampledPlant
        Of one sample step.
    gain : float
        Least gain margin, a factor.
    phase : float
        Least phase margin, degrees.

    Raises
    ------
    UnusableInput
        If no gain keeps the margins.
    """
    step = plants[0].step
    tables = [(grid := _grid(p), p.response(grid)) for p in plants]
    found = [OPEN]
    for ratio in (0.0, *np.geomspace(0.05 * step, 200.0 * step, _SHAPES)):
        shapes = [_controller(ProportionalIntegral(ratio, 1.0), w, step) * g for w, g in tables]

        def admissible(
            ki: float, shapes: Sequence[np.ndarray] = shapes, ratio: float = ratio
        ) -> bool:
            for plant, (w, _), shape in zip(plants, tables, shapes, strict=True):
                m = _margins(
                    w, ki * shape, pole_radius(plant, ProportionalIntegral(ki * ratio, ki))
                )
                if m.radius >= 1.0 or m.phase < phase or max(1.0 / m.gain, m.resonance) > 1 / gain:
                    return False
            return True

        low, high = 1e-3 / step, 10.0 / step
        if not admissible(low):
            continue
        while high / low > 1.001:
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if admissible(middle) else (low, middle)
        found.append(ProportionalIntegral(float(ratio) * low, low))
    most = max(c.integral for c in found)
    if most == 0.0:
        raise UnusableInput(
            f"no gains keep a gain margin of {gain:g} and a phase margin of {phase:g} degrees; "
            "sample faster or ask for less"
        )
    return max((c for c in found if c.integral >= 0.95 * most), key=lambda c: c.proportional)


def _grid(plant: SampledPlant) -> FloatArray:
    """Frequencies up to half the sample rate, dense around the plant's resonances."""
    top = np.pi / plant.step
    wide = np.geomspace(1e-5 * top, top, _POINTS)
    discrete = np.linalg.eigvals(plant.a).astype(complex)
    poles = np.log(discrete[np.abs(discrete) > 1e-9]) / plant.step  # the others are pure delays
    near = [
        abs(p.imag) + abs(p.real) * np.linspace(-8.0, 8.0, 801) for p in poles if abs(p.imag) > 0.0
    ]
    grid = np.unique(np.concatenate([wide, *near]))
    return np.asarray(grid[(grid >= wide[0]) & (grid <= top)])


def _controller(controller: ProportionalIntegral, omega: FloatArray, step: float) -> np.ndarray:
    z = np.exp(1j * omega * step)
    total = controller.proportional + controller.integral * step * z / (z - 1.0)
    return np.asarray(total / z)


def _margins(omega: FloatArray, loop: np.ndarray, radius: float) -> Margins:
    size, angle = np.abs(loop), np.unwrap(np.angle(loop))
    # crossings of an odd multiple of 180 degrees
    at = np.flatnonzero(np.diff(np.floor((angle + np.pi) / (2.0 * np.pi))))
    worst = float(np.maximum(size[at], size[at + 1]).max(initial=0.0))
    if loop[-1].real < 0.0:  # the response is real at half the sample rate
        worst = max(worst, float(size[-1]))
    gain = 1.0 / worst if worst else np.inf
    inner = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])
    peaks = np.append(np.flatnonzero(inner) + 1, size.size - 1)
    ones = np.flatnonzero(np.diff(np.sign(size - 1.0)))
    if not ones.size:
        highest = float(size[peaks].max())
        return Margins(gain, np.inf, np.inf, np.nan, highest, radius)
    share = (1.0 - size[ones]) / (size[ones + 1] - size[ones])
    crossing = omega[ones] + share * (omega[ones + 1] - omega[ones])
    phases = np.mod(angle[ones] + share * (angle[ones + 1] - angle[ones]) + np.pi, 2.0 * np.pi)
    nearest = np.minimum(phases, 2.0 * np.pi - phases)
    return Margins(
        gain=gain,
        phase=float(np.degrees(nearest.min())),
        delay=float((phases / crossing).min()),
        crossover=float(crossing.max() / (2.0 * np.pi)),
        resonance=float(size[peaks[peaks > ones[0]]].max()),
        radius=radius,
    )


def pole_radius(plant: SampledPlant, controller: ProportionalIntegral) -> float:
    """Return the largest modulus of the closed loop's poles; below 1 it is stable.

    The states are those of the plant, the last error and the sum of errors.
    """
    n = plant.b.size
    kp, step_gain = controller.proportional, controller.integral * plant.step
    closed = np.zeros((n + 2, n + 2))
    command = np.zeros(n + 2)
    command[n], command[n + 1] = kp + step_gain, 1.0
    closed[:n, :n] = plant.a
    closed[:n] += np.outer(plant.b, command)
    closed[n, :n] = -plant.c
    closed[n + 1, n], closed[n + 1, n + 1] = step_gain, 1.0
    return float(np.abs(np.linalg.eigvals(closed)).max())
