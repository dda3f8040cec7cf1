"""The input that makes a wanted output, for operators without an inverse in closed form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import finite_record, positive
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import NUMPY, Expression, FloatArray


def numeric_inverse(
    operator: Operator,
    y: ArrayLike,
    memory: Sequence[Expression] | None = None,
    *,
    start: float = 0.0,
    step: float | None = None,
    tolerance: float = 1e-12,
) -> tuple[FloatArray, Memory]:
    """Return the input for which the operator gives ``y``, and the operator's memory after it.

    Every sample is bracketed from the last input outward and closed by regula falsi with bisection,
    inside one compiled loop. From any memory the output must rise with the input; an exact
    `inverse`, where an operator has one, is faster and not limited by a tolerance.

    Parameters
    ----------
    operator : Operator
        With numbers for its parameters.
    y : array
        Wanted output, shape (N,), N >= 1, unit of the output.
    memory : sequence of float, optional
        Memory of the operator before the first sample, shape (n_memory,). Default: virgin at
        ``start``.
    start : float, optional
        Input at which the memory was left, unit of the input.
    step : float, optional
        Time between samples, s; a timed operator needs it.
    tolerance : float, optional
        Largest error of the input, as a share of its range (1 where the range is 0).

    Returns
    -------
    array
        Input, shape (N,), unit of the input.
    tuple of float
        Memory after the last sample, shape (n_memory,).

    Raises
    ------
    BadInput
        If ``y`` is not a finite record or a timed operator is given no step.
    BadMemory
        If the memory is not one of this operator.
    BadParameter
        If the tolerance is not positive.
    NotInvertible
        If no input reaches a sample; names it.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> operator = PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5))
    >>> numeric_inverse(operator, [0.0, 2.5, 0.5])[0].round(9).tolist()
    [0.0, 2.0, 0.0]
    """
    from bondgraph.hysteresis.compiled import compiled_inverse

    wanted = finite_record(y)
    positive("tolerance", float(tolerance))
    seconds = operator._seconds(step)
    given = operator.initial_memory(start) if memory is None else memory
    states = tuple(float(v) for v in operator._states(given))
    # a first, coarse pass tells the range of the input
    slope = abs(float(operator.linear_slope)) or 1.0
    guess = max(float(np.ptp(wanted)), abs(float(wanted[0] - operator.value(NUMPY, start, states))))
    rough, _ = compiled_inverse(
        operator, wanted, states, seconds, start, 1e-4 * (guess / slope or 1.0)
    )
    span = float(max(rough.max(), start) - min(rough.min(), start)) or 1.0
    x, after = compiled_inverse(operator, wanted, states, seconds, start, tolerance * span)
    return x, operator._states(after)
