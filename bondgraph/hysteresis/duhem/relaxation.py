"""``dq/dh = A - k q`` with one rate below 0 and another above, in one exact step of any length.

NumPy, CasADi and SymPy share no logarithm of ``1 + w``, so it is arranged here to keep its digits
where the argument is small.
"""

from __future__ import annotations

from bondgraph.support.ops import Expression, Ops

_SMALL_WAY = 0.5
"""Rate times way below which the series of `_second_share` is used; its error is below 1e-17."""


def branch(
    ops: Ops,
    start: Expression,
    way: Expression,
    growth: Expression,
    falling_rate: Expression,
    rising_rate: Expression,
) -> tuple[Expression, Expression]:
    """Return the end of ``dq/dh = A - k q`` and the integral of q dh.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    start : expression
        q at the start, unit of z.
    way : expression
        h, unit of the input; slightly below 0 the branch is continued, for its derivative at 0.
    growth : expression
        A > 0, slope at q = 0, z per input.
    falling_rate : expression
        k while q < 0 (its magnitude falls), per input; ``A - k q`` must stay positive there.
    rising_rate : expression
        k while q > 0, per input.

    Returns
    -------
    expression
        q after the way, unit of z.
    expression
        Integral of q dh along the way, unit of z times unit of the input.

    References
    ----------
    wen1976, ismail2009

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> end, _ = branch(NUMPY, 0.0, 1.0, 1.0, 0.0, 1.0)
    >>> round(float(end), 12) == round(1.0 - 2.718281828459045**-1, 12)
    True
    """
    below, above = ops.minimum(start, 0.0), ops.maximum(start, 0.0)
    # q reaches 0 after log(1 - k q/A)/k
    # (never, if q starts beyond A/k < 0, which no admissible state does; keep the log defined)
    change = ops.maximum(-falling_rate * below / growth, -1.0 + 2.0**-53)
    to_zero = -below / growth * _log_share(ops, change)
    crosses = start < 0.0
    first = ops.where(crosses, ops.minimum(way, to_zero), 0.0)
    second = ops.where(crosses, ops.maximum(way - to_zero, 0.0), way)
    end_below, area_below = _relax(ops, below, first, growth, falling_rate)
    end_above, area_above = _relax(ops, above, second, growth, rising_rate)
    # at least one of the two ends is 0, whichever side of 0 the way ends on
    return ops.minimum(end_below, 0.0) + end_above, area_below + area_above


def _relax(
    ops: Ops, start: Expression, way: Expression, growth: Expression, rate: Expression
) -> tuple[Expression, Expression]:
    """End and integral of q with one rate."""
    u = rate * way
    share = _first_share(ops, u)
    # As an increment: exp(-u) near 1 would round alike in every one of many equal steps.
    end = start + (growth - rate * start) * way * share
    area = start * way * share + growth * way * way * _second_share(ops, u, share)
    return end, area


def _first_share(ops: Ops, u: Expression) -> Expression:
    """``(1 - exp(-u))/u`` to rounding for all u, 0 included."""
    tiny = ops.absolute(u) < 1e-9
    safe = ops.where(tiny, 1.0, u)
    return ops.where(tiny, 1.0 - 0.5 * u, -ops.expm1(-safe) / safe)


def _second_share(ops: Ops, u: Expression, first: Expression) -> Expression:
    """``(u - 1 + exp(-u))/u^2``: 1/2 at 0."""
    small = ops.absolute(u) < _SMALL_WAY
    safe = ops.where(small, 1.0, u)
    v = ops.where(small, u, 0.0)
    series: Expression = 1.0
    for n in range(14, 2, -1):
        series = 1.0 - v / n * series
    return ops.where(small, 0.5 * series, (1.0 - first) / safe)


def _log_share(ops: Ops, w: Expression) -> Expression:
    """``log(1 + w)/w`` to rounding for w > -1, 0 included."""
    small = ops.absolute(w) < 0.3
    safe = ops.where(small, 1.0, w)
    v = ops.where(small, w, 0.0)
    # log(1 + w) = 2 artanh(w/(2 + w)), whose series has no rounding at small w
    s = v / (2.0 + v)
    series: Expression = 0.0
    for n in range(19, 0, -2):
        series = series * s * s + 1.0 / n
    return ops.where(small, 2.0 * series / (2.0 + v), ops.log(1.0 + safe) / safe)
