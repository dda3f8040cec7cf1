"""A capacity that the model lacks, and a source with a resistance inside."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, Df, One, R, Recording, Se, Sf, Zero
from bondgraph.support.arrays import Array
from identification import DiagnosisOptions, diagnose
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.diagnose import Diagnosis

DT, N = 5.0, 500
OPTIONS = DiagnosisOptions(jobs=1, effects=1, keep=3, more=2)


def steps(seed: int, low: float, high: float) -> Array:
    """Levels that change at random times."""
    rng = np.random.default_rng(seed)
    edges = np.sort(rng.integers(0, N, 25))
    return np.asarray(rng.uniform(low, high, 26)[np.searchsorted(edges, np.arange(N))])


def run(a: Array, b: Array, u: Array) -> Array:
    """States of ``dx/dt = a x + b u`` from rest, by classical Runge-Kutta in 20 steps a sample."""
    x, found = np.zeros(len(a)), []
    h = DT / 20
    for value in u:
        found.append(x)
        for _ in range(20):
            k_1 = a @ x + b * value
            k_2 = a @ (x + h / 2 * k_1) + b * value
            k_3 = a @ (x + h / 2 * k_2) + b * value
            k_4 = a @ (x + h * k_3) + b * value
            x = x + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)
    return np.array(found)


def noisy(y: Array, seed: int) -> Array:
    return np.asarray(y + 0.02 * y.std() * np.random.default_rng(seed).normal(size=y.shape))


def told(graph: BondGraph, channels: dict[str, Array]) -> Diagnosis:
    units = {n: graph[n].unit for n in channels}
    recording = Recording("run", DT * np.arange(N), channels, units)
    return diagnose(graph, recording, options=OPTIONS, hold="zoh")


def places(name: str, graph: BondGraph) -> list[str]:
    return [e.name for e in by_name(name).places(graph)]


C_H, R_W, C_R, R_O = 400.0, 0.3, 900.0, 0.5


def two_lumps(power: Array) -> Array:
    """Temperatures of a heater and of the room around it."""
    a = np.array([
        [-1 / (R_W * C_H), 1 / (R_W * C_H)],
        [1 / (R_W * C_R), -(1 / R_W + 1 / R_O) / C_R],
    ])  # fmt: skip
    return run(a, np.array([1 / C_H, 0.0]), power)


def oven(*, both: bool) -> BondGraph:
    """Return an oven whose heater has no heat capacity, or one that is a single lump."""
    with BondGraph("oven") as g:
        heater = Zero("heater")
        Sf("P", unit="W") >> heater >> De("T_1", unit="K")
        if both:
            wall, room = One("wall"), Zero("room")
            heater >> wall >> R("R_w", 0.3, unit="K/W", spread=1.5)
            wall >> room >> C("C_r", 900.0, unit="J/K", spread=1.5)
            room >> R("R_o", 0.5, unit="K/W", spread=1.5)
            room >> De("T_2", unit="K")
        else:
            heater >> C("C_r", 1300.0, unit="J/K")
            heater >> R("R_o", 0.5, unit="K/W")
    return g
