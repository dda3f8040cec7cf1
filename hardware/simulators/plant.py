"""Equations of the bench: a lead, a dielectric, a transformer, a spring and a moved mass.

Written from the general bond graph of a piezo stack with its signs set for passivity::

    x1     = x - T q                          spring elongation
    F      = k x1                             spring force, opposes elongation
    R_e q' = u - q / C_q + T F                charge, i = q'
    x'     = v
    m v'   = -F - b v

so that d/dt(q^2/2C_q + k x1^2/2 + m v^2/2) = u i - R_e i^2 - b v^2.  At rest x = T q, u = q / C_q.
Each class below is this plant with one constitutive law replaced.
"""

from __future__ import annotations

import math
from abc import ABC
from dataclasses import dataclass, field

from hardware.simulators.integrator import State, rk4, rk4_three

BIAS = 50.0
"""Working point of the stack (V)."""


@dataclass(frozen=True, slots=True)
class PlantParameters:
    """Lumped parameters of a P-840.1 stack that moves a payload.

    Parameters
    ----------
    C_q
        Capacitance at constant elongation (F).
    T
        Displacement per charge (m/C).
    k
        Stiffness at constant charge (N/m).
    m
        Moved mass, payload and a third of the stack (kg).
    b
        Viscous friction (N s/m).
    R_e
        Series resistance of amplifier and lead (ohm).
    """

    C_q: float
    T: float
    k: float
    m: float
    b: float
    R_e: float

    def __post_init__(self) -> None:
        """Refuse values that are not physical."""
        for name in ("C_q", "T", "k", "m", "b", "R_e"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"PlantParameters: {name} = {value!r} must be finite and > 0")


NOMINAL = PlantParameters(C_q=1.5e-6, T=0.036, k=60e6, m=0.108, b=200.0, R_e=20.0)
"""P-840.1 with about 0.1 kg: 54 nm/V, f0 = 3.75 kHz, b/(2 sqrt(k m)) = 0.039, R_e C_q = 30 us."""


class BenchPlant(ABC):
    """What the plants share: the linear stores, and nothing between drive and lead.

    Parameters
    ----------
    plant
        Linear part; that of the fast ones where there are slow parts.
    u_start
        Voltage (V) at which the bench rests before the recording, all slow parts settled at it.
    """

    __slots__ = ()

    plant: PlantParameters
    u_start: float

    @property
    def _rest(self) -> tuple[float, float, float]:
        """Charge, displacement and velocity of the linear plant at ``u_start``."""
        q = self.plant.C_q * self.u_start
        return (q, self.plant.T * q, 0.0)

    def terminal_voltage(self, y: State, u: float) -> float:
        """Drive itself (V)."""
        return u

    def stored_energy(self, y: State) -> float:
        """Energy (J) of dielectric, spring and mass."""
        return PolynomialPlant(self.plant).stored_energy(y)


@dataclass(frozen=True, slots=True)
class PolynomialPlant(BenchPlant):
    """The plant with polynomial dielectric, spring and drag laws (all zero: the linear plant).

    Parameters
    ----------
    dielectric
        ``(c2, c3)`` of ``V_C = q/C_q + c2 r^2 + c3 r^3``, r = q - C_q BIAS (V/C^2, V/C^3).
    spring
        ``(k2, k3)`` of ``F = k x1 + k2 x1^2 + k3 x1^3`` (N/m^2, N/m^3).
    drag
        ``b2`` of ``F_R = b v + b2 v |v|`` (N s^2/m^2).
    """

    plant: PlantParameters
    dielectric: tuple[float, float] = (0.0, 0.0)
    spring: tuple[float, float] = (0.0, 0.0)
    drag: float = 0.0
    u_start: float = BIAS

    @property
    def start(self) -> State:
        """Rest at ``u_start``: Newton's method on the dielectric law."""
        p, (c2, c3) = self.plant, self.dielectric
        q, centre = p.C_q * self.u_start, p.C_q * BIAS
        for _ in range(50):
            r = q - centre
            slope = 1.0 / p.C_q + 2.0 * c2 * r + 3.0 * c3 * r * r
            q -= (q / p.C_q + c2 * r * r + c3 * r**3 - self.u_start) / slope
        return (q, p.T * q, 0.0)

    def rate(self, q: float, x: float, v: float, u: float) -> tuple[float, float]:
        """Give (dq/dt, dv/dt) in A and m/s^2."""
        p = self.plant
        x1 = x - p.T * q
        force = x1 * (p.k + x1 * (self.spring[0] + x1 * self.spring[1]))
        r = q - p.C_q * BIAS
        effort = q / p.C_q + r * r * (self.dielectric[0] + r * self.dielectric[1])
        return (u - effort + p.T * force) / p.R_e, -(force + v * (p.b + self.drag * abs(v))) / p.m

    def current(self, y: State, u: float) -> float:
        """Charging current (A)."""
        return self.rate(y[0], y[1], y[2], u)[0]

    def stored_energy(self, y: State) -> float:
        """Energy (J) of dielectric, spring and mass."""
        p = self.plant
        q, x, v = y[:3]
        x1, r = x - p.T * q, q - p.C_q * BIAS
        c2, c3 = self.dielectric
        k2, k3 = self.spring
        electric = 0.5 * q * q / p.C_q + c2 * r**3 / 3.0 + c3 * r**4 / 4.0
        return (
            electric + 0.5 * p.k * x1 * x1 + k2 * x1**3 / 3.0 + k3 * x1**4 / 4.0 + 0.5 * p.m * v * v
        )

    def step(self, y: State, h: float, u0: float, u1: float) -> State:
        """One Runge-Kutta step."""
        return rk4_three(self.rate, y, h, u0, u1)


@dataclass(frozen=True, slots=True)
class LinearPlant(BenchPlant):
    """The nominal plant, its coefficients multiplied out for speed."""

    plant: PlantParameters
    u_start: float = BIAS
    _c: tuple[float, float, float, float, float, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Multiply the coefficients out."""
        p = self.plant
        c = (
            1.0 / p.R_e,
            -(1.0 / p.C_q + p.k * p.T * p.T) / p.R_e,
            p.T * p.k / p.R_e,
            p.k * p.T / p.m,
            -p.k / p.m,
            -p.b / p.m,
        )
        object.__setattr__(self, "_c", c)

    @property
    def start(self) -> State:
        """Rest at ``u_start``."""
        return self._rest

    def current(self, y: State, u: float) -> float:
        """Charging current (A)."""
        c = self._c
        return c[0] * u + c[1] * y[0] + c[2] * y[1]

    def step(self, y: State, h: float, u0: float, u1: float) -> State:
        """One Runge-Kutta step, the four stages written out."""
        cu, cq, cx, aq, ax, av = self._c
        q, x, v = y[0], y[1], y[2]
        half, um = 0.5 * h, 0.5 * (u0 + u1)
        w = cu * um
        q1, v1 = cu * u0 + cq * q + cx * x, aq * q + ax * x + av * v
        qs, xs, vb = q + half * q1, x + half * v, v + half * v1
        q2, v2 = w + cq * qs + cx * xs, aq * qs + ax * xs + av * vb
        qs, xs, vc = q + half * q2, x + half * vb, v + half * v2
        q3, v3 = w + cq * qs + cx * xs, aq * qs + ax * xs + av * vc
        qs, xs, vd = q + h * q3, x + h * vc, v + h * v3
        q4, v4 = cu * u1 + cq * qs + cx * xs, aq * qs + ax * xs + av * vd
        w = h / 6.0
        return (
            q + w * (q1 + 2.0 * (q2 + q3) + q4),
            x + w * (v + 2.0 * (vb + vc) + vd),
            v + w * (v1 + 2.0 * (v2 + v3) + v4),
        )


@dataclass(frozen=True, slots=True)
class LaggedPlant(BenchPlant):
    """The linear plant behind an amplifier of one pole, ``tau w' = u - w``; state (q, x, v, w).

    Parameters
    ----------
    tau
        Time constant of the amplifier (s).
    """

    plant: PlantParameters
    tau: float
    u_start: float = BIAS

    @property
    def start(self) -> State:
        """Rest at ``u_start``."""
        return (*self._rest, self.u_start)

    def _rate(self, y: State, u: float) -> State:
        p = self.plant
        q, x, v, w = y
        force = p.k * (x - p.T * q)
        return (
            (w - q / p.C_q + p.T * force) / p.R_e,
            v,
            -(force + p.b * v) / p.m,
            (u - w) / self.tau,
        )

    def current(self, y: State, u: float) -> float:
        """Charging current (A)."""
        return self._rate(y, u)[0]

    def terminal_voltage(self, y: State, u: float) -> float:
        """Output of the amplifier (V)."""
        return y[3]

    def step(self, y: State, h: float, u0: float, u1: float) -> State:
        """One Runge-Kutta step."""
        return rk4(self._rate, y, h, u0, u1)


@dataclass(frozen=True, slots=True)
class CreepingPlant(BenchPlant):
    """The linear plant with Kelvin-Voigt branches in series with one storage.

    Dielectric: ``V_C = (q - sum q_j)/C_q`` and ``tau_j q_j' = C_j V_C - q_j``, C_j = ratio_j C_q.
    Spring: ``F = k (x1 - sum s_j)`` and ``tau_j s_j' = F/k_j - s_j``, 1/k_j = ratio_j / k.
    State (q, x, v, slow parts).

    Parameters
    ----------
    place
        ``"C_nl"`` or ``"k"``.
    ratios
        Slow over fast compliance of every branch (-).
    taus
        Time constants (s).
    """

    plant: PlantParameters
    place: str
    ratios: tuple[float, ...]
    taus: tuple[float, ...]
    u_start: float = BIAS

    @property
    def start(self) -> State:
        """Rest at ``u_start`` with the branches settled."""
        p = self.plant
        fast = p.C_q * self.u_start
        if self.place == "C_nl":
            slow = tuple(r * fast for r in self.ratios)
            q = fast + sum(slow)
            return (q, p.T * q, 0.0, *slow)
        return (fast, p.T * fast, 0.0, *(0.0 for _ in self.ratios))

    def _rate(self, y: State, u: float) -> State:
        p = self.plant
        q, x, v = y[0], y[1], y[2]
        slow = y[3:]
        total = sum(slow)
        if self.place == "C_nl":
            fast = q - total
            force = p.k * (x - p.T * q)
            effort = fast / p.C_q
        else:
            fast = x - p.T * q - total
            force = p.k * fast
            effort = q / p.C_q
        return (
            (u - effort + p.T * force) / p.R_e,
            v,
            -(force + p.b * v) / p.m,
            *[(r * fast - s) / tau for r, s, tau in zip(self.ratios, slow, self.taus, strict=True)],
        )

    def current(self, y: State, u: float) -> float:
        """Charging current (A)."""
        p = self.plant
        q, total = y[0], sum(y[3:])
        x1 = y[1] - p.T * q
        if self.place == "C_nl":
            return (u - (q - total) / p.C_q + p.T * p.k * x1) / p.R_e
        return (u - q / p.C_q + p.T * p.k * (x1 - total)) / p.R_e

    def stored_energy(self, y: State) -> float:
        """Energy (J) of the fast storages, of every branch and of the mass."""
        p = self.plant
        q, x, v = y[:3]
        slow, x1 = y[3:], x - p.T * q
        branches = sum(0.5 * s * s / r for s, r in zip(slow, self.ratios, strict=True))
        kinetic = 0.5 * p.m * v * v
        if self.place == "C_nl":
            electric = (0.5 * (q - sum(slow)) ** 2 + branches) / p.C_q
            return electric + 0.5 * p.k * x1 * x1 + kinetic
        return 0.5 * q * q / p.C_q + p.k * (0.5 * (x1 - sum(slow)) ** 2 + branches) + kinetic

    def step(self, y: State, h: float, u0: float, u1: float) -> State:
        """One Runge-Kutta step."""
        return rk4(self._rate, y, h, u0, u1)
