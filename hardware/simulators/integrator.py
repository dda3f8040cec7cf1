"""Fixed-step classical Runge-Kutta marching on a grid that knows where the input has kinks.

The drive is linear inside every step (the grid has a node at each of its kinks), so the method
keeps its order.  Plain floats are used: for three to nine states they are faster than arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hardware.simulators.arrays import Array

State = tuple[float, ...]
Rate = Callable[[State, float], State]


class SteppedSystem(Protocol):
    """A set of state equations that can take one step."""

    @property
    def start(self) -> State:
        """State at the first node."""
        ...

    def current(self, y: State, u: float) -> float:
        """Charging current (A) at state ``y`` and drive ``u`` (V)."""
        ...

    def terminal_voltage(self, y: State, u: float) -> float:
        """Voltage (V) that the amplifier puts on the stack's lead."""
        ...

    def stored_energy(self, y: State) -> float:
        """Energy (J) kept in the elements of the bench."""
        ...

    def step(self, y: State, h: float, u0: float, u1: float) -> State:
        """State after ``h`` seconds; the drive goes linearly from ``u0`` to ``u1``."""
        ...


@dataclass(frozen=True, slots=True)
class MarchedPath:
    """Values at the nodes of one march.

    Parameters
    ----------
    x, i, supplied, stored
        Displacement (m), current (A), energy supplied at the terminals (J, trapezoidal sum) and
        energy stored (J); each ``(n_nodes,)``.
    """

    x: Array
    i: Array
    supplied: Array
    stored: Array


def rk4(rate: Rate, y: State, h: float, u0: float, u1: float) -> State:
    """One classical Runge-Kutta step for any number of states.

    Parameters
    ----------
    rate
        Right-hand side ``rate(y, u)``.
    y
        State at the beginning, ``(n_x,)``, SI.
    h
        Step (s).
    u0, u1
        Drive (V) at the beginning and at the end.
    """
    half, um = 0.5 * h, 0.5 * (u0 + u1)
    a = rate(y, u0)
    b = rate(tuple([s + half * d for s, d in zip(y, a, strict=True)]), um)
    c = rate(tuple([s + half * d for s, d in zip(y, b, strict=True)]), um)
    d = rate(tuple([s + h * e for s, e in zip(y, c, strict=True)]), u1)
    w = h / 6.0
    return tuple(
        [
            s + w * (k1 + 2.0 * (k2 + k3) + k4)
            for s, k1, k2, k3, k4 in zip(y, a, b, c, d, strict=True)
        ]
    )


def rk4_three(
    rate: Callable[[float, float, float, float], tuple[float, float]],
    y: State,
    h: float,
    u0: float,
    u1: float,
) -> tuple[float, float, float]:
    """One classical Runge-Kutta step of ``(q, x, v)`` with ``dx/dt = v``, written out for speed.

    Parameters
    ----------
    rate
        ``rate(q, x, v, u) -> (dq/dt, dv/dt)`` in A and m/s^2.
    y
        Charge (C), displacement (m), velocity (m/s); further entries are ignored.
    h
        Step (s).
    u0, u1
        Drive (V) at the beginning and at the end.
    """
    q, x, v = y[0], y[1], y[2]
    half, um = 0.5 * h, 0.5 * (u0 + u1)
    q1, v1 = rate(q, x, v, u0)
    vb = v + half * v1
    q2, v2 = rate(q + half * q1, x + half * v, vb, um)
    vc = v + half * v2
    q3, v3 = rate(q + half * q2, x + half * vb, vc, um)
    vd = v + h * v3
    q4, v4 = rate(q + h * q3, x + h * vc, vd, u1)
    w = h / 6.0
    return (
        q + w * (q1 + 2.0 * (q2 + q3) + q4),
        x + w * (v + 2.0 * (vb + vc) + vd),
        v + w * (v1 + 2.0 * (v2 + v3) + v4),
    )


def march(
    system: SteppedSystem, steps: Array, drive: Array, *, energy: bool = False
) -> MarchedPath:
    """Take a system over the grid.

    Parameters
    ----------
    system
        Equations and first state.
    steps
        Steps (s), ``(n_nodes - 1,)``.
    drive
        Drive (V) at the nodes, ``(n_nodes,)``.
    energy
        Whether to keep the energy ledger (zeros otherwise).
    """
    y = system.start
    step, current = system.step, system.current
    u, hs = drive.tolist(), steps.tolist()
    xs, currents = [y[1]], [current(y, u[0])]
    powers, stored = [], []
    if energy:
        powers.append(system.terminal_voltage(y, u[0]) * currents[0])
        stored.append(system.stored_energy(y))
    for n, h in enumerate(hs):
        y = step(y, h, u[n], u[n + 1])
        xs.append(y[1])
        currents.append(current(y, u[n + 1]))
        if energy:
            powers.append(system.terminal_voltage(y, u[n + 1]) * currents[-1])
            stored.append(system.stored_energy(y))
    supplied = np.zeros(len(xs))
    if energy:
        p = np.array(powers)
        supplied[1:] = np.cumsum(0.5 * steps * (p[1:] + p[:-1]))
    return MarchedPath(
        x=np.array(xs),
        i=np.array(currents),
        supplied=supplied,
        stored=np.array(stored) if energy else np.zeros(len(xs)),
    )
