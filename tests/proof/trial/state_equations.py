"""State equations of the plants for the sparse regression: known linear terms and ports.

The regression is given every state. They are not in the recordings, so they are made from all
sensors by smoothing (Savitzky and Golay, 7 samples, cubic), by integration where a store has no
sensor, and from the known structure of the plant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import detrend, savgol_filter

from bondgraph.support.arrays import FloatArray as Array

Readings = Mapping[str, Array]
WINDOW, ORDER = 7, 3


@dataclass(frozen=True, eq=False)
class Port:
    """A variable whose nonlinear functions are candidates.

    Attributes
    ----------
    kind : str
        ``spring``, ``friction``, ``flow``, ``resistor``, ``source`` or ``ratio``.
    with_signal : ndarray or None
        Ratios: what the ratio multiplies.
    """

    element: str
    kind: str
    value: Array
    with_signal: Array | None = None


@dataclass(frozen=True, eq=False)
class Equation:
    """Rate of one state, its known linear terms, the ports that act on it."""

    rate: Array
    linear: tuple[Array, ...]
    ports: tuple[Port, ...]


def smooth(y: Array, dt: float, order: int = 0) -> Array:
    """Return the reading or one of its rates."""
    return np.asarray(savgol_filter(y, WINDOW, ORDER, deriv=order, delta=dt))


def integral(y: Array, dt: float) -> Array:
    """Return the integral, without the slow wander that offsets leave in it."""
    return np.asarray(detrend(cumulative_trapezoid(y, dx=dt, initial=0.0)))


def chain(u: Array, y: Readings, dt: float) -> tuple[Equation, ...]:
    """Accelerations of the masses."""
    x, v, a = ([smooth(y[f"x_{i}"], dt, k) for i in (1, 2, 3)] for k in (0, 1, 2))
    stretch = [x[0], x[1] - x[0], x[2] - x[1]]
    speed = [v[0], v[1] - v[0], v[2] - v[1]]
    springs = [Port(f"k_{i + 1}", "spring", stretch[i]) for i in range(3)]
    dampers = [Port(f"b_{i + 1}", "friction", speed[i]) for i in range(3)]

    def at(i: int, *more: Array) -> tuple[tuple[Array, ...], tuple[Port, ...]]:
        ends = [j for j in (i, i + 1) if j < 3]
        linear = [s for j in ends for s in (stretch[j], speed[j])]
        return (*linear, *more), tuple(p for j in ends for p in (springs[j], dampers[j]))

    first, second, third = at(0, u), at(1), at(2)
    return (
        Equation(a[0], first[0], (*first[1], Port("F", "source", u))),
        Equation(a[1], *second),
        Equation(a[2], *third),
    )


def stack(u: Array, y: Readings, dt: float) -> tuple[Equation, ...]:
    """Rate of the current, acceleration of the mass; the voltage of ``C_a`` from Ohm's law."""
    i, x = smooth(y["i"], dt), smooth(y["x"], dt)
    v, a = smooth(y["x"], dt, 1), smooth(y["x"], dt, 2)
    voltage = u - 20.0 * i
    electrical = (
        Port("C_a", "spring", voltage),
        Port("R_a", "resistor", i),
        Port("V", "source", u),
    )
    mechanical = (
        Port("k", "spring", x),
        Port("b", "friction", v),
        Port("alpha", "ratio", x, voltage),
    )
    return (
        Equation(smooth(y["i"], dt, 1), (smooth(u, dt, 1), i, v), electrical),
        Equation(a, (u, i, x, v), mechanical),
    )


def motor(u: Array, y: Readings, dt: float) -> tuple[Equation, ...]:
    """Rates of the current and of both speeds; the gear's ratio from the slow speeds."""
    i, w_1, w_2 = (smooth(y[n], dt) for n in ("i", "w_1", "w_2"))
    ratio = float(w_1 @ w_2) / max(float(w_2 @ w_2), 1e-300)
    rate = w_1 / ratio - w_2
    twist = integral(rate, dt)
    shaft = (Port("k_s", "spring", twist), Port("b_s", "friction", rate))
    winding = (Port("R_w", "resistor", i), Port("u", "source", u), Port("K_m", "ratio", i, w_1))
    return (
        Equation(smooth(y["i"], dt, 1), (u, i, w_1), winding),
        Equation(
            smooth(y["w_1"], dt, 1), (i, w_1, twist, rate), (Port("b_1", "friction", w_1), *shaft)
        ),
        Equation(
            smooth(y["w_2"], dt, 1), (w_2, twist, rate), (Port("b_2", "friction", w_2), *shaft)
        ),
    )


def corner(u: Array, y: Readings, dt: float) -> tuple[Equation, ...]:
    """Accelerations of wheel and body; the tyre's deflection by integration."""
    wheel, body, stroke = (smooth(y[n], dt) for n in ("v_u", "v_b", "s_d"))
    squash, rate, travel = integral(u - wheel, dt), u - wheel, wheel - body
    tyre = (Port("k_t", "spring", squash), Port("b_t", "friction", rate), Port("v_r", "source", u))
    seat = (Port("k_s", "spring", stroke), Port("b_s", "friction", travel))
    return (
        Equation(smooth(y["v_u"], dt, 1), (squash, rate, stroke, travel), (*tyre, *seat)),
        Equation(smooth(y["v_b"], dt, 1), (stroke, travel), seat),
    )


def tanks(u: Array, y: Readings, dt: float) -> tuple[Equation, ...]:
    """Rates of the pressures; a pipe's flow is taken as its pressure difference."""
    p = [smooth(y[f"p_{i}"], dt) for i in (1, 2, 3)]
    rates = [smooth(y[f"p_{i}"], dt, 1) for i in (1, 2, 3)]
    first, second = p[0] - p[1], p[1] - p[2]
    room = [Port(f"C_{i + 1}", "spring", p[i]) for i in range(3)]
    pipes = (Port("R_12", "flow", first), Port("R_23", "flow", second), Port("R_out", "flow", p[2]))
    return (
        Equation(rates[0], (u, first), (room[0], pipes[0], Port("q_in", "source", u))),
        Equation(rates[1], (first, second), (room[1], pipes[0], pipes[1])),
        Equation(rates[2], (second, p[2]), (pipes[1], pipes[2])),
    )


def probe(u: Array, y: Readings, dt: float) -> tuple[Equation, ...]:
    """Acceleration of the mass, rate of the filter's voltage, which is the coil's current."""
    x, v, a = (smooth(y["x"], dt, k) for k in (0, 1, 2))
    voltage, current = smooth(y["v_f"], dt), smooth(y["v_f"], dt, 1)
    body = (Port("k", "spring", x), Port("b", "friction", v), Port("F", "source", u))
    coil = (
        Port("C_f", "spring", voltage),
        Port("R_g", "resistor", current),
        Port("K_g", "ratio", x, v),
    )
    return Equation(a, (u, x, v, current), body), Equation(current, (v, voltage), coil)


EQUATIONS: Mapping[str, Callable[[Array, Readings, float], tuple[Equation, ...]]] = (
    MappingProxyType(
        {
            "chain": chain,
            "stack": stack,
            "motor": motor,
            "corner": corner,
            "tanks": tanks,
            "probe": probe,
        }
    )
)
"""By plant."""
