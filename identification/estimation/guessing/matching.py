"""Thousands of parameter sets tried on measured responses at once, the best ones refined.

The misfit is that of the logarithm of the response, gain and phase, which stays tame when
parameters are wrong by decades: a product of factors becomes a sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import ComplexArray
from bondgraph.support.arrays import FloatArray as Array
from identification.estimation.guessing.measured import Measured
from identification.statistics.sobol import sobol
from identification.study.joint import JointProblem
from identification.study.problem import Problem
from identification.study.residual import output_delays, slots

FAR = 1e6
"""Misfit of what cannot be evaluated."""
DECADES = 2.5 * np.log(10.0)
LINEAR_SCALES = 3.0
HOLD_ON = 0.02
"""Weight that keeps what the response does not determine near its start."""
STEP = 1e-5
SOLVES = 600_000
"""Linear systems that the first look may solve, times their size."""
FIRST_PASSES, LAST_PASSES, KEPT = 8, 24, 8
"""Passes of all the best of the first look, then of the best of these."""


@dataclass(frozen=True, eq=False)
class Matching:
    """Misfit of many parameter sets to the measured responses of a stack.

    Attributes
    ----------
    stack : JointProblem
    measured : tuple of Measured or None
        One a record.
    """

    stack: JointProblem
    measured: tuple[Measured | None, ...]

    def residual(self, thetas: Array) -> Array:
        """Return weighted logarithms of the ratio, shape (S, M), of S points (S, n)."""
        pieces = []
        for r, (p, m) in enumerate(zip(self.stack.problems, self.measured, strict=True)):
            if m is None:
                continue
            local = thetas[:, self.stack.columns[r]] * self.stack.factors[r]
            response = _responses(p, local, m)
            with np.errstate(all="ignore"):
                error = np.log(response) - m.logarithm
                error = error.real + 1j * (np.mod(error.imag + np.pi, 2.0 * np.pi) - np.pi)
                error = np.where(m.weight > 0.0, error * m.weight, 0.0)
            flat = error.reshape(thetas.shape[0], -1)
            pieces += [flat.real, flat.imag]
        joined = np.concatenate(pieces, axis=1)
        return np.where(np.isfinite(joined), joined, FAR)

    @property
    def count(self) -> int:
        """Number of residuals that say something."""
        return 2 * sum(m.count for m in self.measured if m is not None)


def _responses(problem: Problem, local: Array, m: Measured) -> ComplexArray:
    """Responses of the model's small motions, shape (S, F, n_y, n_m)."""
    dynamics, names = problem.dynamics, problem.dynamics.parameter_names
    p = np.tile(problem.start_vector, (local.shape[0], 1))
    for i, f in enumerate(problem.free):
        at = names.index(f.parameter.name)
        p[:, at] = f.start * np.exp(local[:, i]) if f.log else f.start + f.scale * local[:, i]
    s = np.asarray(1j * m.omega, complex)
    drive = dynamics.drive([dynamics.input_names[i] for i in m.inputs], s)
    made = dynamics.small_signal(p, problem.mean_inputs)
    response = made.response(s, drive)[:, :, : len(problem.data.names)]
    turn = 1j * m.omega * problem.data.dt
    lags = output_delays(problem, np.zeros(slots(problem).size) + local[0])
    response = response * np.exp(-turn[:, None] * lags)[None, :, :, None]
    if problem.data.between == "hold":
        response = response * ((1.0 - np.exp(-turn)) / turn)[None, :, None, None]
    elif problem.data.between == "linear":
        response = response * (np.sinc(turn.imag / (2 * np.pi)) ** 2)[None, :, None, None]
    return np.asarray(response)


def matched(
    matching: Matching, start: Array, vary: Sequence[int], seed: int, best: int = 24
) -> tuple[Array, Array]:
    """Return distinct matches, best first, (K, n), and their mean square misfits, (K,).

    Parameters
    ----------
    start : ndarray, shape (n,)
    vary : sequence of int
        Unknowns that the responses depend on.
    seed : int
        Of the Sobol sequence.
    """
    at = np.asarray(vary, int)
    low, high = _range(matching.stack, start, at)
    lines = sum(m.omega.size for m in matching.measured if m is not None)
    states = max(p.dynamics.n_x for p in matching.stack.problems)
    most = int(np.clip(SOLVES / max(lines * states, 1), 256, 4096))
    unit = sobol(most, at.size, seed)
    points = np.tile(start, (most + 1, 1))
    points[1:, at] = low + unit * (high - low)
    first = np.concatenate(
        [np.mean(matching.residual(c) ** 2, axis=1) for c in np.array_split(points, 8)]
    )
    order = np.argsort(first, kind="stable")[:best]
    if 0 not in order:
        order[-1] = 0
    found, cost = _refined(matching, points[order], start, at, FIRST_PASSES)
    found, cost = _distinct(found, cost, at)
    found, cost = _refined(matching, found[:KEPT], start, at, LAST_PASSES)
    return _distinct(found, cost, at)


def _range(stack: JointProblem, start: Array, at: NDArray[np.intp]) -> tuple[Array, Array]:
    lower, upper = stack.bounds
    reach = np.where(np.isfinite(stack.lowest), DECADES, LINEAR_SCALES)
    low = np.maximum(lower, start - reach)[at]
    high = np.minimum(upper, start + reach)[at]
    return low, np.maximum(high, low)


def _refined(
    matching: Matching, points: Array, start: Array, at: NDArray[np.intp], passes: int
) -> tuple[Array, Array]:
    """Levenberg-Marquardt on all points at once, derivatives by differences."""
    lower, upper = (b[at] for b in matching.stack.bounds)
    points = points.copy()
    many, n = points.shape[0], at.size
    damping = np.full(many, 1e-2)
    residual = matching.residual(points)
    pull = HOLD_ON * (points[:, at] - start[at])
    cost = np.sum(residual**2, axis=1) + np.sum(pull**2, axis=1)
    for _ in range(passes):
        probes = np.repeat(points, n, axis=0)
        for j in range(n):
            probes[j::n, at[j]] += STEP
        shifted = matching.residual(probes).reshape(many, n, -1)
        # the gap of a phase that wraps is no slope
        jacobian = np.clip((shifted - residual[:, None]) / STEP, -1e4, 1e4)
        gram = jacobian @ jacobian.transpose(0, 2, 1) + HOLD_ON**2 * np.eye(n)
        right = -(jacobian @ residual[:, :, None])[:, :, 0] - HOLD_ON * pull
        size = np.einsum("sii->si", gram)
        damped = gram + damping[:, None, None] * np.eye(n) * size[:, :, None]
        step = np.clip(np.linalg.solve(damped, right[:, :, None])[:, :, 0], -1.5, 1.5)
        trial = points.copy()
        trial[:, at] = np.clip(points[:, at] + step, lower, upper)
        after = matching.residual(trial)
        pulled = HOLD_ON * (trial[:, at] - start[at])
        new = np.sum(after**2, axis=1) + np.sum(pulled**2, axis=1)
        better = new < cost
        gain = np.max(np.where(better, (cost - new) / np.maximum(cost, 1e-300), 0.0))
        points[better], residual[better], pull[better] = (
            trial[better],
            after[better],
            pulled[better],
        )
        cost = np.where(better, new, cost)
        damping = np.clip(np.where(better, damping / 8.0, damping * 8.0), 1e-9, 1e8)
        if gain < 1e-4 and (better | (damping > 1e4)).all():
            break
    return points, cost / max(matching.count, 1)


def _distinct(points: Array, cost: Array, at: NDArray[np.intp]) -> tuple[Array, Array]:
    kept: list[int] = []
    for i in np.argsort(cost, kind="stable"):
        if all(np.abs(points[i, at] - points[k, at]).max(initial=0.0) > 0.05 for k in kept):
            kept.append(int(i))
    return points[kept], cost[kept]
