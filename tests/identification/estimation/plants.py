"""A spring with a mass and a damper, and records of it, for the tests of fits."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import expm

from bondgraph import BondGraph, C, De, Dq, I, One, R, Se, Sf, Zero
from bondgraph.laws.table import TableLaw
from bondgraph.signals.fractional_delay import delayed
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import FloatArray as Array
from identification.estimation import Estimation, Study, Vary
from tests.settled import simulate
from tests.spring import spring as shared_spring

TRUTH = {"m": 0.5, "d": 2.0, "k": 200.0}
NOISE = 2e-4
FREE = ("m", Vary("d", start=1.0), Vary("k", start=300.0))


def spring(*, speed: bool = False, **changed: Any) -> BondGraph:
    return shared_spring(**{**TRUTH, **changed}, speed="w" if speed else "")


def force(n: int, fs: float, seed: int) -> Array:
    """Return a walk with a tone: it moves at every frequency that the spring hears."""
    rng = np.random.default_rng(seed)
    tone = 4 * np.sin(2 * np.pi * 1.1 * np.arange(n) / fs)
    return np.asarray(np.cumsum(rng.standard_normal(n)) * 3.0 / np.sqrt(fs) + tone)


def moved(u: Array, fs: float, graph: BondGraph | None = None, hold: str = "linear") -> Array:
    """Return the displacement without noise, from the rest under the first force."""
    t = np.arange(u.size) / fs
    return np.asarray(simulate(graph or spring(), t, {"F": u}, hold=hold)["x"])


def record(
    n: int = 1500, fs: float = 100.0, seed: int = 5, *, name: str = "run", noise: float = NOISE,
    offset: float = 0.0, lag: float = 0.0, graph: BondGraph | None = None, hold: str = "linear",
) -> Recording:  # fmt: skip
    u = force(n, fs, seed)
    x = delayed(moved(u, fs, graph, hold), lag)[0] + offset
    x = x + noise * np.random.default_rng(100 + seed).standard_normal(n)
    return Recording.from_arrays(name, {"F[N]": u, "x[m]": x}, fs=fs)


def study(*recordings: Recording, **options: object) -> Study:
    options = {"free": FREE, **options}
    return Study(spring(m=0.7), recordings or (record(),), **options)  # type: ignore[arg-type]


def misses(result: Estimation, truth: dict[str, float]) -> dict[str, float]:
    """Return the distance of each estimate to the truth in standard errors."""
    found = {}
    for name, true in truth.items():
        e = result.estimate_of(name)
        found[name] = abs(e.value - true) / ((e.ci95[1] - e.ci95[0]) / (2 * 1.96))
    return found


def falling(slope: float = -20.0) -> BondGraph:
    """Return a mass on a spring that pushes away: unstable without a controller."""
    with BondGraph("falling") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 1.0, unit="N*s/m")
        law = TableLaw((-1.0, 0.0, 1.0), (-slope, 0.0, slope), free=True, unit="N")
        body >> C("k", law=law)
        body >> Dq("x", unit="m")
    return g


def caught(
    n: int = 600, fs: float = 100.0, seed: int = 3, noise: float = NOISE, slope: float = -20.0
) -> Recording:
    """Return a record of `falling` with a controller that holds its force between samples."""
    a = np.array([[0.0, 1.0], [-slope / 0.5, -1.0 / 0.5]])
    whole = expm(np.block([[a, np.array([[0.0], [2.0]])], [np.zeros((1, 3))]]) / fs)
    wanted = np.repeat(np.random.default_rng(seed).uniform(-8, 8, n // 20 + 1), 20)[:n]
    state, x, u = np.zeros(2), np.empty(n), np.empty(n)
    for i in range(n):
        x[i], u[i] = state[0], wanted[i] - 60.0 * state[0] - 4.0 * state[1]
        state = whole[:2, :2] @ state + whole[:2, 2] * u[i]
    x = x + noise * np.random.default_rng(seed + 50).standard_normal(n)
    return Recording.from_arrays("caught", {"F[N]": u, "x[m]": x}, fs=fs)


def ohm(**options: float) -> BondGraph:
    """Return a resistor under a given current: its reading is linear in its parameter."""
    with BondGraph("ohm") as g:
        node = Zero("node")
        Sf("i", unit="A") >> node >> R("r", options.get("r", 3.0), unit="ohm")
        node >> De("u", unit="V")
    return g
