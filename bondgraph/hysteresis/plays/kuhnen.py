"""The recursions that turn weighted plays, or weighted dead zones, into their exact inverse.

Both families are piecewise linear with slopes S_i = w_0 + ... + w_i between the thresholds, and the
inverse has the slopes 1/S_i. Everything here works on numbers and on expressions.

Sizes: n + 1 operators, number 0 with threshold 0. Everywhere here `weights` are w_i, shape
(n + 1,), output per input, and `thresholds` r_i, shape (n + 1,), the first one 0, unit of the input
(krejci2001, kuhnen2003).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, pairwise

from bondgraph.hysteresis.checks import all_numbers
from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.support.ops import Expression

# A partial sum below this share of the largest weight is rounding of a slope that is really zero.
_RELATIVE_ZERO = 1e-12


def slopes(weights: Sequence[Expression]) -> list[Expression]:
    """Return the partial sums ``S_i = w_0 + ... + w_i``.

    Returns
    -------
    list of expression
        Shape (n + 1,), output per input.

    Examples
    --------
    >>> slopes((1.0, 2.0))
    [1.0, 3.0]
    """
    return list(accumulate(weights))


def first_bad_slope(weights: Sequence[Expression]) -> int | None:
    """Return the index of the first slope that is not positive, or None.

    Expressions are taken on trust: with any of them among the weights the answer is None.

    Returns
    -------
    int or None
        Index into ``weights``.

    Examples
    --------
    >>> first_bad_slope((1.0, -2.0))
    1
    """
    if not all_numbers(weights):
        return None
    floor = _RELATIVE_ZERO * max(abs(w) for w in weights)
    return next((i for i, slope in enumerate(slopes(weights)) if not slope > floor), None)


def inverse_weights(weights: Sequence[Expression]) -> tuple[Expression, ...]:
    """Return ``w'_0 = 1/w_0`` and ``w'_i = -w_i/(S_i S_(i-1))``.

    Returns
    -------
    tuple of expression
        Shape (n + 1,), input per output.

    Raises
    ------
    NotInvertible
        With the index of the first slope that is not positive.

    Examples
    --------
    >>> inverse_weights((2.0, 2.0))
    (0.5, -0.25)
    """
    bad = first_bad_slope(weights)
    if bad is not None:
        raise NotInvertible(f"slope {bad} is {slopes(weights)[bad]}, not positive", bad)
    bends = (
        -w / (after * before)
        for w, (before, after) in zip(weights[1:], pairwise(slopes(weights)), strict=True)
    )
    return (1.0 / weights[0], *bends)


def inverse_thresholds(
    thresholds: Sequence[Expression], weights: Sequence[Expression]
) -> tuple[Expression, ...]:
    """Return ``r'_i = sum_(j<=i) w_j (r_i - r_j)``, the output at which slope i begins.

    Computed as ``r'_i = r'_(i-1) + S_(i-1) (r_i - r_(i-1))``, which is linear in n and cannot lose
    the order of the thresholds by cancellation.

    Returns
    -------
    tuple of expression
        Shape (n + 1,), the first one 0.0, unit of the output.

    Examples
    --------
    >>> inverse_thresholds((0.0, 1.0, 2.0), (2.0, 1.0, 1.0))
    (0.0, 2.0, 5.0)
    """
    gaps = (b - a for a, b in pairwise(thresholds))
    rises = [slope * gap for slope, gap in zip(slopes(weights), gaps, strict=False)]
    return tuple(accumulate(rises, initial=0.0))


def inverse_states(
    weights: Sequence[Expression], states: Sequence[Expression]
) -> tuple[Expression, ...]:
    """Return ``y'_i = S_i y_i + sum_(j>i) w_j y_j`` for i = 1..n.

    Parameters
    ----------
    states : sequence of expression
        Play states of the operators 1..n (operator 0 has none), shape (n,), unit of the input.

    Returns
    -------
    tuple of expression
        Play states of the inverse, shape (n,), unit of the output.

    Examples
    --------
    >>> inverse_states((1.0, 2.0), (0.5,))
    (1.5,)
    """
    terms = [w * y for w, y in zip(weights[1:], states, strict=True)]
    # tails[i] = sum of the terms after operator i + 1
    tails = list(accumulate(reversed(terms), initial=0.0))[-2::-1] if terms else []
    return tuple(
        slope * y + tail for slope, y, tail in zip(slopes(weights)[1:], states, tails, strict=True)
    )
