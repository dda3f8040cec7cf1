"""From a fitted stack of records to sensitivities of the parameters, nuisances eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from identification.estimation.estimates import meanings
from identification.estimation.result import Estimation
from identification.study.joint import JointPoint, JointProblem
from identification.study.residual import ResidualEvaluation, slots, values_at
from identification.study.scaled import Free
from identification.uncertainty.information import Information, Sensitivities, information

SIMULATED = ("single_shooting", "multiple_shooting", "collocation")
EARLY = 11.5
"""Logarithmic bounds beyond this distance are those that only keep numbers finite."""
VANISHED = 1e-3
"""Part of the usual change of the readings below which a parameter has vanished."""
RESTORED = 3
FARTHEST = 30.0
"""Logarithm by which one that has vanished is changed at the most."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """One parameter among the global unknowns of a stack.

    Attributes
    ----------
    name : str
    place : int
        Position among the unknowns.
    free : Free
        Its value, SI; a logarithmic one has the start as its scale.
    lower, upper : float
        Bounds, SI; infinite (or zero) where there is none.
    prior : float
        Precision of a prior that was given, on theta; 0 for the weak one of every fit.
    """

    name: str
    place: int
    free: Free
    lower: float
    upper: float
    prior: float = 0.0


def unknowns(stack: JointProblem) -> tuple[Unknown, ...]:
    """Return the parameters of a stack: neither lags, offsets and clocks nor command offsets."""
    lower, upper = stack.bounds
    found: dict[int, Unknown] = {}
    given = {n for p in stack.problems for n in p.priors}
    for place, f in stack.of_model.items():
        low, high = float(lower[place]), float(upper[place])
        if f.log:
            low = -np.inf if low < -EARLY else low
            high = np.inf if high > EARLY else high
        found[place] = Unknown(
            stack.names[place], place, replace(f, scale=f.start) if f.log else f,
            f.value(low) if np.isfinite(low) else (0.0 if f.log else low),
            f.value(high) if np.isfinite(high) else high,
            float(stack.prior[0][place]) ** 2 if f.parameter.name in given else 0.0,
        )  # fmt: skip
    for p, columns, factors in zip(stack.problems, stack.columns, stack.factors, strict=True):
        for j, late in enumerate(meanings(p)[slots(p).delays], start=slots(p).delays.start):
            place, step = int(columns[j]), late.scale * float(factors[j])
            if upper[place] <= lower[place]:
                continue  # held: nothing is unknown
            ends = (float(lower[place]) * step, float(upper[place]) * step)
            late = replace(late, scale=step)
            found.setdefault(place, Unknown(stack.names[place], place, late, *ends))
    return tuple(found[k] for k in sorted(found))


@dataclass(frozen=True, eq=False)
class FitView:
    """A fit as the functions of this package want it.

    Attributes
    ----------
    stack : JointProblem
    point : JointPoint
        Where it ended.
    parameters : tuple of Unknown
    sensitivities : Sensitivities
        Of the parameters, initial states and nuisances eliminated.
    residual : ndarray, shape (M,)
        Weighted, measured less simulated.
    channels : tuple of int
        Residuals of each reading of each window of each record, in order.
    sum_of_squares : float
        Of residuals and given priors; weak priors of free parameters left out.
    known_noise : bool
        Whether the noise levels were given rather than estimated.
    readings : tuple of int
        How many of the channels are the readings of each window.
    """

    stack: JointProblem
    point: JointPoint
    parameters: tuple[Unknown, ...]
    sensitivities: Sensitivities
    residual: FloatArray
    channels: tuple[int, ...]
    sum_of_squares: float
    known_noise: bool = False
    readings: tuple[int, ...] = ()

    @property
    def freedom(self) -> int:
        """Scored residuals less unknowns."""
        return max(int(np.count_nonzero(self.residual)) - self.stack.n, 1)

    @property
    def variance(self) -> float:
        """Mean square of the weighted residuals; 1 if the noise levels were given."""
        if self.known_noise:
            return 1.0
        return float(self.residual @ self.residual) / self.freedom

    @property
    def prior(self) -> FloatArray:
        """Precision of the given priors, shape (n,)."""
        return np.array([u.prior for u in self.parameters])

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Bounds of the parameters, SI."""
        return {u.name: (u.lower, u.upper) for u in self.parameters}

    def of(self, name: str) -> Unknown:
        """Return a parameter by name."""
        return self.parameters[self.sensitivities.index(name)]

    @cached_property
    def plain(self) -> Information:
        """Information as if the residuals were white."""
        return information(self.sensitivities, prior=self.prior, variance=self.variance)

    @cached_property
    def robust(self) -> Information:
        """Information with the sandwich, right for coloured residuals too."""
        return information(
            self.sensitivities, self.residual, prior=self.prior, channels=self.channels,
            variance=self.variance, readings=self.readings,
        )  # fmt: skip

    def inflation(self, name: str) -> float:
        """Return sandwich over plain variance of a parameter, at least 1."""
        i = self.sensitivities.index(name)
        plain, robust = self.plain.covariance[i, i], self.robust.covariance[i, i]
        return float(max(robust / plain, 1.0)) if plain > 0 else 1.0

    @cached_property
    def known(self) -> dict[str, float]:
        """Parameters of the model that are not fitted, SI."""
        free = {n.partition(" @")[0] for n in self.sensitivities.names}
        problem = self.stack.problems[0]
        values = values_at(problem, self.stack.local(self.point, 0).theta)
        return {n: v for n, v in values.items() if n in problem.graph.parameters and n not in free}

    def restored(self) -> FitView:
        """Return the fit where no positive parameter has vanished, as a part of a sum may.

        Those that hardly move the readings are changed until they do as others: at such a point a
        structure shows that is not seen beside a part of nothing.
        """
        seen = self
        for _ in range(RESTORED):  # how far is only foretold well from near by
            if (moved := seen._less_vanished()) is None:
                break
            seen = moved
        return seen

    def _less_vanished(self) -> FitView | None:
        size = self.sensitivities.strength
        usual = float(np.median(size))
        small = [
            i for i, u in enumerate(self.parameters)
            if u.free.log and 0.0 < size[i] < VANISHED * usual
        ]  # fmt: skip
        if not small:
            return None

        def moved(by: FloatArray) -> FitView:
            theta = self.point.theta.copy()
            theta[[self.parameters[i].place for i in small]] += by
            return fitted(self.stack, JointPoint(theta, self.point.states))

        lack = np.log(usual / size[small])
        more = moved(np.ones(len(small))).sensitivities.strength[small] > size[small]
        return moved(np.where(more, 1.0, -1.0) * np.minimum(lack, FARTHEST))

    def elsewhere(self, shift: float = 0.1, seed: int = 0) -> Sensitivities:
        """Return the sensitivities at parameters moved by about `shift` (relative).

        A combination that is constant along a flat direction is so there too. Where the model
        overflows there, they are moved by less; where it always does, not at all.
        """
        rng = np.random.default_rng(seed)
        ways = [rng.uniform(-1, 1) for _ in self.parameters]
        lower, upper = self.stack.bounds
        here = self.point.theta  # one that was restored may be beyond a bound
        for part in PARTS:
            theta = here.copy()
            for u, way in zip(self.parameters, ways, strict=True):
                theta[u.place] += part * shift * way
            theta = np.clip(theta, np.minimum(lower, here), np.maximum(upper, here))
            moved = JointPoint(theta, self.point.states)
            made = tuple(self.stack.evaluate(moved))
            if (
                all(np.isfinite(e.residual).all() for e in made)
                and np.isfinite(self.stack.projected(made, moved)).all()
            ):
                return fitted(self.stack, moved, made).sensitivities
        return self.sensitivities


PARTS = (1.0, 0.3, 0.1, 0.03)
"""Of a shift, tried in turn until the model answers with numbers."""


def fitted(
    stack: JointProblem,
    point: JointPoint,
    evaluations: Sequence[ResidualEvaluation] | None = None,
    *,
    known_noise: bool = False,
) -> FitView:
    """Return sensitivities and residuals of `stack` at `point`."""
    made = stack.evaluate(point) if evaluations is None else tuple(evaluations)
    jacobian = stack.projected(made, point)
    residual = np.concatenate([e.residual for e in made])
    parameters = unknowns(stack)
    lower, upper = stack.bounds
    own = [u.place for u in parameters]
    others = [i for i in range(stack.n) if i not in own and upper[i] > lower[i]]
    columns = _without(jacobian[:, own], jacobian[:, others], stack.prior[0][others])
    s = Sensitivities(
        tuple(u.name for u in parameters),
        np.array([u.free.value(float(point.theta[u.place])) for u in parameters]),
        columns,
        tuple(u.free.log for u in parameters),
        np.array([abs(u.free.scale) for u in parameters]),
        tuple(u.free.parameter.unit for u in parameters),
    )
    channels, total = stack.channels(made), sum_of_squares(stack, made, point)
    return FitView(
        stack, point, parameters, s, residual, channels, total, known_noise, stack.readings(made)
    )


def from_estimation(estimation: Estimation) -> FitView:
    """Return the fit of an estimation.

    Raises
    ------
    UnusableInput
        Its method does not minimise the simulated misfit, or the fit broke.

    Examples
    --------
    >>> [p.name for p in from_estimation(fit).parameters]
    ['m', 'd', 'k']
    """
    if estimation.method not in SIMULATED:
        raise UnusableInput(
            f"{estimation.study.graph.name}: a fit by {estimation.method} minimises another misfit "
            f"than the simulated one; fit by {SIMULATED[0]} from its values first"
        )
    if not np.isfinite(estimation.cost):
        raise UnusableInput(
            f"{estimation.study.graph.name}: the fit {estimation.status.value}; nothing can be "
            "said about its parameters"
        )
    noise = estimation.study.noise
    sensors = {n for p in estimation.stack.problems for n in p.data.names}
    known = not isinstance(noise, str) and sensors <= set(noise)
    return fitted(estimation.stack, estimation.point, known_noise=known)


def _without(columns: FloatArray, nuisances: FloatArray, weight: FloatArray) -> FloatArray:
    """Return what is left of `columns` beside the nuisances, as far as their priors let these move.

    With nuisances ``N`` and weights ``W`` of their priors it is the root of ``I - N (N'N + W'W)^-1
    N'`` times the columns, so that its Gram matrix is the information of the parameters alone.
    """
    if not nuisances.shape[1]:
        return columns
    stacked = np.vstack([nuisances, np.diag(weight)])
    q, _ = np.linalg.qr(stacked)
    u, s, _ = np.linalg.svd(q[: columns.shape[0]], full_matrices=False)
    taken = 1.0 - np.sqrt(np.maximum(1.0 - s**2, 0.0))
    return np.asarray(columns - u @ (taken[:, None] * (u.T @ columns)))


def sum_of_squares(
    stack: JointProblem,
    evaluations: Sequence[Any],
    point: JointPoint,
    parameters: Sequence[Unknown] | None = None,
) -> float:
    """Return the sum of squares of residuals, nuisances' and given priors, without weak priors."""
    weight, centre = stack.prior
    total = stack.cost(evaluations, point) * stack.count(evaluations)
    for u in unknowns(stack) if parameters is None else parameters:
        if not u.prior:
            total -= float((weight[u.place] * (point.theta[u.place] - centre[u.place])) ** 2)
    return total
