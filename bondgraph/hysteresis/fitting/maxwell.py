"""Fit the stiffnesses of a Maxwell resistive capacitor to a record.

Sizes: N samples, n elements.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import non_negative, parameters
from bondgraph.hysteresis.errors import BadInput
from bondgraph.hysteresis.fitting.bank import play_bank, play_blocks
from bondgraph.hysteresis.fitting.excited import Unexcited
from bondgraph.hysteresis.fitting.least_squares import fit_linear_blocks
from bondgraph.hysteresis.fitting.records import paired_records, require_rising
from bondgraph.hysteresis.fitting.result import LinearFit, OperatorFit
from bondgraph.hysteresis.fitting.starting import Past, choose_start, with_given_up
from bondgraph.hysteresis.plays.maxwell import MaxwellResistiveCapacitor
from bondgraph.support.ops import FloatArray


def fit_maxwell(
    q: ArrayLike,
    v: ArrayLike,
    thresholds: Sequence[float] | FloatArray,
    *,
    offset: bool = False,
    memory: Past = None,
    scored_share: float = 0.5,
) -> OperatorFit[MaxwellResistiveCapacitor]:
    """Fit ``v = sum_i k_i stop_(q_i)[q]`` with ``k_i >= 0`` for given slip points q_i.

    Parameters
    ----------
    q : array
        Charge (displacement), shape (N,).
    v : array
        Voltage (effort), shape (N,).
    thresholds : sequence of float
        Slip points q_i > 0, shape (n,), strictly increasing, unit of ``q``.
    offset, memory, scored_share : optional
        As in `fit_weights`, with anchors for the states of plays, in the unit of ``q``. Elements
        that never slip cannot be told from each other: they are unexcited.

    Returns
    -------
    OperatorFit
        ``solution.weights`` are the stiffnesses k_i of all slip points; the operator and
        ``memory`` hold only the elements with k_i > 0.

    Raises
    ------
    BadInput, BadMemory
        As in `fit_weights`.
    BadParameter
        If a slip point is not positive or out of order; names the entry.

    References
    ----------
    goldfarb1997, lawson1995

    Examples
    --------
    >>> truth = MaxwellResistiveCapacitor((2.0, 1.0), (2.0, 3.0))
    >>> q = 5.0 * np.sin(np.linspace(0.0, 9.0, 200))
    >>> fit_maxwell(q, truth.run(q)[0], (1, 2, 3)).weights.round(9).tolist()
    [2.0, 0.0, 1.0]
    """
    slips = parameters("thresholds", thresholds)
    non_negative("thresholds", slips, strict=True)
    stops = play_bank((0.0, *slips))
    charge, effort = paired_records(q, v, ("q", "v"))
    require_rising(charge, effort, ("q", "v"))
    start = choose_start(stops, charge, memory, scored_share)
    used, states = start.bank(stops)
    inside, outside = charge[start.sample :], effort[start.sample :]

    def blocks() -> Iterator[tuple[FloatArray, FloatArray]]:
        for part, matrix in play_blocks(used, inside, states):
            yield inside[part, None] - matrix[:, 1:], outside[part]

    names = [f"element {i} (slip point {r:g})" for i, r in enumerate(slips)]
    solution = fit_linear_blocks(
        blocks(),
        "non_negative",
        offset=offset,
        names=names[: used.n_memory],
    )
    widths = np.array(used.thresholds[1:])
    notes = _never_slipping(names, widths, inside, np.array(states), solution)
    solution = with_given_up(
        replace(solution, unexcited=(*solution.unexcited, *notes)),
        names,
    )
    operator = elements_with_stiffness(solution.weights, np.array(slips))
    stiff = solution.weights > 0.0
    anchors = tuple(y for y, there in zip(start.memory, stiff, strict=True) if there)
    return OperatorFit(operator, solution, anchors, start.sample)


def elements_with_stiffness(
    stiffnesses: FloatArray, slips: FloatArray
) -> MaxwellResistiveCapacitor:
    """Return the elements of positive stiffness as an operator.

    Parameters
    ----------
    stiffnesses : array
        k_i >= 0, shape (n,), effort per displacement.
    slips : array
        q_i, shape (n,), displacement.

    Raises
    ------
    BadInput
        If no stiffness is positive.

    Examples
    --------
    >>> elements_with_stiffness(np.array([2.0, 0.0]), np.array([1.0, 2.0])).breakaways
    (2.0,)
    """
    stiff = stiffnesses > 0.0
    if not stiff.any():
        raise BadInput(
            "no element gets a positive stiffness; v does not follow q at these slip points: check "
            "the offset of v, or take other slip points"
        )
    k = stiffnesses[stiff]
    return MaxwellResistiveCapacitor(tuple(k.tolist()), tuple((k * slips[stiff]).tolist()))


def _never_slipping(
    names: Sequence[str], r: FloatArray, q: FloatArray, anchors: FloatArray, solution: LinearFit
) -> list[Unexcited]:
    """Return the fitted elements whose slip point the record does not reach."""
    dropped = {s.index for s in solution.unexcited}
    still = np.maximum(q.max() - anchors, anchors - q.min()) <= r
    reason = (
        "never slips on this record: its stiffness stands for a linear spring, its breakaway "
        "is not seen"
    )
    found = (int(i) for i in np.flatnonzero(still))
    return [Unexcited(i, names[i], reason, "kept") for i in found if i not in dropped]
