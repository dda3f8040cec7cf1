"""Refit of all parameters to what a relation sees: Gauss-Newton on the blind residual.

The whole model counts, the filter too: a latent signal passes through the plant, so that wrong
parameters turn the direction the relation must be blind to. Its derivative by the parameters is
taken by differences, that of the residual is exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.fractional_delay import delayed_values
from bondgraph.support.arrays import Array
from bondgraph.support.descent import Damping, Ended, Trial, descend
from bondgraph.support.tall import triangle
from identification.diagnosis.localisation.relations.whitening import Blind
from identification.estimation.single_record import Fit
from identification.study.joint import JointProblem, stack_of
from identification.study.problem import Problem
from identification.study.residual import (
    Point,
    ResidualEvaluation,
    evaluate,
    output_delays,
    slots,
    weighted,
    windows,
)

DIFFERENCE = 1e-4
LATE = 1e-3
SETTLED = 60
"""Samples after which a start costs no more degrees of freedom."""
ENOUGH = 1e-3
"""Relative gain of a step below which a refit is taken to have arrived."""


@dataclass(frozen=True, eq=False)
class Refitted:
    """How far a relation is from the floor, before and after its refit.

    Attributes
    ----------
    before, train, test : float
        Sum of squares over its expectation at the floor: training data at the nominal values,
        training and held-out data at the refitted ones.
    count : float
        Degrees of freedom of the training data.
    theta : ndarray
        The refitted unknowns.
    moving : bool
        Whether further steps would still improve it.
    """

    before: float
    train: float
    test: float
    count: float
    theta: Array
    moving: bool


@dataclass(frozen=True, eq=False)
class BlindProblem:
    """A fitted problem as one relation sees it.

    Attributes
    ----------
    fit : Fit
        The nominal fit.
    filter_at : callable
        The blind filter at given unknowns.
    port : str
        Whose signal it is blind to.
    sides : int
        Latent signals there.
    """

    fit: Fit
    filter_at: Callable[[Array], Blind]
    port: str = ""
    sides: int = 1

    @property
    def problem(self) -> Problem:
        """The fitted problem."""
        return self.fit.problem

    @cached_property
    def stack(self) -> JointProblem:
        """Bounds and priors."""
        return stack_of((self.problem,))

    @cached_property
    def free(self) -> Array:
        """Positions of the unknowns that may move."""
        lower, upper = self.stack.bounds
        return np.flatnonzero(upper > lower)

    @cached_property
    def stretches(self) -> list[tuple[slice, list[slice]]]:
        """Rows of each training window in the residual vector, and the runs of samples in them."""
        mask, found, filled = self.problem.data.mask("train"), [], 0
        for w in windows(self.problem):
            chosen = np.flatnonzero(mask[w])
            if chosen.size:
                rows = chosen.size * len(self.problem.data.names)
                found.append((slice(filled, filled + rows), unbroken(chosen)))
                filled += rows
        return found

    def at(self, theta: Array, *, derivatives: bool = True) -> ResidualEvaluation:
        """Simulate; the states at the starts are eliminated, not moved."""
        point = Point(theta, self.fit.point.states)
        return evaluate(self.problem, point, derivatives=derivatives)

    def rest(self, e: ResidualEvaluation, theta: Array, blind: Blind) -> Array:
        """Training residual as the filter sees it, stretches of one length after another."""
        made = [
            without_starts(blind(timed(self.problem, theta, r)), blind).ravel()
            for r in self._grouped(e.residual[:, None])
        ]
        return np.concatenate(made)

    def triangle(self, e: ResidualEvaluation, theta: Array, blind: Blind) -> Array:
        """Triangular factor of [columns rest] on training data, filter's derivative included."""
        moved, many = self._moved(theta), self.free.size
        pieces = []
        both = np.concatenate([e.jacobian[:, self.free], e.residual[:, None]], axis=1)
        for block in self._grouped(both):
            block = timed(self.problem, theta, block)
            n_y, _, n = block.shape
            r = np.ascontiguousarray(block[:, many :: many + 1])
            seen = blind(block).reshape(n_y, -1, many + 1, n)
            for i, other in moved:
                seen[:, :, i] -= (other(r) - seen[:, :, many]) / DIFFERENCE
            flat = without_starts(seen.reshape(block.shape), blind)
            pieces += [
                triangle(flat[:, i : i + many + 1]) for i in range(0, flat.shape[1], many + 1)
            ]
        return triangle(np.concatenate(pieces))

    def held_out(self, theta: Array, blind: Blind) -> float:
        """Held-out sum of squares over its expectation."""
        problem, total, count = self.problem, 0.0, 0.0
        e = evaluate(problem, Point(theta, self.fit.point.states), derivatives=False)
        left = problem.data.readings - e.y
        test, runs = problem.data.mask("test"), dict[int, list[Array]]()
        for w in windows(problem):
            chosen = np.flatnonzero(test[w])
            for run in unbroken(chosen):
                part = left[w][chosen[run]]
                r = weighted(problem, part.T[:, :, None].copy()).transpose(0, 2, 1)
                runs.setdefault(r.shape[2], []).append(r)
        for n, blocks in runs.items():
            free = freedom(blind, n)
            if free >= 1.0:
                r = np.concatenate(blocks, axis=1)
                seen = without_starts(blind(timed(self.problem, theta, r)), blind)
                total += float(np.sum(seen**2))
                count += free * len(blocks)
        return total / count if count else np.nan

    def count(self, blind: Blind) -> float:
        """Degrees of freedom of the training data."""
        lengths = [run.stop - run.start for _, runs in self.stretches for run in runs]
        free = {n: max(freedom(blind, n), 1.0) for n in set(lengths)}
        own = sum(free[n] for n in lengths)
        return float(max(own - min(self.free.size, 0.5 * own), 1.0))

    def _grouped(self, rows: Array) -> list[Array]:
        """Rows of residuals as blocks (n_y, g m, n): g stretches of one length, m columns each."""
        n_y, found = len(self.problem.data.names), dict[int, list[Array]]()
        for at, runs in self.stretches:
            whole = rows[at].reshape(n_y, runs[-1].stop, -1).transpose(0, 2, 1)
            for run in runs:
                found.setdefault(run.stop - run.start, []).append(whole[:, :, run])
        return [np.concatenate(blocks, axis=1) for blocks in found.values()]

    def _moved(self, theta: Array) -> list[tuple[int, Blind]]:
        """Return filters a little way along every model parameter."""
        found = []
        model = slots(self.problem).free
        for j, i in enumerate(self.free):
            if model.start <= i < model.stop:
                shifted = theta.copy()
                shifted[i] += DIFFERENCE
                try:
                    found.append((j, self.filter_at(shifted)))
                except np.linalg.LinAlgError:
                    continue
        return found


def timed(problem: Problem, theta: Array, block: Array) -> Array:
    """Undo the delays between channels of a block (n_y, m, n).

    A latent signal reaches the plant, not the clock.
    """
    lags = output_delays(problem, theta)
    away = lags - lags.min()
    if not (away > LATE).any():
        return np.ascontiguousarray(block)
    block = block.copy()
    for c, lag in enumerate(away):
        if lag > LATE:
            block[c] = delayed_values(block[c].T, -float(lag)).T
    return block


def unbroken(chosen: NDArray[np.intp]) -> list[slice]:
    """Positions of samples that follow each other: a filter must not run across what lies between.

    Parameters
    ----------
    chosen : ndarray of int, shape (n,)
        Numbers of samples, rising.

    Examples
    --------
    >>> unbroken(np.array([3, 4, 5, 9, 10]))
    [slice(0, 3, None), slice(3, 5, None)]
    """
    ends = [0, *(np.flatnonzero(np.diff(chosen) > 1) + 1).tolist(), int(chosen.size)]
    return [slice(a, b) for a, b in pairwise(ends)]


def blind_refit(
    seen: BlindProblem, start: ResidualEvaluation, steps: int, theta: Array | None = None
) -> Refitted:
    """Refit the parameters to the residual as the filter at the same parameters sees it.

    Parameters
    ----------
    seen : BlindProblem
    start : ResidualEvaluation
        At the nominal fit, with derivatives.
    steps : int
        Largest number of Gauss-Newton steps.
    theta : ndarray, optional
        Where to begin; the nominal fit if not given.
    """
    nominal = seen.fit.point.theta
    first = _at(seen, nominal, seen.filter_at(nominal), start)
    before = first.cost / seen.count(first.blind)
    if theta is not None:
        first = _at(seen, theta, seen.filter_at(theta), seen.at(theta))
    made = descend(
        first, lambda at: _steps(seen, at), DAMPING, steps,
        lambda old, new: not old.cost - new.cost > ENOUGH * old.cost,
    )  # fmt: skip
    at, count = made.at, seen.count(made.at.blind)
    test = seen.held_out(at.theta, at.blind)
    return Refitted(before, at.cost / count, test, count, at.theta, made.ended is Ended.LIMIT)


DAMPING = Damping(start=1e-4, less=10.0, more=30.0, most=1e3, tries=5)


@dataclass(frozen=True, slots=True, eq=False)
class _Stand:
    """Unknowns, the filter and the simulation there, and what the filter sees of the residual."""

    theta: Array
    blind: Blind
    evaluation: ResidualEvaluation
    cost: float


def _at(seen: BlindProblem, theta: Array, blind: Blind, e: ResidualEvaluation) -> _Stand:
    rest = seen.rest(e, theta, blind)
    return _Stand(theta, blind, e, float(rest @ rest))


def _steps(seen: BlindProblem, at: _Stand) -> Trial[_Stand]:
    """Linearise at a point; what makes the damped steps from there."""
    triangle = seen.triangle(at.evaluation, at.theta, at.blind)

    def trial(damping: float, number: int) -> _Stand | None:
        theta = _stepped(seen, at.theta, triangle, damping)
        # a step that had to be shortened may have to be again
        e = seen.at(theta, derivatives=number == 0)
        if not (np.isfinite(e.residual).all() and np.isfinite(e.jacobian).all()):
            return None
        try:
            made = _at(seen, theta, seen.filter_at(theta), e)
        except np.linalg.LinAlgError:
            return None
        if number == 0 or not made.cost <= at.cost:
            return made
        e = seen.at(theta)
        return replace(made, evaluation=e) if np.isfinite(e.jacobian).all() else None

    return trial


def _stepped(seen: BlindProblem, theta: Array, triangle: Array, damping: float) -> Array:
    """Levenberg-Marquardt step within the bounds."""
    free, stack = seen.free, seen.stack
    lower, upper = stack.bounds
    columns, aim = triangle[:, :-1], triangle[:, -1]
    weight = stack.prior[0][free]
    size = np.hypot(np.linalg.norm(columns, axis=0), weight) + 1e-300
    if not np.isfinite(size).all():
        return theta
    wide = np.vstack([columns / size, np.diag(weight / size), np.sqrt(damping) * np.eye(free.size)])
    step = np.linalg.lstsq(wide, np.concatenate([aim, np.zeros(2 * free.size)]), rcond=None)[0]
    step = np.clip(step / size, -stack.lowest[free], stack.lowest[free])
    trial = theta.copy()
    trial[free] = np.clip(theta[free] + step, lower[free], upper[free])
    return trial


def freedom(blind: Blind, n: int) -> float:
    """Return the expected sum of squares of `n` unit white readings, their unknown start taken out.

    The filter shrinks what any start could do, so that taking it out costs less than a degree of
    freedom each; what it costs is settled after a few samples.
    """
    short = min(n, SETTLED)
    n_y = blind.c.shape[0]
    noise = np.eye(n_y * short).reshape(n_y, short, n_y * short).transpose(0, 2, 1)
    seen = blind(np.ascontiguousarray(noise))
    return float(np.sum(without_starts(seen, blind) ** 2)) + (n - short) * blind.kept


def without_starts(block: Array, blind: Blind) -> Array:
    """Project out the state at the start of a stretch; rows by columns."""
    n_y, m, n = block.shape
    flat = block.transpose(1, 0, 2).reshape(m, n_y * n)
    basis = blind.basis(n)
    return np.asarray((flat - (flat @ basis.T) @ basis).T)
