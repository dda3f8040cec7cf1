"""Optimality system of a collocation fit: covariance, and how far its defects move theta."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from bondgraph.support.arrays import Array
from identification.estimation.methods.interior_point import Found, Runner
from identification.estimation.methods.radau import STAGES
from identification.estimation.methods.transcription import Programme

FINER = 4
"""Steps of the reference for one step of the programme."""
EDGE = 1e-9
"""Distance from a bound at which an unknown counts as held."""


def defects_of(made: Programme, w: Array) -> list[Array]:
    """Return what shorter steps add to each step, scaled; shape (n_x, steps) each."""
    theta, firsts, stages = made.split(w)
    found = []
    for record, first, v in zip(made.records, firsts, stages, strict=True):
        n_x = record.step.n_x
        nodes, _, ends = record.within(theta, first, v, FINER)
        gap = ends[:n_x] - nodes[:n_x, 1:]
        found.append(np.where(np.isfinite(gap), gap, 0.0))
    return found


@dataclass(frozen=True, eq=False)
class OptimalitySystem:
    """Optimality system with theta eliminated last.

    Attributes
    ----------
    factor : SuperLU
        Of trajectories and multipliers, in order of time.
    order : ndarray of int
        Their places in (unknowns, constraints), by time.
    border : ndarray, shape (len(order), n_inner)
        Their coupling to the free entries of theta.
    inner : ndarray of int
        Free entries of theta.
    covariance : ndarray, shape (n, n)
        Zero where theta is held.
    """

    factor: Any
    order: Array
    border: Array
    inner: Array
    covariance: Array
    count: int

    def moved(self, gap: Array, n_w: int) -> Array:
        """How far theta moves if the constraints are moved by `gap`."""
        right = np.concatenate([np.zeros(n_w), gap])[self.order]
        across = -self.border.T @ self.factor.solve(right)
        return np.asarray(self.covariance[np.ix_(self.inner, self.inner)] @ across * self.count)


def optimality(runner: Runner, found: Found) -> OptimalitySystem | None:
    """Factor the optimality system; None if that fails."""
    if not found.done:
        return None
    solver, made = runner.first, runner.made
    n, count = made.stack.n, made.count
    j = solver.get_function("nlp_jac_g")(found.w, found.p)[1].sparse().tocsc()
    upper = solver.get_function("nlp_hess_l")(found.w, found.p, 1.0, found.multipliers)
    upper = upper.sparse().tocsc()
    h = upper + sparse.triu(upper, 1).T
    moving = runner.upper > runner.lower
    moving[:n] &= (found.w[:n] > runner.lower[:n] + EDGE) & (found.w[:n] < runner.upper[:n] - EDGE)
    inner = np.flatnonzero(moving[:n])
    whole = sparse.bmat([[h, j.T], [j, None]], format="csc")
    when = np.concatenate(made.times())
    chosen = np.concatenate([moving, np.ones(j.shape[0], bool)])
    chosen[:n] = False
    order = np.flatnonzero(chosen)
    order = order[np.argsort(when[order], kind="stable")]
    border = whole[:, inner].toarray()
    try:
        factor = splu(whole[order][:, order].tocsc(), permc_spec="NATURAL")
        across = border[order].T @ factor.solve(border[order])
        inverse = np.linalg.inv(border[inner] - across) / count
    except (RuntimeError, np.linalg.LinAlgError):
        return None
    covariance = np.zeros((n, n))
    covariance[np.ix_(inner, inner)] = inverse
    return OptimalitySystem(factor, order, border[order], inner, covariance, count)


def shifted(
    runner: Runner, found: Found, system: OptimalitySystem | None
) -> tuple[float, list[Array]]:
    """How far the defects move theta, in standard errors, and the defects."""
    if system is None:
        return np.inf, []
    made = runner.made
    defects = defects_of(made, found.w)
    right = []
    for record, d in zip(made.records, defects, strict=True):
        size, n_x = record.size, record.step.n_x
        wide = np.zeros((size * STAGES, record.steps))
        wide[size * (STAGES - 1) : size * (STAGES - 1) + n_x] = d
        right.append(wide.ravel(order="F"))
        right.append(np.zeros(record.step.n_z))
        if record.problem.initial == "rest":
            right.append(np.zeros(n_x))
    moved = system.moved(np.concatenate(right), made.w.numel())
    error = np.sqrt(np.maximum(np.diag(system.covariance)[system.inner], 1e-300))
    return float((np.abs(moved) / error).max(initial=0.0)), defects
