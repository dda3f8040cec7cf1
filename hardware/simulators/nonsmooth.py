"""The two plants whose laws are not smooth: Maxwell slip and dry friction.

Both find their switching instants: the first halves a step until the switch sits in a piece of
h / 64, the second locates the zero of its guard and restarts there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from hardware.simulators.integrator import State, rk4_three
from hardware.simulators.plant import BIAS, BenchPlant, PlantParameters

_HALVINGS = 6
_LANDINGS = 40


@dataclass(frozen=True, slots=True)
class MaxwellSlipPlant(BenchPlant):
    """The linear plant with a bank of stop operators beside one storage.

    ``z_j = clip(z_j + ds, -r_j, r_j)`` adds the effort ``sum g_j z_j``; s = q in the dielectric
    (effort in V), s = x1 in the spring (effort in N).  State (q, x, v, z_1, ..., z_n).

    Parameters
    ----------
    place
        ``"C_nl"`` or ``"k"``.
    radii
        Slip limits r_j (C or m).
    gains
        Stiffness g_j of the elements (V/C or N/m).
    """

    plant: PlantParameters
    place: str
    radii: tuple[float, ...]
    gains: tuple[float, ...]
    u_start: float = BIAS

    @property
    def start(self) -> State:
        """Rest at ``u_start``, virgin elements."""
        return (*self._rest, *(0.0 for _ in self.radii))

    def current(self, y: State, u: float) -> float:
        """Charging current (A)."""
        p = self.plant
        extra = sum(g * z for g, z in zip(self.gains, y[3:], strict=True))
        effort, force = y[0] / p.C_q, p.k * (y[1] - p.T * y[0])
        if self.place == "C_nl":
            effort += extra
        else:
            force += extra
        return (u - effort + p.T * force) / p.R_e

    def stored_energy(self, y: State) -> float:
        """Energy (J) of the storages, of the stretched elements and of the mass."""
        elements = sum(0.5 * g * z * z for g, z in zip(self.gains, y[3:], strict=True))
        return BenchPlant.stored_energy(self, y) + elements

    def step(self, y: State, h: float, u0: float, u1: float) -> State:
        """One step, halved around every change between stick and slip."""
        return self._halving(y, h, u0, u1, _HALVINGS)

    def _halving(self, y: State, h: float, u0: float, u1: float, depth: int) -> State:
        end = self._raw(y, h, u0, u1)
        if depth == 0 or not self._switches(y, end, u0, u1):
            return end
        um = 0.5 * (u0 + u1)
        middle = self._halving(y, 0.5 * h, u0, um, depth - 1)
        return self._halving(middle, 0.5 * h, um, u1, depth - 1)

    def _switches(self, y: State, end: State, u0: float, u1: float) -> bool:
        if self._slipping(y) != self._slipping(end):
            return True
        return self._pace(y, u0) * self._pace(end, u1) < 0.0

    def _pace(self, y: State, u: float) -> float:
        i = self.current(y, u)
        return i if self.place == "C_nl" else y[2] - self.plant.T * i

    def _slipping(self, y: State) -> list[bool]:
        return [abs(z) >= r for z, r in zip(y[3:], self.radii, strict=True)]

    def _raw(self, y: State, h: float, u0: float, u1: float) -> State:
        p = self.plant
        bank = list(zip(y[3:], self.radii, self.gains, strict=True))
        C_q, T, k, m, b, R_e = p.C_q, p.T, p.k, p.m, p.b, p.R_e
        electric = self.place == "C_nl"
        s0 = y[0] if electric else y[1] - T * y[0]

        def rate(q: float, x: float, v: float, u: float) -> tuple[float, float]:
            x1 = x - T * q
            ds = (q if electric else x1) - s0
            extra = 0.0
            for z, r, g in bank:
                w = z + ds
                extra += g * (r if w > r else -r if w < -r else w)
            force = k * x1
            effort = q / C_q
            if electric:
                effort += extra
            else:
                force += extra
            return (u - effort + T * force) / R_e, -(force + b * v) / m

        q, x, v = rk4_three(rate, y, h, u0, u1)
        ds = (q if electric else x - T * q) - s0
        return (q, x, v, *[max(-r, min(r, z + ds)) for z, r, _ in bank])


@dataclass(frozen=True, slots=True)
class DryFrictionPlant(BenchPlant):
    """The linear plant with dry friction on the moved mass; state (q, x, v, mode).

    Sliding (mode = +1, -1): ``F_R = b v + mode (F_c + (F_s - F_c) exp(-(v/v_s)^2))``.
    Sticking (mode = 0): v = 0 as long as the spring force stays within F_s.  F_s = F_c is
    Coulomb's law, F_s > F_c Stribeck's.

    Parameters
    ----------
    F_c, F_s
        Sliding and static friction (N).
    v_s
        Stribeck velocity (m/s).
    """

    plant: PlantParameters
    F_c: float
    F_s: float
    v_s: float = 1.0
    u_start: float = BIAS

    @property
    def start(self) -> State:
        """Rest at ``u_start``, stuck."""
        return (*self._rest, 0.0)

    def current(self, y: State, u: float) -> float:
        """Charging current (A)."""
        p = self.plant
        return (u - y[0] / p.C_q + p.T * p.k * (y[1] - p.T * y[0])) / p.R_e

    def step(self, y: State, h: float, u0: float, u1: float) -> State:
        """One step, restarted at every landing on v = 0 and at every breakaway."""
        done, slope = 0.0, (u1 - u0) / h
        for _ in range(_LANDINGS):
            rest = h - done
            ua = u0 + slope * done
            end = self._glide(y, rest, ua, u1)
            if self._guard(end) >= 0.0:
                return end
            fraction = _first_zero(
                lambda f, y=y, rest=rest, ua=ua: self._guard(  # type: ignore[misc]
                    self._glide(y, f * rest, ua, ua + slope * f * rest)
                ),
                self._guard(end),
            )
            part = fraction * rest
            y = self._switch(self._glide(y, part, ua, ua + slope * part))
            done += part
            if h - done <= 1e-12 * h:
                return y
        return self._glide((y[0], y[1], 0.0, 0.0), h - done, u0 + slope * done, u1)

    def _glide(self, y: State, h: float, u0: float, u1: float) -> State:
        mode = y[3]
        p = self.plant
        if mode == 0.0:
            x = y[1]

            def stuck(q: float, _x: float, _v: float, u: float) -> tuple[float, float]:
                return (u - q / p.C_q + p.T * p.k * (x - p.T * q)) / p.R_e, 0.0

            q, _, _ = rk4_three(stuck, (y[0], x, 0.0), h, u0, u1)
            return (q, x, 0.0, 0.0)
        F_c, peak, inverse = self.F_c, self.F_s - self.F_c, 1.0 / self.v_s

        def sliding(q: float, x: float, v: float, u: float) -> tuple[float, float]:
            force = p.k * (x - p.T * q)
            dry = F_c + (peak * math.exp(-((v * inverse) ** 2)) if peak else 0.0)
            return (u - q / p.C_q + p.T * force) / p.R_e, -(force + p.b * v + mode * dry) / p.m

        return (*rk4_three(sliding, y, h, u0, u1), mode)

    def _guard(self, y: State) -> float:
        if y[3] == 0.0:
            return 1.0 - abs(self.plant.k * (y[1] - self.plant.T * y[0])) / self.F_s
        return y[3] * y[2]

    def _switch(self, y: State) -> State:
        force = self.plant.k * (y[1] - self.plant.T * y[0])
        was_sliding = y[3] != 0.0
        if was_sliding and abs(force) <= self.F_s:
            return (y[0], y[1], 0.0, 0.0)
        return (y[0], y[1], 0.0, -math.copysign(1.0, force))


def _first_zero(guard: Callable[[float], float], at_end: float) -> float:
    """Fraction in (0, 1] at which a guard falls through zero, by safeguarded false position."""
    low, high, g_low, g_high = 0.0, 1.0, max(guard(0.0), 0.0), at_end
    side = 0
    for _ in range(60):
        if g_low > 0.0:
            middle = (low * g_high - high * g_low) / (g_high - g_low)
        else:
            middle = 0.5 * (low + high)
        value = guard(middle)
        if value < 0.0:
            high, g_high = middle, value
            if side < 0:
                g_low *= 0.5
            side = -1
        else:
            low, g_low = middle, value
            if side > 0:
                g_high *= 0.5
            side = 1
        if abs(value) < 1e-13:
            return middle
        if high - low < 1e-12:
            break
    return high
