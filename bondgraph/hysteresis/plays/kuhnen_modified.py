"""Kuhnen's modified Prandtl-Ishlinskii operator: plays, then a bent line on both sides of 0.

Sizes: n + 1 plays, m corners of the bent line and m + 1 slopes between them.
"""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.hysteresis.checks import is_number, parameters, strictly_increasing
from bondgraph.hysteresis.errors import BadParameter, NotInvertible
from bondgraph.hysteresis.plays.ang import Ang
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import Expression


def bent_line(corners: Sequence[Expression], slopes: Sequence[Expression]) -> DeadZones:
    """Return the line through 0 with given slopes between given corners, as dead zones.

    Parameters
    ----------
    corners : sequence of expression
        Inputs at which the slope changes, shape (m,), strictly increasing, on one or both sides
        of 0 but not 0; unit of the input. Only numbers tell on which side they are.
    slopes : sequence of expression
        Slope left of the first corner, between the corners, right of the last one, shape (m + 1,);
        output per input. Slopes that fall towards the ends make a saturation.

    Returns
    -------
    DeadZones
        With m + 1 entries: the slope around 0, and each change of slope seen from 0 outward.

    Raises
    ------
    BadParameter
        If the lengths do not match, a corner is 0, symbolic or out of order; names the entry.

    References
    ----------
    kuhnen2003

    Examples
    --------
    >>> bent_line((-2.0, 1.0), (0.5, 1.0, 0.25)).weights
    (-0.5, 1.0, -0.75)
    """
    at, s = parameters("corners", corners), parameters("slopes", slopes)
    if len(s) != len(at) + 1:
        raise BadParameter(
            f"slopes has {len(s)} entries but {len(at)} corners part the line into {len(at) + 1}; "
            "give one slope for each part"
        )
    strictly_increasing("corners", at)
    for j, corner in enumerate(at):
        if not is_number(corner) or corner == 0.0:
            raise BadParameter(
                f"corners[{j}] = {corner} must be a number other than 0: it has to tell its side"
            )
    n_below = sum(corner < 0.0 for corner in at)
    below = tuple(s[j] - s[j + 1] for j in range(n_below))
    above = tuple(s[j + 1] - s[j] for j in range(n_below, len(at)))
    return DeadZones((*at[:n_below], 0.0, *at[n_below:]), (*below, s[n_below], *above))


def kuhnen_modified(
    thresholds: Sequence[Expression],
    weights: Sequence[Expression],
    corners: Sequence[Expression],
    slopes: Sequence[Expression],
) -> Ang:
    """Return plays followed by a bent line on both sides of 0, ready to be inverted.

    ``z = S[P[x]]``: the plays P make the symmetric loop, the bent line S makes it asymmetric or
    lets it saturate. The inverse ``x = P^-1[S^-1[z]]`` is exact; take it with ``inverse()`` and its
    memory with ``inverse_memory``. Loops between the same inputs differ in shape with their height,
    because S bends them: only the loops of P are congruent.

    Parameters
    ----------
    thresholds : sequence of expression
        Half widths of the plays, shape (n + 1,), the first one 0, strictly increasing; unit of the
        input.
    weights : sequence of expression
        Shape (n + 1,), each partial sum positive; unit of the inner signal per input.
    corners : sequence of expression
        Where the line bends, shape (m,), strictly increasing, not 0; unit of the inner signal.
    slopes : sequence of expression
        Shape (m + 1,), positive; output per unit of the inner signal.

    Returns
    -------
    Ang
        The operator with plays and dead zones.

    Raises
    ------
    BadParameter
        If the parameters do not fit together; names the entry.
    NotInvertible
        If a partial sum of the weights, or a slope, is not positive; names the entry.

    References
    ----------
    kuhnen2003

    Examples
    --------
    >>> operator = kuhnen_modified((0, 1), (1, 0.5), corners=(-2, 2), slopes=(0.5, 1, 0.5))
    >>> z, _ = operator.run([0.0, 4.0, -4.0])
    >>> z.tolist()
    [0.0, 3.75, -3.75]
    >>> operator.inverse().run(z)[0].tolist()
    [0.0, 4.0, -4.0]
    """
    plays, line = PrandtlIshlinskii(tuple(thresholds), tuple(weights)), bent_line(corners, slopes)
    plays.check_invertible()
    for j, slope in enumerate(parameters("slopes", slopes)):
        if is_number(slope) and not slope > 0.0:
            raise NotInvertible(
                f"no inverse: slopes[{j}] = {slope:.6g} is not positive, so a part of the line "
                "falls or is flat; a saturation needs a small positive slope at its ends",
                j,
            )
    return Ang(plays, line)
