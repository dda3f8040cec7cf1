"""Plants with process noise, integrated by Euler and Maruyama: nothing of the project is used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bondgraph import TF, BondGraph, C, Df, Dq, I, One, R, Recording, Se, Zero
from bondgraph.signals.recording import Split
from bondgraph.support.arrays import Array
from identification.estimation.prediction.kalman import KalmanFilter, kalman_filter
from identification.study.specification import NO_NUISANCES
from identification.study.study import Study
from tests.spring import spring as shared_spring

MASS, DAMPING, STIFFNESS = 0.5, 2.0, 200.0
UNITS = {"F": "N", "V": "V", "x": "m", "s": "m/s", "Q": "C", "f": "N", "phi": "rad", "T": "N*m"}


def spring(both: bool = False, stiffness: float = STIFFNESS) -> BondGraph:
    """Mass, spring and damper; reads the displacement, with `both` the speed too."""
    return shared_spring(MASS, DAMPING, stiffness, speed="s" if both else "")


def transducer() -> BondGraph:
    """A nanofarad behind a resistor drives a mass: charges of 1e-8 C beside momenta of 1e-3 N s."""
    with BondGraph("transducer") as g:
        loop, port, body = One("loop"), Zero("port"), One("body")
        Se("V", unit="V") >> loop >> R("Rs", 2e6, unit="ohm")
        loop >> port >> C("C0", 1e-9, unit="F")
        port >> TF("n", 50.0, unit="V/N") >> body
        body >> I("m", 0.1, unit="kg")
        body >> R("d", 3.0, unit="N*s/m")
        body >> C("k", stiffness=4e3, unit="N/m")
        loop >> Dq("Q", unit="C")
        body >> Df("s", unit="m/s")
    return g


def euler_maruyama(
    u: Array, dt: float, sigma: float, rng: np.random.Generator, sub: int = 40, runs: int = 1
) -> Array:
    """Displacements of the spring, shape (N, runs), with a random momentum of intensity `sigma`.

    Parameters
    ----------
    u : ndarray, shape (N, runs)
        Force at the samples, linear between them.
    """
    h, n = dt / sub, u.shape[0]
    q, p = np.zeros(runs), np.zeros(runs)
    out = np.zeros((n, runs))
    for i in range(n - 1):
        kicks = rng.standard_normal((sub, runs)) * np.sqrt(h) * sigma
        for j in range(sub):
            force = u[i] + (u[i + 1] - u[i]) * j / sub
            p = p + h * (force - DAMPING * p / MASS - STIFFNESS * q) + kicks[j]
            q = q + h * p / MASS  # the new momentum: the explicit form would add -STIFFNESS h to d
        out[i + 1] = q
    return out


def recording_of(
    readings: Array,
    dt: float,
    u: Array,
    names: tuple[str, ...] = ("x",),
    source: str = "F",
    name: str = "run",
) -> Recording:
    """Wrap arrays in SI."""
    y = readings if readings.ndim == 2 else readings[:, None]
    values = {source: u, **dict(zip(names, y.T, strict=True))}
    channels = {f"{n}[{UNITS[n]}]": v for n, v in values.items()}
    return Recording.from_arrays(name, channels, fs=1 / dt)


def study_of(
    graph: BondGraph,
    recordings: Recording | Sequence[Recording],
    process_noise: Sequence[str] | Mapping[str, float] | None = (),
    **more: Any,
) -> Study:
    """Return a study of whole recordings, taken as they are, with one step a sample."""
    records = [recordings] if isinstance(recordings, Recording) else recordings
    splits = [Split(slice(0, r.n), slice(r.n, r.n), "all") for r in records]
    usual = {"splits": splits, "nuisances": NO_NUISANCES, "n_sub": 1}
    return Study(graph, records, process_noise=process_noise, **{**usual, **more})


def filter_of(*given: Any, readings: Array | None = None, **more: Any) -> KalmanFilter:
    """Return the filter of `study_of`, `readings` of its first record replaced: NaN is missing."""
    made = kalman_filter(study_of(*given, **more))
    if readings is None:
        return made
    first, *others = made.stack.problems
    first = replace(first, data=replace(first.data, readings=readings))
    return replace(made, stack=replace(made.stack, problems=(first, *others)))


def random_force(n: int, rng: np.random.Generator, hold: int = 10, size: float = 4.0) -> Array:
    """Steps of random height, rounded."""
    steps = np.repeat(rng.standard_normal(-(-n // hold)) * size, hold)[:n]
    return np.convolve(steps, np.ones(5) / 5, "same")
