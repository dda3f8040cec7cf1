"""Fit the weights of a Prandtl-Ishlinskii operator to a record.

Sizes: N samples, n + 1 operators, number 0 the identity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.fitting.bank import (
    play_advice,
    play_bank,
    play_blocks,
    play_names,
    thin_evidence,
)
from bondgraph.hysteresis.fitting.least_squares import fit_linear_blocks
from bondgraph.hysteresis.fitting.records import paired_records, require_rising
from bondgraph.hysteresis.fitting.result import Constraint, OperatorFit
from bondgraph.hysteresis.fitting.starting import Past, choose_start, with_given_up
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import FloatArray

# Slopes below this share of the mean slope of the record count as not invertible.
_SMALLEST_SLOPE = 1e-3


def fit_weights(
    operator_or_thresholds: PrandtlIshlinskii | Sequence[float] | FloatArray,
    x: ArrayLike,
    y: ArrayLike,
    constraint: Constraint = "prefix_sums",
    *,
    minimum: float | None = None,
    offset: bool = False,
    memory: Past = None,
    scored_share: float = 0.5,
) -> OperatorFit[PrandtlIshlinskii]:
    """Fit the weights of given plays: ``min |PI[x] + y0 - y|^2``, a convex problem.

    Plays the record says nothing about get weight 0 and a reason.

    Parameters
    ----------
    operator_or_thresholds : PrandtlIshlinskii or sequence of float
        The operator whose thresholds to take, or the thresholds: shape (n + 1,), the first one 0,
        strictly increasing, unit of the input.
    x : array
        Input, shape (N,).
    y : array
        Output, shape (N,).
    constraint : {"prefix_sums", "non_negative", "none"}, optional
        ``"prefix_sums"``: every slope ``w_0 + ... + w_i >= minimum``, exactly what the inverse
        needs; weights may be negative. ``"non_negative"``: ``w_0 >= minimum``, the others >= 0.
    minimum : float, optional
        Smallest slope, output per input. Default: a thousandth of the mean slope,
        ``ptp(y) / ptp(x)``.
    offset : bool, optional
        Fit an unknown constant in the output as well.
    memory : sequence of float, "unknown" or None, optional
        Play states before the first sample, shape (n,), unit of the input. None: virgin, as if the
        input had come straight from 0. ``"unknown"``: samples are scored from where the plays have
        forgotten the past, i.e. the input has swung by 2 r.
    scored_share : float, optional
        With an unknown past, at least this share of the record is scored; plays that forget too
        late for that get weight 0 and a reason.

    Returns
    -------
    OperatorFit
        With a `PrandtlIshlinskii` of all thresholds.

    Raises
    ------
    BadInput
        If a record is constant, not finite (names the first sample) or of another length, falls
        where the input rises, is too short, or moves no play.
    BadParameter
        If a threshold is negative, out of order or symbolic (names the entry), or an option is
        unknown.
    BadMemory
        If the memory does not fit the thresholds.

    References
    ----------
    kuhnen2003, krejci2001, lawson1995

    Examples
    --------
    >>> truth = PrandtlIshlinskii((0.0, 1.0, 2.0), (1.0, 0.5, -0.25))
    >>> x = 5.0 * np.sin(np.linspace(0.0, 9.0, 200))
    >>> fit_weights((0, 1, 2), x, truth.run(x)[0]).weights.round(9).tolist()
    [1.0, 0.5, -0.25]
    """
    plays = play_bank(operator_or_thresholds)
    record, output = paired_records(x, y)
    if constraint != "none":
        require_rising(record, output)
    start = choose_start(plays, record, memory, scored_share)
    used, states = start.bank(plays)
    inside, outside = record[start.sample :], output[start.sample :]
    slope = _SMALLEST_SLOPE * np.ptp(output) / np.ptp(record) if minimum is None else minimum
    bounds = np.full(used.n_memory + 1, slope)
    if constraint == "non_negative":
        bounds[1:] = 0.0
    names = play_names(used)
    blocks = play_blocks(used, inside, states)
    solution = fit_linear_blocks(
        ((matrix, outside[part]) for part, matrix in blocks),
        constraint,
        minimum=bounds,
        offset=offset,
        names=names,
        advice=play_advice(float(np.ptp(inside))),
    )
    thin = thin_evidence(names, np.array(used.thresholds[1:]), inside, states)
    silent = {s.index for s in solution.unexcited}
    notes = (*solution.unexcited, *(s for s in thin if s.index not in silent))
    solution = with_given_up(replace(solution, unexcited=notes), play_names(plays))
    operator = PrandtlIshlinskii(plays.thresholds, tuple(solution.weights.tolist()))
    return OperatorFit(operator, solution, start.memory, start.sample)
