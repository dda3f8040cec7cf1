"""Three masses on springs, simulated by another integrator with an effect as a force of its own."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from scipy.integrate import ode

from bondgraph import BondGraph, C, Dq, I, One, R, Se, Zero
from bondgraph.signals.recording import Split
from identification.diagnosis.localisation.blind_relations import BlindRelation, blind_relations
from identification.diagnosis.localisation.structural_classes import structure
from identification.estimation.single_record import Fit, fit
from identification.estimation.threads import single_threaded
from identification.study.data import Data
from identification.study.problem import Problem

N, DT, NOISE = 1200, 0.01, 1e-4
MASS, STIFFNESS, DAMPING = 1.0, 400.0, 1.5
PUSHES = (0.83, 2.11, 2.9, 4.77, 6.02, 7.95, 8.4, 10.3)


def chain(
    mass: float, stiffness: float, damping: float, sensors: int = 3, first: int = 1
) -> BondGraph:
    """Three identical masses on identical springs; the first spring ends at the wall."""
    with BondGraph("chain") as g:
        bodies = [One(f"v{i}") for i in (1, 2, 3)]
        for i, body in enumerate(bodies, start=1):
            body >> I(f"m{i}", mass, unit="kg")
            if first <= i <= sensors:
                body >> Dq(f"x{i}", unit="m")
        Se("F", unit="N") >> bodies[-1]
        for i, body in enumerate(bodies, start=1):
            between = body
            if i > 1:
                joint, between = Zero(f"z{i}"), One(f"r{i}")
                body >> joint
                joint >> bodies[i - 2]
                joint >> between
            between >> C(f"k{i}", stiffness=stiffness, unit="N/m")
            between >> R(f"b{i}", damping, unit="N*s/m")
    return g


def pushed(t: float) -> float:
    """Pushes at the first mass, N: half waves of 0.2 s, seldom and at odd times."""
    return sum(math.sin(math.pi * (t - s) / 0.2) for s in PUSHES if s < t < s + 0.2)


@cache
def course(
    cubic_k2: float = 0.0, friction_b1: float = 0.0, pushes: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, true displacements (N, 3) and velocities (N, 3)."""
    rng = np.random.default_rng(0)
    tones, phases = rng.uniform(0.2, 8.0, 12), rng.uniform(0.0, 2 * np.pi, 12)
    t = DT * np.arange(N)
    force = 6.0 * np.sin(2 * np.pi * np.outer(t, tones) + phases).sum(axis=1)
    known = force.tolist()

    def rate(s: float, z: np.ndarray) -> list[float]:
        x1, x2, x3, v1, v2, v3 = z.tolist()
        e1 = STIFFNESS * x1 + DAMPING * v1 + friction_b1 * math.tanh(v1 / 1e-3)
        e2 = STIFFNESS * (x2 - x1) + DAMPING * (v2 - v1) + cubic_k2 * (x2 - x1) ** 3
        e3 = STIFFNESS * (x3 - x2) + DAMPING * (v3 - v2)
        e1 -= pushes * pushed(s) if pushes else 0.0
        i = min(int(s / DT), N - 2)
        u = known[i] + (known[i + 1] - known[i]) * (s / DT - i)
        return [v1, v2, v3, (e2 - e1) / MASS, (e3 - e2) / MASS, (u - e3) / MASS]

    solver = ode(rate).set_initial_value(np.zeros(6))
    solver.set_integrator("dopri5", rtol=1e-7, atol=1e-10, max_step=DT, nsteps=10_000)
    found = np.stack([np.zeros(6), *(solver.integrate(s) for s in t[1:])])
    return force, found[:, :3], found[:, 3:]


LAST_THIRD = Split(slice(0, 800), slice(800, N), "last third")
INTERLEAVED = Split(
    tuple(slice(200 * i, 200 * i + 140) for i in range(6)),
    tuple(slice(200 * i + 140, 200 * i + 200) for i in range(6)),
    "interleaved",
)


SPLITS = {s.rule: s for s in (LAST_THIRD, INTERLEAVED)}


def fitted(
    cubic_k2: float = 0.0,
    friction_b1: float = 0.0,
    cubic_x2: float = 0.0,
    pushes: float = 0.0,
    split: Split = LAST_THIRD,
) -> Fit:
    """Nominal fit that starts from parameters a fifth off; made once."""
    return _fitted(cubic_k2, friction_b1, cubic_x2, pushes, split.rule)


def question(
    cubic_k2: float, friction_b1: float, cubic_x2: float, pushes: float, split: Split
) -> Problem:
    """What is fitted: parameters begin a fifth off."""
    force, x, _ = course(cubic_k2, friction_b1, pushes)
    seen = x + NOISE * np.random.default_rng(1).standard_normal(x.shape)
    seen[:, 1] += cubic_x2 * x[:, 1] ** 3
    names = ("x1", "x2", "x3")
    data = Data("run", DT * np.arange(N), {"F": force}, seen, names, np.full(3, NOISE), split)
    return Problem(chain(1.2 * MASS, 0.85 * STIFFNESS, 0.8 * DAMPING), data)


@cache
@single_threaded
def _fitted(cubic_k2: float, friction_b1: float, cubic_x2: float, pushes: float, rule: str) -> Fit:
    return fit(question(cubic_k2, friction_b1, cubic_x2, pushes, SPLITS[rule]))


def relations(f: Fit) -> tuple[BlindRelation, ...]:
    return blind_relations(f, structure(f.problem.graph, np.geomspace(1.0, 60.0, 24)))
