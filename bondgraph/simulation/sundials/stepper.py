"""One accepted step of SUNDIALS after the other; a step ends where an argument turns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, final

import casadi as ca
import numpy as np

from bondgraph.equations.program import Program
from bondgraph.simulation.sundials.functions import GRID
from bondgraph.support.arrays import Array

NEAR: Final = 1e-6
"""Part of a step below which a turn is at its end."""


@dataclass(frozen=True, eq=False)
class Accepted:
    """Where an accepted step ended.

    Attributes
    ----------
    t : float
        s
    x, z : ndarray, shapes (n_x,), (n_z,)
        State and algebraic unknowns.
    m, before : ndarray, shape (n_m,)
        Memory now, and that of the step before.
    since : float
        Length of the step, s.
    """

    t: float
    x: Array
    z: Array
    m: Array
    before: Array
    since: float = 0.0


@final
@dataclass(frozen=True, eq=False)
class Stepper:
    """One accepted step after the other.

    Attributes
    ----------
    plugin : {"cvodes", "idas"}
    program : Program
        With memories that flow as states.
    p : ndarray, shape (n_p,), SI
    size : ndarray, shape (n_x + n_z,)
        Of states and algebraic unknowns.
    least : float
        Part of its size below which an argument that turns does not matter.
    integrate, unknowns, turning : casadi.Function
        See `bondgraph.simulation.sundials.functions`.
    """

    plugin: str
    program: Program
    p: Array
    size: Array
    least: float
    integrate: ca.Function
    unknowns: ca.Function
    turning: ca.Function | None

    def onward(self, a: Accepted, h: float, left: Array, right: Array) -> tuple[Accepted, int]:
        """Go `h` seconds on, inputs from `left` to `right`; accept a step at every turn."""
        slope, end, steps, turned = (right - left) / h, a.t + h, 0, False
        while True:
            rest = end - a.t
            x, z, count = self._grid(a, rest, right - slope * rest, right)
            steps += count
            part = self._turn(a, rest, x, z, right - slope * rest, slope, turned)
            if part is None:
                break
            u = right - slope * (rest * (1.0 - part))
            x, z, count = self._grid(a, rest * part, right - slope * rest, u)
            steps += count
            a, turned = self._accept(a, rest * part, x[:, -1], z[:, -1], u), True
        return replace(self._accept(a, rest, x[:, -1], z[:, -1], right), t=end), steps

    def reading(self, a: Accepted, u: Array) -> Array:
        """Return the outputs where a step ended, with the memory that it was taken with."""
        return flat(self.program.rhs(a.t, a.x, a.z, u, self.p, a.before, a.since)[1])

    def jumped(self, a: Accepted, u: Array) -> Accepted:
        """Return the same with the unknowns that belong to other inputs."""
        return replace(a, z=flat(self.unknowns(a.t, a.x, a.z, u, self.p, a.m, 0.0)))

    def _grid(self, a: Accepted, h: float, left: Array, right: Array) -> tuple[Array, Array, int]:
        """Return states and unknowns at the parts `GRID` of a step, a column each."""
        n_x = a.x.size
        p = np.concatenate([[a.t, h], left, right, self.p, a.m, a.z])
        opened = bool(self.integrate.size1_in("z0"))
        begun = {"z0": a.z / self.size[n_x:]} if opened else {}
        made = self.integrate(x0=a.x / self.size[:n_x], p=p, **begun)
        x = np.asarray(made["xf"].full()) * self.size[:n_x, None]
        z = np.tile(a.z[:, None], GRID.size)
        if opened:
            z = np.asarray(made["zf"].full()) * self.size[n_x:, None]
        if a.z.size:
            z = np.asarray(self._unknowns(*self._on_grid(a, h, x, z, left, right)).full())
        return x, z, int(self.integrate.stats()["nsteps"])

    @cached_property
    def _unknowns(self) -> ca.Function:
        return self.unknowns.map(GRID.size)

    @cached_property
    def _turning(self) -> ca.Function:
        assert self.turning is not None
        return self.turning.map(GRID.size)

    def _on_grid(
        self, a: Accepted, h: float, x: Array, z: Array, left: Array, right: Array
    ) -> tuple[Any, ...]:
        """Return the arguments of a function at the parts `GRID` of a step."""
        since, u = h * GRID[None, :], left[:, None] + (right - left)[:, None] * GRID
        return (a.t + since, x, z, u, self.p, a.m, since)

    def _accept(self, a: Accepted, h: float, x: Array, z: Array, u: Array) -> Accepted:
        m = self.program.advance(a.t + h, x, z, u, self.p, a.m, h)
        return Accepted(a.t + h, x, z, flat(m), a.m, h)

    def _turn(
        self, a: Accepted, h: float, x: Array, z: Array, left: Array, slope: Array, turned: bool
    ) -> float | None:
        """Return the part of the step after which an argument turns first, by a line between two.

        An error of the place is squared in the argument there.
        """
        if self.turning is None:
            return None
        at_grid = self._on_grid(a, h, x, z, left, left + slope * h)
        rate = np.asarray(self._turning(*at_grid, slope)[0].full())
        first, by_v = self.turning(a.t, a.x, a.z, left, self.p, a.m, 0.0, slope)
        first, size = flat(first), np.abs(by_v.full()) @ self.size[: by_v.shape[1]]
        if turned:  # it turns right here
            first = np.where(np.abs(first) < np.abs(rate[:, 0]), rate[:, 0], first)
        rate, at = np.column_stack([first, rate]), np.concatenate([[0.0], GRID])
        rate[np.abs(rate).max(axis=1) * h < self.least * size] = 0.0
        parts = [
            at[k] + (at[k + 1] - at[k]) * r[k] / (r[k] - r[k + 1])
            for r in rate
            for k in np.flatnonzero(r[:-1] * r[1:] < 0.0)[:1]
        ]
        soonest = min(parts, default=1.0)
        return soonest if NEAR < soonest < 1.0 - NEAR else None


def flat(column: ca.DM) -> Array:
    """Return a column as an array, shape (n,)."""
    return np.asarray(column.full(), float).ravel()
