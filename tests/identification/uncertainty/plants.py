"""A spring with known values, its recordings, and fits of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph import TF, BondGraph, C, Dq, I, One, R, Se
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.arrays import FloatArray
from identification.estimation import Estimation, Nuisances, Study, Vary, estimate
from tests.settled import simulate

N, DT, NOISE = 600, 0.01, 2e-4
TRUTH = {"m": 0.5, "d": 2.0, "k": 200.0}
WHOLE = Split(slice(0, N), slice(N, N), "all")


def spring(gain: float | None = None) -> BondGraph:
    """Mass, damper, spring; with a lever of free ratio if `gain` is given."""
    with BondGraph("spring") as g:
        body = One("body")
        if gain is None:
            Se("F", unit="N") >> body
        else:
            Se("F", unit="N") >> TF("b", ratio=gain) >> body
        body >> I("m", TRUTH["m"], unit="kg")
        body >> R("d", TRUTH["d"], unit="N*s/m")
        body >> C("k", stiffness=TRUTH["k"], unit="N/m")
        body >> Dq("x", unit="m")
    return g


def signals(seed: int = 0, n: int = N) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time, force, and displacement with noise."""
    rng = np.random.default_rng(seed)
    t: FloatArray = DT * np.arange(n, dtype=np.float64)
    u = np.cumsum(rng.standard_normal(n)) * 0.3 + 4 * np.sin(7 * t)
    x = simulate(spring(), t, {"F": u})["x"] + NOISE * rng.standard_normal(n)
    return t, u, x


def recorded(t: FloatArray, u: FloatArray, x: FloatArray) -> Recording:
    """Recording of given arrays."""
    return Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})


def study(graph: BondGraph | None = None, free: Sequence[str | Vary] | None = None) -> Study:
    """All samples train; offsets and lags are fitted."""
    return Study(graph or spring(), recorded(*signals()), free, splits=WHOLE, nuisances=Nuisances())


def found(graph: BondGraph | None = None, free: Sequence[str | Vary] | None = None) -> Estimation:
    """Fit."""
    return estimate(study(graph, free))
