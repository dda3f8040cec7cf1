"""First trajectory of a collocation fit: windows integrated side by side, scales along it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from bondgraph.simulation.radau.start import unknowns_at
from bondgraph.support.arrays import Array
from identification.estimation.methods.collocated import CollocatedRecord
from identification.estimation.methods.radau import STAGES, Scales, march
from identification.study.joint import JointPoint, JointProblem, refine_states
from identification.study.problem import Problem
from identification.study.residual import windows

WINDOWS = 40
SHORTEST = 12
"""Samples of the shortest window."""
PASSES = 8


def windows_of(problem: Problem) -> list[slice]:
    """Return windows that share their edges over the whole record."""
    n = problem.data.n
    count = max(1, round((n - 1) / max(SHORTEST, n // WINDOWS)))
    edges = np.linspace(0, n - 1, count + 1).astype(int)
    return [slice(int(a), int(b) + 1) for a, b in pairwise(edges)]


def observed(
    stack: JointProblem, start: JointPoint, record: int, cut: list[slice], **changes: Any
) -> Array:
    """Return states at the begin of windows that follow their own readings at the start values.

    `changes` are of the problem that the windows are fitted with.
    """
    p = stack.problems[record]
    split = replace(p.data.split, train=slice(0, p.data.n), test=slice(0, 0))
    length = cut[0].stop - cut[0].start - 1
    loose = replace(p, data=replace(p.data, split=split), window=max(length, 3), **changes)
    local = stack.local(start, record)
    states = np.tile(local.states[:1], (len(windows(loose)), 1))
    found = refine_states(loose, replace(local, states=states), passes=PASSES).states
    at = np.array([w.start for w in windows(loose)])
    picked = found[[int(np.abs(at - c.start).argmin()) for c in cut]]
    held = np.setdiff1d(np.arange(p.dynamics.n_x), p.free_states)
    picked[0, held] = (p.rest_state if p.initial == "rest" else local.states[0])[held]
    return np.asarray(picked)


def followed(
    record: CollocatedRecord,
    theta: Array,
    known: Mapping[str, float],
    states: Array,
    cut: list[slice],
) -> tuple[Array, Array]:
    """Trajectory (first node, stages) from states at the first samples of windows.

    Parameters
    ----------
    known : mapping of str to float
        The parameters at theta, SI.
    states : ndarray, shape (windows, n_x), SI, in the order of the dynamics
    cut : list of slice
        Windows that share their edges.
    """
    m, size, n_x = record.n_sub, record.size, record.step.n_x
    begins = [c.start for c in cut if c.start < record.last - 1]
    longest = max(c.stop - 1 - c.start for c in cut) * m
    count = len(begins)
    begin = np.zeros((size, count))
    begin[:n_x] = (states[:count, record.order] / record.scales.x).T
    index = np.array(begins)[None] * m + np.arange(longest)[:, None]
    index = np.minimum(index, record.u.shape[1] - 1)
    u = record.u[:, index].transpose(1, 0, 2)
    v, _ = march(record.step, theta, begin, u, record.t[index], record.h)
    v = np.where(np.isfinite(v), v, np.tile(begin, (STAGES, 1))[None])
    stages = np.empty((size * STAGES, record.steps))
    edges = [*begins, record.last - 1]
    for k, (a, b) in enumerate(pairwise(edges)):
        stages[:, a * m : b * m] = v[: (b - a) * m, :, k].T
    made = record.program
    p, memory = np.array([known[n] for n in made.parameters]), np.array(made.virgin)
    z = unknowns_at(made, 0.0, states[0, record.order], record.nodes[:, 0], p, memory)
    return np.concatenate([begin[:n_x, 0], z / record.scales.z]), stages


def scales_along(record: CollocatedRecord, theta: Array, first: Array, stages: Array) -> Scales:
    """Scales with those of the algebraic unknowns and their equations from a trajectory."""
    n_x, n_z = record.step.n_x, record.step.n_z
    if not n_z:
        return record.scales
    z = stages[-n_z:]
    unit = np.maximum(z.std(axis=1), 1e-3 * np.abs(z).max(axis=1))
    unit = np.where(np.isfinite(unit) & (unit > 0), unit, 1.0)
    f = record.step.closing
    by_z = f.factory("slope", f.name_in(), [f"jac:{f.name_out(0)}:{f.name_in(2)}"])
    slope = by_z(theta, first[:n_x], first[n_x:], record.nodes[:, 0], 0.0)
    rows = np.abs(slope.full()) @ unit
    rows = np.where(np.isfinite(rows) & (rows > 0), rows, 1.0)
    return Scales(record.scales.x, record.scales.z * unit, record.scales.g * rows)


def rescaled(values: Array, old: Scales, new: Scales) -> Array:
    """Nodes or stages, shape (k (n_x + n_z), ...), from one set of scales to another."""
    ratio = np.concatenate([old.x / new.x, old.z / new.z])
    shape = (-1, ratio.size, *values.shape[1:])
    by = ratio.reshape(1, -1, *([1] * (values.ndim - 1)))
    return np.asarray((values.reshape(shape) * by).reshape(values.shape))
