"""Weights of operators in parallel: a convex problem, solved as one.

``min |Phi w + y0 - y|^2`` subject to ``w_i >= minimum`` or to ``w_0 + ... + w_i >= minimum``. In
the partial sums the second is a bound as well, so both are bounded least squares, on the triangle
of ``[1 Phi y]`` instead of the N samples.

Sizes: N samples, n operators.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from threadpoolctl import threadpool_limits

from bondgraph.hysteresis.errors import BadInput, BadParameter
from bondgraph.hysteresis.fitting.bounded import bounded_least_squares, column_norms
from bondgraph.hysteresis.fitting.excited import Unexcited, unexcited_columns
from bondgraph.hysteresis.fitting.reduction import Reduced, reduce_blocks
from bondgraph.hysteresis.fitting.result import Constraint, LinearFit
from bondgraph.support.ops import FloatArray


def fit_linear_blocks(
    blocks: Iterable[tuple[FloatArray, FloatArray]],
    constraint: Constraint,
    *,
    minimum: float | Sequence[float] | FloatArray = 0.0,
    offset: bool = False,
    names: Sequence[str] | None = None,
    advice: str = "",
) -> LinearFit:
    """Fit the weights of any operators whose outputs are known, block by block.

    Columns that never move or are combinations of others get weight 0.

    Parameters
    ----------
    blocks : iterable of (array, array)
        Outputs of the single operators, shape (samples, n), and what they are to explain, shape
        (samples,), both finite.
    constraint : {"non_negative", "prefix_sums", "none"}
        Condition on the weights.
    minimum : float or sequence of float, optional
        Lower bound of every weight (``"non_negative"``) or partial sum (``"prefix_sums"``), not
        negative; shape () or (n,); output per unit of a regressor.
    offset : bool, optional
        Fit an unknown constant as well.
    names : sequence of str, optional
        Names of the operators for the reasons, shape (n,).
    advice : str, optional
        Added to the reason of an operator that never moves.

    Returns
    -------
    LinearFit
        The global minimum over all blocks.

    Raises
    ------
    BadInput
        If there are fewer samples than weights, or no regressor moves.
    BadParameter
        If an option is unknown or out of its domain.

    Examples
    --------
    >>> outputs = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    >>> fit = fit_linear_blocks([(outputs, np.array([2.0, -1.0, 2.0]))], "non_negative")
    >>> fit.weights.round(12).tolist(), fit.active
    ([2.0, 0.0], (1,))
    """
    if constraint not in ("prefix_sums", "non_negative", "none"):
        raise BadParameter(
            f"constraint = {constraint!r} is unknown; take 'prefix_sums', 'non_negative' or 'none'"
        )
    # The matrices are small: more threads only wait for each other, badly on a busy machine.
    with threadpool_limits(1, user_api="blas"):
        reduced = reduce_blocks(_with_ones(blocks))
        return _problem(reduced, constraint, minimum, offset, names, advice).solve()


def _problem(
    reduced: Reduced,
    constraint: Constraint,
    minimum: float | Sequence[float] | FloatArray,
    offset: bool,
    names: Sequence[str] | None,
    advice: str,
) -> _Problem:
    n = reduced.lowest.size - 2
    if reduced.n_rows < n + offset:
        raise BadInput(
            f"{reduced.n_rows} samples cannot determine {n} weights{' and an offset' * offset}; "
            "record more or take fewer operators"
        )
    labels = [f"operator {i}" for i in range(n)] if names is None else list(names)
    lower = _lower_bounds(constraint, minimum, n)
    return _Problem(reduced, constraint, lower, offset, labels, advice)


def _with_ones(blocks: Iterable[tuple[FloatArray, FloatArray]]) -> Iterator[FloatArray]:
    for matrix, y in blocks:
        yield np.concatenate((np.ones((y.size, 1)), matrix, y[:, None]), axis=1)


def _lower_bounds(
    constraint: Constraint, minimum: float | Sequence[float] | FloatArray, n: int
) -> FloatArray:
    if constraint == "none":
        return np.full(n, -np.inf)
    bounds = np.asarray(minimum, dtype=np.float64)
    if bounds.shape not in ((), (n,)):
        raise BadParameter(f"minimum must be one number or {n}, not of shape {bounds.shape}")
    bad = np.flatnonzero(~(np.isfinite(bounds) & (bounds >= 0.0)))
    if bad.size:
        raise BadParameter(f"minimum = {bounds.flat[bad[0]]} must be finite and not negative")
    return np.broadcast_to(bounds, (n,)).copy()


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The reduced problem; the columns of its triangle are 1, Phi and y."""

    reduced: Reduced
    constraint: Constraint
    lower: FloatArray
    offset: bool
    names: list[str]
    advice: str

    def solve(self) -> LinearFit:
        """Choose the columns, solve, and go back to the weights."""
        triangle, n_rows = self.reduced.triangle, self.reduced.n_rows
        kept, silent = self._choose()
        used = triangle[:, self._columns(kept)]
        back = self._back(kept)
        matrix = used @ back
        bounds = np.concatenate((np.full(int(self.offset), -np.inf), self._bounds(kept)))
        solution, on_bound = bounded_least_squares(matrix, triangle[:, -1], bounds)
        fitted = back @ solution
        residual = used @ fitted - triangle[:, -1]
        misfit = float(residual @ residual)
        errors = _standard_errors(matrix, back, ~on_bound, misfit, n_rows)
        first = int(self.offset)
        weights, deviations = np.zeros(self.lower.size), np.full(self.lower.size, np.inf)
        weights[kept], deviations[kept] = fitted[first:], errors[first:]
        return LinearFit(
            weights=weights,
            offset=float(fitted[0]) if self.offset else 0.0,
            rms=float(np.sqrt(misfit / n_rows)),
            n_samples=n_rows,
            constraint=self.constraint,
            lower=self.lower,
            active=tuple(kept[i] for i in np.flatnonzero(on_bound[first:])),
            unexcited=silent,
            standard_errors=deviations,
            offset_error=float(errors[0]) if self.offset else 0.0,
            condition=float(np.linalg.cond(matrix / column_norms(matrix))),
        )

    def _choose(self) -> tuple[list[int], tuple[Unexcited, ...]]:
        """Return the operators to fit, and the reasons against the others."""
        triangle, n = self.reduced.triangle, self.lower.size
        kept, silent = unexcited_columns(
            triangle[:, 1:-1],
            self.reduced.lowest[1:-1],
            self.reduced.highest[1:-1],
            self.names,
            self.advice,
            offset=triangle[:, : int(self.offset)],
        )
        if not kept:
            raise BadInput(
                f"none of the {n} operators moves on this record; take smaller thresholds or a "
                "larger input" + (f"; {self.advice}" if self.advice else "")
            )
        return kept, silent

    def _columns(self, kept: list[int]) -> list[int]:
        return [0] * self.offset + [1 + j for j in kept]

    def _bounds(self, kept: list[int]) -> FloatArray:
        """Return the lower bounds of the unknowns; dropped operators repeat the sum before them."""
        if self.constraint != "prefix_sums":
            return self.lower[kept]
        return np.maximum.reduceat(self.lower, kept)

    def _back(self, kept: list[int]) -> FloatArray:
        """Return the matrix from the bounded unknowns to offset and weights."""
        n = self.offset + len(kept)
        if self.constraint != "prefix_sums":
            return np.eye(n)
        back: FloatArray = np.eye(n) - np.eye(n, k=-1)
        if self.offset:
            back[1, 0] = 0.0
        return back


def _standard_errors(
    matrix: FloatArray, back: FloatArray, passive: NDArray[np.bool_], misfit: float, n_samples: int
) -> FloatArray:
    """Return the standard errors of ``back s`` when only the ``passive`` part of s is unknown."""
    free = n_samples - int(passive.sum())
    if free <= 0:
        return np.full(back.shape[0], np.inf)
    columns = matrix[:, passive]
    scale = column_norms(columns)
    r = np.linalg.qr(columns / scale, mode="r")
    spread = solve_triangular(r, (back[:, passive] / scale).T, trans="T")
    errors: FloatArray = np.sqrt(misfit / free) * np.linalg.norm(spread, axis=0)
    return errors
