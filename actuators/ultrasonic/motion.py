"""Many stages at once under a force, with dry friction that depends on the position; compiled.

The language holds friction constant along the way. Here the closed solution of its `Coulomb` law
gets the level at each position; with a constant level a step is the one that `simulate` takes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import exp
from typing import Any

import numpy as np

from actuators.ultrasonic.data_sheet import M661
from actuators.ultrasonic.stage import MOVED_MASS
from bondgraph.laws import Coulomb
from bondgraph.laws.table import TableLaw
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import CASADI


@dataclass(frozen=True)
class Stage:
    """A guided mass between two end stops.

    Parameters
    ----------
    friction : TableLaw or float
        Dry friction, N; a table gives it over the position (m).
    holding : float
        Friction more while the plate is at rest, N; it falls in proportion to the amplitude and
        is gone at the edge of the dead zone. The printed holding force is 2 N.
    travel : float
        End stops at 0 and here, m; a stage that meets one stays there until it is pulled back.
    """

    mass: float = MOVED_MASS
    damping: float = M661.damping
    friction: TableLaw | float = 0.0
    holding: float = 0.0
    travel: float = M661.travel

    def __post_init__(self) -> None:
        """Refuse what cannot move."""
        if not min(self.mass, self.damping, self.travel) > 0:
            raise UnusableInput("Stage: mass, damping and travel have to be > 0")
        lowest = min(self.friction.values) if isinstance(self.friction, TableLaw) else self.friction
        if lowest < 0 or self.holding < 0:
            raise UnusableInput("Stage: friction cannot be negative; raise its lowest value to 0")

    def level(self, x: Any, rest: Any) -> Any:
        """Friction (N) at position `x` (CasADi), `rest` being the share of the holding force."""
        table = self.friction
        here = table.output(CASADI, x, ()) if isinstance(table, TableLaw) else table
        return here + self.holding * rest


def moved(ca: Any, stage: Stage, h: float, x: Any, v: Any, force: Any, rest: Any) -> Any:
    """Position and speed after `h` seconds under a constant force; columns of stages alike.

    Exact but for the friction, which is taken at the position before the step.
    """
    tau = stage.mass / stage.damping
    phi = exp(-h / tau)
    gain = (1.0 - phi) / stage.damping
    free = phi * v + gain * force
    level = stage.level(x, rest)
    w = Coulomb().solve(free, ca.SX(-gain), (), (level,), ca.SX(0))
    speed = free - gain * w
    there = x + tau * (1.0 - phi) * v + (h - tau * (1.0 - phi)) / stage.damping * (force - w)
    inside = ca.fmax(0.0, ca.fmin(stage.travel, there))
    return inside, ca.if_else(there == inside, speed, 0.0)


def move(
    stage: Stage, start: Array, force: Array, step: float, rest: Array | None = None
) -> tuple[Array, Array]:
    """Positions and speeds, each of shape (n, N + 1), of `n` stages from rest at `start`.

    Parameters
    ----------
    start : ndarray, shape (n,), m
    force : ndarray, shape (N,), N
        The same for all, constant within each step.
    step : float
        s.
    rest : ndarray, shape (N,), optional
        Share of the holding force that acts (0 to 1); 0 when left out.
    """
    start, force = np.atleast_1d(np.asarray(start, float)), np.asarray(force, float)
    share = np.zeros(force.size) if rest is None else np.asarray(rest, float)
    if start.min() < 0 or start.max() > stage.travel:
        raise UnusableInput(f"move: a start lies outside of the travel 0 to {stage.travel:g} m")
    run = _runner(stage, start.size, step, force.size)
    state = np.concatenate([start, np.zeros(start.size)])
    later = np.asarray(run(state, force[None, :], share[None, :]).full())
    path = np.hstack([state[:, None], later])
    return path[: start.size], path[start.size :]


@lru_cache(maxsize=16)
def _runner(stage: Stage, n: int, h: float, count: int) -> Any:
    import casadi as ca

    state, force, rest = ca.SX.sym("state", 2 * n), ca.SX.sym("force"), ca.SX.sym("rest")
    x, v = moved(ca, stage, h, state[:n], state[n:], force, rest)
    step = ca.Function("stage", [state, force, rest], [ca.vertcat(x, v)])
    return step.mapaccum(count)
