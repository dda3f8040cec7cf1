"""Exact sensitivities of a nonlinear graph on rich inputs of many sizes and speeds.

Whether any experiment determines a parameter is asked, not whether one does: sine mixtures with
random phases at speeds from the fastest to the slowest time constant and in sizes over seven
decades are put together, each scaled by its own response.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.analysis.kalman import SET_ASIDE
from bondgraph.analysis.linear import eigenvalues
from bondgraph.equations.derivation import system
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.simulation.first_order_hold import blocks
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import BondsightError, UnusableInput
from identification.study.engine import Engine, ExactEngine, GeneralEngine, engine_of

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
    engine = engine_of(graph)
    missing = [n for n in free if n not in engine.parameter_names]
    if missing:
        raise UnusableInput(
            f"{graph.name}: {', '.join(missing)} is no parameter of the equations (a delay, or "
            "unused); leave it out of free="
        )
    rng = np.random.default_rng(seed)
    found: list[tuple[int, FloatArray, FloatArray, float]] = []
    for _ in range(points):
        p = engine.vector(values or {})
        place = [engine.parameter_names.index(n) for n in free]
        p[place] *= np.exp(rng.uniform(-0.3, 0.3, len(place)))
        j = rich_jacobian(engine, speeds_of(engine, graph, p), place, p, rng)
        null, gap = _null(j)
        found.append((null.shape[1], p[place], null, gap))
    least = min(f[0] for f in found)
    kept = [f for f in found if f[0] == least]
    return [f[1] for f in kept], [f[2] for f in kept], min(f[3] for f in kept)


def speeds_of(engine: Engine, graph: BondGraph, p: FloatArray) -> FloatArray:
    """Return speeds (1/s) from the slowest to the fastest motion of the linear part."""
    if isinstance(engine, ExactEngine):
        form = engine.compiled
        a = blocks(form, np.asarray(form.matrices(p).full(), float)).a
        found = np.abs(np.linalg.eigvals(a)) if a.size else np.ones(1)
    else:
        values = dict(zip(engine.parameter_names, p.tolist(), strict=True))
        try:
            found = np.abs(eigenvalues(system(graph), values))
        except BondsightError:  # memory or no slope at rest: nothing is known of the speed
            return np.geomspace(1e-2, 1e4, SPEEDS)
    found = found[found > 1e-12 * max(float(found.max(initial=0.0)), 1e-300)]
    found = found if found.size else np.ones(1)
    return np.geomspace(float(found.min()), float(found.max()), SPEEDS if np.ptp(found) else 1)


def rich_jacobian(
    engine: Engine,
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
    for speed in speeds:
        time = np.arange(SAMPLES) * 0.4 / speed
        for size in SIZES:
            try:
                with np.errstate(all="ignore"):
                    y, dy = _run(engine, size, time, place, p, rng)
            except BondsightError:
                continue
            for c in range(y.shape[1]):
                level = float(np.sqrt(np.mean(y[:, c] ** 2)))
                if np.isfinite(dy[:, c]).all() and np.isfinite(level) and level > 0:
                    rows.append(dy[:, c, : len(place)] * relative / level)
    if not rows:
        raise UnusableInput("no reading moves, or none is finite, at these parameters; check them")
    return np.concatenate(rows)


def _run(
    engine: Engine,
    size: float,
    time: FloatArray,
    place: Sequence[int],
    p: FloatArray,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    names = _commands(engine)
    waves = size * _mixture(rng, len(names))
    u = engine.inputs({n: waves[:, i] for i, n in enumerate(names)}, time)
    ready = engine.prepare(p, float(time[1]), 2, list(place), False)
    fine = engine.fine_inputs(u, 2, "linear")
    run = engine.run(ready, u, engine.rest(p, u[0]), fine, every_substep=False)
    return np.asarray(run.y), np.asarray(run.dy)


def _commands(engine: Engine) -> tuple[str, ...]:
    """Return the inputs that somebody can choose."""
    if isinstance(engine, ExactEngine):
        names: tuple[str, ...] = engine.compiled.space.input_names
    elif isinstance(engine, GeneralEngine):
        names = tuple(n for n in engine.program.inputs if n not in engine.program.input_rates)
    else:
        raise UnusableInput(f"{type(engine).__name__}: nothing is known of its inputs")
    return tuple(n for n in names if n.rstrip("0123456789") not in SET_ASIDE)


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
