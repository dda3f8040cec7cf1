"""The loop q + C H(q) = w of a capacitor in series with hysteresis, solved in closed form."""

from __future__ import annotations

from bondgraph.hysteresis.checks import parameter, positive
from bondgraph.hysteresis.plays.maxwell import MaxwellResistiveCapacitor
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import Expression


def identity_plus(
    c: Expression, operator: PrandtlIshlinskii | MaxwellResistiveCapacitor
) -> PrandtlIshlinskii:
    """Return ``I + c H`` as weighted plays; it has the memory of H.

    Parameters
    ----------
    c : expression
        Gain, c >= 0, input per output of H (a capacitance when H maps charge to voltage).
    operator : PrandtlIshlinskii or MaxwellResistiveCapacitor
        H, with n memory states.

    Returns
    -------
    PrandtlIshlinskii
        Weights ``1 + c w_0, c w_1, ...``, thresholds of H.

    Raises
    ------
    BadParameter
        If ``c`` is negative or not finite.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> identity_plus(2.0, PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5))).weights
    (3.0, 1.0)
    """
    gain = parameter("c", c)
    positive("c", gain, or_zero=True)
    plays = (
        operator.as_prandtl_ishlinskii()
        if isinstance(operator, MaxwellResistiveCapacitor)
        else operator
    )
    first, *others = plays.weights
    return PrandtlIshlinskii(plays.thresholds, (1.0 + gain * first, *(gain * w for w in others)))


def inverse_of_identity_plus(
    c: Expression, operator: PrandtlIshlinskii | MaxwellResistiveCapacitor
) -> PrandtlIshlinskii:
    """Return ``(I + c H)^-1``: the solution q of ``q + c H(q) = w`` without an algebraic loop.

    A memory of H becomes one of the solution through ``identity_plus(c, H).inverse_memory``.

    Arguments as of `identity_plus`.

    Returns
    -------
    PrandtlIshlinskii
        Maps w to q, with n memory states.

    Raises
    ------
    NotInvertible
        If ``1 + c S_i`` is not positive for some slope S_i of H, with its index.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> inverse_of_identity_plus(1.0, MaxwellResistiveCapacitor((1.0,), (1.0,))).weights
    (0.5, 0.5)
    """
    return identity_plus(c, operator).inverse()
