"""Increasing envelopes ``a_0 tanh(a_1 x + a_2) + a_3 x + a_4`` and their inverse.

An envelope is five plain numbers (or expressions), so that operators remain data.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bondgraph.hysteresis.checks import all_numbers, is_number, numbers, parameters
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.support.ops import Expression, Ops

Envelope = tuple[Expression, ...]
"""``(a_0, a_1, a_2, a_3, a_4)``: a_1 per input, a_2 a number, a_0, a_3 x and a_4 in one unit."""

_NEWTON_STEPS = 9
_EDGE = 1.0 - 2.0**-53


def check_envelope(name: str, values: Sequence[Expression]) -> Envelope:
    """Return the five numbers of a strictly increasing envelope.

    Parameters
    ----------
    name : str
        Name used in the error.
    values : sequence of expression
        ``(a_0, a_1, a_2, a_3, a_4)``.

    Returns
    -------
    tuple
        The same as floats or expressions.

    Raises
    ------
    BadParameter
        If there are not five, or the numbers do not make it strictly increasing.

    Examples
    --------
    >>> check_envelope("left", (0, 0, 0, 1, 0))
    (0.0, 0.0, 0.0, 1.0, 0.0)
    """
    a = parameters(name, values)
    if len(a) != 5:
        raise BadParameter(
            f"{name} has {len(a)} entries; a_0 tanh(a_1 x + a_2) + a_3 x + a_4 needs five"
        )
    if all_numbers((a[0], a[1], a[3])):
        bend = a[0] * a[1]
        if bend < 0.0 or a[3] < 0.0 or not bend + a[3] > 0.0:
            raise BadParameter(
                f"{name} = {a} does not rise strictly: a_0 a_1 = {bend:.6g} and a_3 = {a[3]:.6g} "
                "must not be negative, nor both 0"
            )
        if a[1] == 0.0 and a[0] != 0.0:
            raise BadParameter(f"{name}[1] = 0 makes the tangent a constant; put it into {name}[4]")
    return a


def envelope(ops: Ops, x: Expression, a: Envelope) -> Expression:
    """Return ``a_0 tanh(a_1 x + a_2) + a_3 x + a_4``.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    x : expression
        Input, scalar or array.
    a : tuple
        The five numbers.

    Returns
    -------
    expression
        Shape of ``x``.

    References
    ----------
    aljanaideh2009

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(envelope(NUMPY, 3.0, (0.0, 0.0, 0.0, 2.0, 1.0)))
    7.0
    """
    straight = a[3] * x + a[4]
    if is_number(a[0]) and a[0] == 0.0:
        return straight
    return a[0] * ops.tanh(a[1] * x + a[2]) + straight


def envelope_slope(a: Envelope, x: float = 0.0) -> float:
    """Return the slope of an envelope of numbers.

    Examples
    --------
    >>> envelope_slope((2.0, 3.0, 0.0, 1.0, 0.0))
    7.0
    """
    a0, a1, a2, a3, _ = numbers("envelope", a)
    return a0 * a1 * (1.0 - math.tanh(a1 * x + a2) ** 2) + a3


def envelope_range(a: Envelope) -> tuple[float, float]:
    """Return the limits of an envelope of numbers; infinite with a straight part.

    Examples
    --------
    >>> envelope_range((2.0, 3.0, 0.0, 0.0, 1.0))
    (-1.0, 3.0)
    """
    a0, _, _, a3, a4 = numbers("envelope", a)
    if a3 > 0.0:
        return -math.inf, math.inf
    return a4 - abs(a0), a4 + abs(a0)


def inverse_envelope(ops: Ops, y: Expression, a: Envelope) -> Expression:
    """Return the x with ``envelope(x) = y``.

    Closed forms without a tangent (a_0 = 0) or without a straight part (a_3 = 0); there ``y`` is
    kept a rounding inside the range. Otherwise nine Newton steps from below: with u the argument
    of the tangent the equation is ``A tanh u + B u = q``, concave for u > 0, so the steps rise to
    the root from any lower bound. Three bounds are used; the error stays below 1e-13 of x for all
    ratios B/A (tested from 1e-9 to 1e9) except where the slope itself is lost to rounding.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    y : expression
        Envelope, scalar or array.
    a : tuple
        The five numbers; which of a_0 and a_3 are 0 must be known as numbers.

    Returns
    -------
    expression
        Input x, shape of ``y``.

    Raises
    ------
    BadParameter
        If SymPy asks for the general case, for which there is no closed form.

    References
    ----------
    aljanaideh2009

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> shape = (1.0, 2.0, 0.1, 0.5, 0.0)
    >>> round(float(inverse_envelope(NUMPY, envelope(NUMPY, 0.7, shape), shape)), 12)
    0.7
    """
    a0, a1, a2, a3, a4 = a
    if is_number(a0) and a0 == 0.0:
        return (y - a4) / a3
    if is_number(a3) and a3 == 0.0:
        return (_artanh(ops, (y - a4) / a0) - a2) / a1
    if ops.name == "sympy":
        raise BadParameter(
            "the inverse of a tangent plus a straight part has no closed form for SymPy; set a_0 "
            "or a_3 of the envelope to 0, or use NumPy or CasADi"
        )
    # a_0 and a_1 have one sign, so A and B count along u = a_1 x + a_2 turned to rise with y
    turn = ops.sign(a1)
    bend, straight = ops.absolute(a0), a3 / ops.absolute(a1)
    q = y - a4 + a3 * a2 / a1
    u = ops.sign(q) * _rising_root(ops, ops.absolute(q), bend, straight)
    return (turn * u - a2) / a1


def _rising_root(ops: Ops, q: Expression, bend: Expression, straight: Expression) -> Expression:
    """Solve ``bend tanh(u) + straight u = q`` for q >= 0."""
    highest = ops.minimum(q / straight, _artanh(ops, ops.minimum(q / bend, 1.0)))
    by_slope = q / (bend + straight)
    beyond = (q - bend) / straight
    bent = _artanh(ops, ops.maximum((q - straight * highest) / bend, 0.0))
    u = ops.maximum(ops.maximum(by_slope, beyond), bent)
    for _ in range(_NEWTON_STEPS):
        t = ops.tanh(u)
        slope = bend * (1.0 - t) * (1.0 + t) + straight
        u = u + (q - bend * t - straight * u) / slope
    return u


def _artanh(ops: Ops, t: Expression) -> Expression:
    """Inverse of tanh, with the argument kept a rounding away from -1 and 1."""
    inside = ops.maximum(-_EDGE, ops.minimum(_EDGE, t))
    # one Newton step restores the digits that the logarithm loses near 0
    rough = 0.5 * ops.log((1.0 + inside) / (1.0 - inside))
    near = ops.tanh(rough)
    step = (inside - near) / ((1.0 - near) * (1.0 + near) + 2.0**-54)
    return rough + ops.where(ops.absolute(inside) < 0.5, step, 0.0)


def largest_excess(left: Envelope, right: Envelope) -> float:
    """Return the largest ``left(x) - right(x)`` over all x, for envelopes of numbers.

    Searched on 2001 points across both bends, then zoomed into; infinite if the straight parts
    differ.

    Examples
    --------
    >>> largest_excess((1.0, 1.0, 0.0, 0.0, 0.5), (1.0, 1.0, 0.0, 0.0, 0.0))
    0.5
    """
    a, b = np.array(numbers("left", left)), np.array(numbers("right", right))
    if a[3] != b[3]:
        return math.inf

    def excess(x: np.ndarray) -> np.ndarray:
        bends = a[0] * np.tanh(a[1] * x + a[2]) - b[0] * np.tanh(b[1] * x + b[2])
        return np.asarray(bends + (a[4] - b[4]))

    scales = [(p[2] / p[1], 20.0 / abs(p[1])) for p in (a, b) if p[0] * p[1] != 0.0]
    if not scales:
        return float(a[4] - b[4])
    points = np.unique(np.concatenate([np.linspace(-c - w, -c + w, 2001) for c, w in scales]))
    for _ in range(6):
        values = excess(points)
        k = int(values.argmax())
        best = float(values[k])
        near = points[max(k - 1, 0)], points[min(k + 1, points.size - 1)]
        points = np.linspace(near[0], near[1], 101)
    return best
