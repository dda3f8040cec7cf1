"""A bank of plays as regressors: its outputs, its names, and what a record can say about it.

Sizes: N samples, n + 1 operators, number 0 the identity.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bondgraph.hysteresis.checks import numbers, parameters
from bondgraph.hysteresis.fitting.excited import Unexcited
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import FloatArray

# Samples worked on at once: forty columns of them take three megabytes.
_BLOCK = 1 << 13


def play_bank(
    operator_or_thresholds: PrandtlIshlinskii | Sequence[float] | FloatArray,
) -> PrandtlIshlinskii:
    """Return plays of weight 1 with numeric thresholds.

    Raises
    ------
    BadParameter
        If a threshold is negative, out of order, symbolic or not finite, or the first is not 0.

    Examples
    --------
    >>> play_bank((0, 1)).thresholds
    (0.0, 1.0)
    """
    if isinstance(operator_or_thresholds, PrandtlIshlinskii):
        thresholds = operator_or_thresholds.thresholds
    else:
        thresholds = parameters("thresholds", operator_or_thresholds)
    bank = PrandtlIshlinskii(thresholds, (1.0,) * len(thresholds))
    numbers("thresholds", bank.thresholds)
    return bank


def play_names(plays: PrandtlIshlinskii) -> list[str]:
    """Return a name for every operator of a bank.

    Examples
    --------
    >>> play_names(play_bank((0, 1)))
    ['the identity (r = 0)', 'play 1 (r = 1)']
    """
    widths = enumerate(plays.thresholds[1:], start=1)
    return ["the identity (r = 0)", *(f"play {i} (r = {r:g})" for i, r in widths)]


def play_advice(swing: float) -> str:
    """Return which plays a record can move.

    Parameters
    ----------
    swing : float
        Peak-to-peak input.

    Examples
    --------
    >>> play_advice(10.0)
    'with 10 peak to peak only r < 5 move in a loop, larger r at most in a virgin ramp'
    """
    return (
        f"with {swing:g} peak to peak only r < {swing / 2:g} move in a loop, larger r at most in a "
        "virgin ramp"
    )


def play_blocks(
    plays: PrandtlIshlinskii, x: FloatArray, memory: Sequence[float]
) -> Iterator[tuple[slice, FloatArray]]:
    """Yield the outputs of the single operators, block by block of samples.

    Parameters
    ----------
    plays : PrandtlIshlinskii
        The bank, its weights are not used.
    x : array
        Input, shape (N,).
    memory : sequence of float
        Before the first sample, shape (n,).

    Yields
    ------
    slice
        Which samples.
    array
        Shape (samples of the slice, n + 1), unit of the input; column 0 is the input.
    """
    for first in range(0, x.size, _BLOCK):
        part = slice(first, min(first + _BLOCK, x.size))
        matrix = plays.regressors(x[part], memory)
        memory = matrix[-1, 1:].tolist()
        yield part, matrix


def thin_evidence(
    names: Sequence[str], r: FloatArray, x: FloatArray, memory: Sequence[float]
) -> tuple[Unexcited, ...]:
    """Return the plays that move, but only on the way to a new extreme of the input.

    Within a record of half swing A, plays with r >= A stand still in every loop; they move at most
    while the input goes where it has not been before, usually the virgin ramp.

    Parameters
    ----------
    names : sequence of str
        Shape (n + 1,), the identity first.
    r : array
        Half widths of the plays, shape (n,), unit of ``x``.
    x : array
        Scored input, shape (N,).
    memory : sequence of float
        Play states before it, shape (n,).

    Returns
    -------
    tuple of Unexcited
        With action ``"kept"``; indices count the identity.
    """
    half = float(np.ptp(x)) / 2.0
    start = np.array(memory)
    moves = np.maximum(x.max() - start, start - x.min()) > r
    reason = (
        f"moves only where the input leaves its former range (virgin ramp): in loops between "
        f"{x.min():g} and {x.max():g} only r < {half:g} move"
    )
    return tuple(
        Unexcited(i + 1, names[i + 1], reason, "kept")
        for i in map(int, np.flatnonzero(moves & (r >= half)))
    )
