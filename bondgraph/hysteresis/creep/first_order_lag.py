"""How far a first-order lag goes in one step, accurate for the slowest lags too.

Everywhere here ``q >= 0`` is the elapsed time over the time constant.
"""

from __future__ import annotations

from bondgraph.support.ops import Expression, Ops

# Below this the difference would lose digits, and the series needs eleven terms at most.
_SMALL = 0.1


def relaxed_share(ops: Ops, q: Expression) -> Expression:
    """Return ``1 - exp(-q)``, also where q is so small that exp(-q) rounds to 1.

    Written with the hyperbolic tangent, ``2 t / (1 + t)`` with ``t = tanh(q/2)``: slow decades have
    a q of 1e-8 or less, and the difference would keep half of its digits.

    Returns
    -------
    expression
        Share of the way to the target that is done, 0..1.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(relaxed_share(NUMPY, 1e-20))
    1e-20
    """
    t = ops.tanh(0.5 * q)
    return 2.0 * t / (1.0 + t)


def ramp_share(ops: Ops, q: Expression) -> Expression:
    """Return ``1 - (1 - exp(-q))/q``: how far a unit follows a ramp that took q time constants.

    Returns
    -------
    expression
        0 for a jump (q = 0), 1 for an infinitely slow ramp; full relative accuracy between.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(ramp_share(NUMPY, 0.0)), float(ramp_share(NUMPY, 2e-20))
    (0.0, 1e-20)
    """
    return q * ramp_rate(ops, q)


def ramp_rate(ops: Ops, q: Expression) -> Expression:
    """Return `ramp_share` over q, which is 1/2 at q = 0.

    Returns
    -------
    expression
        1/2 for a jump, falling to 0 for an infinitely slow ramp.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(ramp_rate(NUMPY, 0.0))
    0.5
    """
    series: Expression = 1.0
    small = ops.minimum(q, _SMALL)
    for n in range(12, 2, -1):
        series = 1.0 - small / n * series
    large = ops.maximum(q, _SMALL)
    direct = (1.0 - relaxed_share(ops, large) / large) / large
    return ops.where(q < _SMALL, 0.5 * series, direct)
