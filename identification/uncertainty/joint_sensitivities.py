"""Exact sensitivities of a nonlinear graph on rich inputs of many sizes and speeds.

Whether any experiment determines a parameter is asked, not whether one does: sine mixtures with
random phases at speeds from the fastest to the slowest time constant and in sizes over seven
decades are put together, each scaled by its own response.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.simulation.dynamics import Dynamics, dynamics_of
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import BondsightError, UnusableInput

SAMPLES = 160
SIZES = tuple(10.0**k for k in range(-3, 4))
SPEEDS = 4
ZERO = 1e-6


def rich_nulls(
    graph: BondGraph,
    free: Sequence[str],
    values: Mapping[str, float] | None,
    seed: int,
    points: int = 3,
) -> tuple[list[FloatArray], list[FloatArray], float]:
    """Return parameter values, flat directions (relative changes) and the width of the gap.

    Only points of the largest rank are returned; see `flat_blocks` for the shapes.

    Raises
    ------
    UnusableInput
        A name of `free` is no parameter of the equations, or no run is finite.
    """
    dynamics = dynamics_of(graph)
    missing = [n for n in free if n not in dynamics.parameter_names]
    if missing:
        raise UnusableInput(
            f"{graph.name}: {', '.join(missing)} is no parameter of the equations (a delay, a "
            "clock, or unused); leave it out of free="
        )
    rng = np.random.default_rng(seed)
    found: list[tuple[int, FloatArray, FloatArray, float]] = []
    for _ in range(points):
        p = dynamics.vector(values or {})
        place = [dynamics.parameter_names.index(n) for n in free]
        p[place] *= np.exp(rng.uniform(-0.3, 0.3, len(place)))
        j = rich_jacobian(dynamics, speeds_of(dynamics, p), place, p, rng)
        null, gap = _null(j)
        found.append((null.shape[1], p[place], null, gap))
    least = min(f[0] for f in found)
    kept = [f for f in found if f[0] == least]
    return [f[1] for f in kept], [f[2] for f in kept], min(f[3] for f in kept)


def speeds_of(dynamics: Dynamics, p: FloatArray) -> FloatArray:
    """Return speeds (1/s) from the slowest to the fastest small motion about the rest."""
    still = dynamics.inputs({n: np.zeros(2) for n in dynamics.commands}, np.arange(2.0))[0]
    found = np.abs(dynamics.small_signal(p, still).eigenvalues())
    if dynamics.n_x and not found.size:  # no slope at rest: nothing is known of the speed
        return np.geomspace(1e-2, 1e4, SPEEDS)
    found = found[found > 1e-12 * max(float(found.max(initial=0.0)), 1e-300)]
    found = found if found.size else np.ones(1)
    return np.geomspace(float(found.min()), float(found.max()), SPEEDS if np.ptp(found) else 1)


def rich_jacobian(
    dynamics: Dynamics,
    speeds: FloatArray,
    place: Sequence[int],
    p: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Return ``p dy/dp`` of all outputs on all experiments, each scaled by its response.

    Experiments that cannot be simulated (too large for the model) are left out.
    """
    relative = np.where(p[list(place)] == 0, 1.0, p[list(place)])
    rows = []
    why = "no reading moves, or none is finite, at these parameters; check them"
    for speed in speeds:
        time = np.arange(SAMPLES) * 0.4 / speed
        for size in SIZES:
            try:
                with np.errstate(all="ignore"):
                    y, dy = _run(dynamics, size, time, place, p, rng)
            except BondsightError as refusal:
                why = str(refusal)
                continue
            for c in range(y.shape[1]):
                with np.errstate(all="ignore"):  # what runs away is left out
                    level = float(np.sqrt(np.mean(y[:, c] ** 2)))
                if np.isfinite(dy[:, c]).all() and np.isfinite(level) and level > 0:
                    rows.append(dy[:, c, : len(place)] * relative / level)
    if not rows:
        raise UnusableInput(why)
    return np.concatenate(rows)


def _run(
    dynamics: Dynamics,
    size: float,
    time: FloatArray,
    place: Sequence[int],
    p: FloatArray,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    names = dynamics.commands
    waves = size * _mixture(rng, len(names))
    u = dynamics.inputs({n: waves[:, i] for i, n in enumerate(names)}, time)
    ready = dynamics.prepare(p, float(time[1]), 2, list(place), False)
    fine = dynamics.fine_inputs(u, 2, "linear")
    run = dynamics.run(ready, u, dynamics.rest(p, u[0]), fine, every_substep=False)
    return np.asarray(run.y), np.asarray(run.dy)


def _mixture(rng: np.random.Generator, n_u: int) -> FloatArray:
    """Sines of random phase below half the Nyquist frequency, rising from rest, rms near 1."""
    t = np.arange(SAMPLES)
    lines = np.arange(1, SAMPLES // 4)
    lines = lines[rng.random(lines.size) < 0.5]
    phase = rng.uniform(0, 2 * np.pi, (lines.size, n_u))
    waves = np.sin(2 * np.pi * lines[None, :, None] * t[:, None, None] / SAMPLES + phase[None])
    u = waves.sum(axis=1) * np.sqrt(2 / max(lines.size, 1))
    u *= np.minimum(t / 10.0, 1.0)[:, None]
    return np.asarray(u)


def _null(j: FloatArray) -> tuple[FloatArray, float]:
    """Return flat directions and the gap: columns of unit length, widest gap below `ZERO`."""
    length = np.linalg.norm(j, axis=0)
    live = length > 1e-10 * max(float(length.max(initial=0.0)), 1e-300)
    dead = np.eye(j.shape[1])[:, ~live]
    if not live.any():
        return dead, float("inf")
    unit = j[:, live] / length[live]
    if unit.shape[0] > unit.shape[1]:
        unit = np.asarray(np.linalg.qr(unit, mode="r"))
    _, s, rows = np.linalg.svd(unit, full_matrices=True)
    s = np.append(s, np.zeros(rows.shape[0] - s.size)) / s[0]
    floor = np.maximum(s, 1e-14)
    small = np.flatnonzero(s < ZERO)
    count = int(small[0]) if small.size else s.size
    if 0 < count < s.size:
        # the widest step at or below the first small one
        steps = floor[count - 1 : -1] / floor[count:]
        count += int(np.argmax(steps))
    gap = float(floor[count - 1] / floor[count]) if 0 < count < s.size else float(floor[-1] / 1e-14)
    basis = np.zeros((j.shape[1], rows.shape[0] - count))
    basis[live] = rows[count:].T / length[live][:, None]
    if basis.shape[1]:
        basis /= np.abs(basis).max(axis=0)
    return np.hstack([basis, dead]), gap
