"""The play (backlash): an output dragged along by an input that moves in a slot of width 2 r.

Sizes: N samples, n plays. x and y share one unit, and so does r.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from bondgraph.hysteresis.plays.kernels import bank, kernels_available
from bondgraph.hysteresis.plays.kernels import states as compiled_states
from bondgraph.support.ops import Expression, FloatArray, Ops

# Samples worked on at once: keeps the scratch memory of a long record in the processor's cache.
_CHUNK = 1 << 12


def play(ops: Ops, x: Expression, r: Expression, y: Expression) -> Expression:
    """Return the play after the input went monotonically to ``x``.

    ``y+ = max(x - r, min(x + r, y))``. The update depends on where the input ends, not on how it
    was sampled on the way, so the operator is rate independent by construction.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    x : expression
        Input, scalar or array, any unit.
    r : expression
        Half width, r >= 0, unit of ``x``.
    y : expression
        Output at the last accepted step, unit of ``x``.

    Returns
    -------
    expression
        New output, shape and unit of ``x``.

    References
    ----------
    krejci2001, kuhnen2003

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(play(NUMPY, 3.0, 1.0, 0.0))
    2.0
    """
    return ops.maximum(x - r, ops.minimum(x + r, y))


def sum_of_plays(
    ops: Ops,
    x: Expression,
    r: Sequence[Expression],
    w: Sequence[Expression],
    y: Sequence[Expression],
    *,
    stops: bool = False,
) -> Expression:
    """Return ``sum_i w_i play_i`` at ``x``, or of `stops` ``sum_i w_i (x - play_i)``.

    An operator that sums its plays here, and advances them by `play`, is run in a graph by the same
    loop as alone.

    Parameters
    ----------
    ops : Ops
        Back end of the values; its `bank` replaces the sum.
    x : expression
        Input, any unit.
    r, w, y : sequence of expression
        Half widths, weights and last outputs, shape (n,).

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(sum_of_plays(NUMPY, 3.0, (1.0, 2.0), (1.0, 0.5), (0.0, 0.0)))
    2.5
    """
    if ops.bank is not None and len(r):
        return ops.bank(x, r, w, y, stops)
    total: Expression = 0.0
    for r_i, w_i, y_i in zip(r, w, y, strict=True):
        state = play(ops, x, r_i, y_i)
        total = total + w_i * (x - state if stops else state)
    return total


def reachable_plays(
    ops: Ops, x0: Expression, r: Sequence[Expression], y: Sequence[Expression]
) -> tuple[Expression, ...]:
    """Return the states of a play bank nearest to ``y`` that some input history can produce.

    A play of width ``r_i`` is a play of width ``r_i - r_(i-1)`` on the output of the one before,
    so neighbours never differ by more than that. Only such states are inverted exactly.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    x0 : expression
        Present input, any unit.
    r : sequence of expression
        Half widths, strictly increasing, positive, shape (n,), unit of ``x0``.
    y : sequence of expression
        Wanted states, shape (n,), unit of ``x0``.

    Returns
    -------
    tuple of expression
        States, shape (n,), unit of ``x0``.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> [float(s) for s in reachable_plays(NUMPY, 0.0, (1.0, 2.0), (1.0, -2.0))]
    [1.0, 0.0]
    """
    states: list[Expression] = []
    before: Expression = x0
    gaps = (b - a for a, b in pairwise((0.0, *r)))
    for r_i, gap, y_i in zip(r, gaps, y, strict=True):
        before = play(ops, before, gap, y_i)
        # The chain of gaps rounds; the direct clamp makes the state admissible to the last bit.
        states.append(play(ops, x0, r_i, before))
    return tuple(states)


def play_record(x: FloatArray, r: FloatArray, y: FloatArray) -> FloatArray:
    """Return the states of n plays over a whole record.

    With a compiler this is one loop in C. Without one: each update is a clamp, and a chain of
    clamps is again a clamp, its bounds the first bounds sent through the rest. The record is
    therefore cut into about sqrt(N) blocks; all blocks are reduced to one clamp side by side, the
    blocks are chained, and all blocks are filled side by side. That is exact to the last bit,
    because only comparisons are regrouped, and needs about 3 sqrt(N) NumPy calls instead of N.

    Parameters
    ----------
    x : array
        Input, shape (N,), N >= 1, any unit.
    r : array
        Half widths, shape (n,), unit of ``x``.
    y : array
        States before the first sample, shape (n,), unit of ``x``.

    Returns
    -------
    array
        States after each sample, shape (N, n), unit of ``x``.

    Examples
    --------
    >>> play_record(np.array([0.0, 3.0, 2.0]), np.array([1.0]), np.array([0.0]))[:, 0].tolist()
    [0.0, 2.0, 2.0]
    """
    if r.size and kernels_available():
        return compiled_states(x, r, y)
    n_samples, n = x.size, r.size
    length = math.isqrt(n_samples - 1) + 1
    n_blocks = -(-n_samples // length)
    # Repeating the last sample changes nothing: a clamp applied twice is the same clamp.
    padded = np.concatenate((x, np.full(n_blocks * length - n_samples, x[-1])))
    columns = padded.reshape(n_blocks, length).T[:, None, :]
    lower, upper = columns - r[:, None], columns + r[:, None]  # (length, n, n_blocks)

    low, high = lower[0], upper[0]
    for a, b in zip(lower[1:], upper[1:], strict=True):
        low, high = np.maximum(a, np.minimum(b, low)), np.maximum(a, np.minimum(b, high))

    state = np.empty((n, n_blocks))
    now = y
    for k in range(n_blocks):
        state[:, k] = now
        now = np.maximum(low[:, k], np.minimum(high[:, k], now))

    states = np.empty((length, n, n_blocks))
    for step, (a, b) in enumerate(zip(lower, upper, strict=True)):
        state = np.maximum(a, np.minimum(b, state))
        states[step] = state
    return states.transpose(2, 0, 1).reshape(n_blocks * length, n)[:n_samples]


def play_chunks(x: FloatArray, r: FloatArray, y: FloatArray) -> Iterator[tuple[slice, FloatArray]]:
    """Yield the states of n plays piece by piece, so that a long record needs little memory.

    Arguments as of `play_record`.

    Yields
    ------
    slice
        Which samples.
    array
        Their states, shape (samples of the slice, n), unit of ``x``.

    Examples
    --------
    >>> [part for part, _ in play_chunks(np.zeros(3), np.ones(1), np.zeros(1))]
    [slice(0, 3, None)]
    """
    for first in range(0, x.size, _CHUNK):
        part = slice(first, min(first + _CHUNK, x.size))
        states = play_record(x[part], r, y)
        y = states[-1]
        yield part, states


def weighted_plays(
    x: FloatArray, r: FloatArray, w: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return a weighted sum of n plays over a record, and their last states.

    Parameters
    ----------
    x, r, y : array
        As of `play_record`.
    w : array
        Weights, shape (n,), output per input.

    Returns
    -------
    array
        ``sum_j w_j play_j[x]``, shape (N,).
    array
        States after the last sample, shape (n,).

    Examples
    --------
    >>> weighted_plays(np.array([0.0, 3.0]), np.ones(1), np.ones(1), np.zeros(1))[0].tolist()
    [0.0, 2.0]
    """
    if kernels_available():
        return bank(x, r, w, y)
    total = np.empty(x.size)
    for part, states in play_chunks(x, r, y):
        total[part] = states @ w
        y = states[-1]
    return total, y
