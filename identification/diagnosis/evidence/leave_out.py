"""Every training sample held out once, for the price of the one fit that used them all.

Leaving a stretch b out moves the optimum of the fit so that the residual of b becomes

    r_b(-b) = r_b + J_b (A - J_b' J_b)^-1 J_b' r_b,     A = J' J + L,

with the exact sensitivities J (initial states among the columns) and the precision L of the
priors: an identity for linear models, the infinitesimal jackknife for others (Giordano et al.,
A Swiss army infinitesimal jackknife, AISTATS 2019).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import Array
from identification.estimation.single_record import Fit
from identification.statistics.blocks import block_index
from identification.study.joint import STATE_WEIGHT, stack_of
from identification.study.problem import Problem
from identification.study.residual import ResidualEvaluation, evaluate, windows

Index = NDArray[np.intp]

BLOCKS = 40
"""Stretches of the training samples."""
HEAVY = 0.5
"""Leverage of a stretch above which the identity is not followed further: it decides alone."""
FEW = 400
"""Columns of initial states that are counted; with more windows each keeps its own states."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Sample, channel and stretch of every training residual, shapes (M,)."""

    sample: Index
    channel: Index
    block: Index

    @property
    def blocks(self) -> int:
        """Number of stretches."""
        return int(self.block.max(initial=-1)) + 1

    @cached_property
    def order(self) -> Index:
        """Positions of the residuals, stretch after stretch."""
        return np.argsort(self.block, kind="stable")

    @cached_property
    def ends(self) -> Index:
        """Where the stretches begin and end in that order, shape (B + 1,)."""
        return np.searchsorted(self.block[self.order], np.arange(self.blocks + 1))


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Training residuals over the floor, each predicted without its own stretch.

    Attributes
    ----------
    residual : ndarray, shape (M,)
    fitted : ndarray, shape (M,)
        The same with the stretch in the fit.
    leverage : ndarray, shape (B,)
        Largest share of a direction of the unknowns that each stretch decides alone.
    """

    rows: Rows
    residual: Array
    fitted: Array
    leverage: Array


@dataclass(frozen=True, eq=False)
class Stretched:
    """Columns stretch after stretch, with their products within each.

    Attributes
    ----------
    columns : ndarray, shape (M, p)
        In the order of `Rows.order`.
    products : ndarray, shape (B, p, p)
    """

    rows: Rows
    columns: Array
    products: Array

    def beside(self, x: Array) -> Stretched:
        """Return these columns and others, shape (M, k), in the order of the residuals."""
        # column by column, as they lie in memory
        both = np.concatenate([self.columns.T, x.T.take(self.rows.order, axis=1)]).T
        known = self.columns.shape[1]
        products = np.empty((self.rows.blocks, both.shape[1], both.shape[1]))
        products[:, :known, :known] = self.products
        for b, (begin, end) in enumerate(pairwise(self.rows.ends)):
            part = both[begin:end]
            cross = part.T @ part[:, known:]
            products[b, :, known:], products[b, known:] = cross, cross.T
        return Stretched(self.rows, both, products)

    def held_out(self, residual: Array, precision: Array) -> LeftOut:
        """Apply the identity.

        Parameters
        ----------
        residual : ndarray, shape (M,)
            In the order of `Rows`.
        precision : ndarray, shape (p,)
            Diagonal of the prior's precision.
        """
        rows, total = self.rows, self.products.sum(axis=0)
        size = np.sqrt(np.diag(total) + precision)
        used = (size > 0) & np.isfinite(size)
        at = np.ix_(used, used)
        a = (total[at] + np.diag(precision[used])) / np.outer(size[used], size[used])
        power, axes = np.linalg.eigh(a)
        kept = power > 1e-12 * power.max(initial=0.0)
        root = axes[:, kept] / np.sqrt(power[kept]) / size[used][:, None]
        x = self.columns if used.all() else self.columns[:, used]
        out, leverage = residual[rows.order], np.zeros(rows.blocks)
        for b, (begin, end) in enumerate(pairwise(rows.ends)):
            lever, turn = np.linalg.eigh(root.T @ self.products[b][at] @ root)
            score = turn.T @ (root.T @ (x[begin:end].T @ out[begin:end]))
            weights = turn @ (score / np.maximum(1.0 - lever, 1.0 - HEAVY))
            out[begin:end] += x[begin:end] @ (root @ weights)
            leverage[b] = lever[-1] if lever.size else 0.0
        back = np.empty_like(out)
        back[rows.order] = out
        return LeftOut(rows, back, residual, leverage)


def stretched(columns: Array, rows: Rows) -> Stretched:
    """Sort columns (M, p) by stretch."""
    nothing = Stretched(rows, np.zeros((columns.shape[0], 0)), np.zeros((rows.blocks, 0, 0)))
    return nothing.beside(columns)


def rows_of(problem: Problem, blocks: int = BLOCKS) -> Rows:
    """Return where every training residual of a problem stands."""
    train = problem.data.mask("train")
    n_y = len(problem.data.names)
    order = np.zeros(train.size, np.intp)
    order[train] = block_index(int(train.sum()), blocks)
    samples, channels = [], []
    for w in windows(problem):
        chosen = np.flatnonzero(train[w]) + (w.start or 0)
        samples.append(np.tile(chosen, n_y))
        channels.append(np.repeat(np.arange(n_y), chosen.size))
    none = [np.zeros(0, np.intp)]
    sample = np.concatenate(samples or none)
    return Rows(sample, np.concatenate(channels or none), order[sample])


def left_out(fit: Fit, blocks: int = BLOCKS) -> LeftOut:
    """Predict every training stretch of a fit from the others."""
    e = evaluate(fit.problem, fit.point, scored=True)
    rows = rows_of(fit.problem, blocks)
    columns, precision = _unknowns(fit, e)
    return stretched(columns, rows).held_out(e.residual, precision)


def _unknowns(fit: Fit, e: ResidualEvaluation) -> tuple[Array, Array]:
    """Columns of everything the fit moved, and the precision of its priors; bounds hold still."""
    problem = fit.problem
    stack = stack_of((problem,))
    weight = stack.prior[0]
    lower, upper = stack.bounds
    free = (fit.point.theta > lower + 1e-9) & (fit.point.theta < upper - 1e-9)
    parts, precision = [e.jacobian[:, free]], [weight[free] ** 2]
    states = states_of(problem, e)
    parts.append(states)
    each = problem.free_states.size
    own = (STATE_WEIGHT / problem.state_scale[problem.free_states]) ** 2 if each else np.zeros(0)
    if problem.window is not None:
        own = 0.0 * own
    precision.append(np.tile(own, states.shape[1] // max(each, 1)))
    return np.hstack(parts), np.concatenate(precision)


def states_of(problem: Problem, e: ResidualEvaluation) -> Array:
    """Columns of the initial states of all windows, shape (M, k); none where they are too many."""
    total = sum(matrix.shape[1] for _, matrix in e.local)
    if total > FEW:
        return np.zeros((e.residual.size, 0))
    out = np.zeros((e.residual.size, total))
    at = 0
    for rows, matrix in e.local:
        out[rows, at : at + matrix.shape[1]] = matrix
        at += matrix.shape[1]
    return out


def stretch_sums(rows: Rows, values: Array, channels: int) -> Array:
    """Sum values (M,) by stretch and channel, shape (B, channels)."""
    place = rows.block * channels + rows.channel
    total = np.bincount(place, values, rows.blocks * channels)
    return total.reshape(rows.blocks, channels)
