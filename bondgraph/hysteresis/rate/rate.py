"""The rate of an input, measured over accepted steps.

Sizes: N samples.
"""

from __future__ import annotations

import numpy as np

from bondgraph.hysteresis.creep.first_order_lag import relaxed_share
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


def measured_rate(
    ops: Ops,
    x: Expression,
    last: Expression,
    rate: Expression,
    step: Expression,
    smoothing: Expression,
) -> Expression:
    """Return the rate known after a step from ``last`` to ``x``.

    The difference quotient, through a first-order lag that is exact for a constant rate within the
    step. A step of no duration leaves the rate as it was.

    Parameters
    ----------
    ops : Ops
        Back end of the values.
    x, last : expression
        Input at the end and at the beginning of the step, any unit.
    rate : expression
        Rate known before, unit of the input per s.
    step : expression
        Duration h >= 0, s.
    smoothing : expression
        Time constant of the lag, s; 0 for none.

    Returns
    -------
    expression
        Unit of the input per s.

    Examples
    --------
    >>> float(measured_rate(NUMPY, 3.0, 1.0, 0.0, 0.5, 0.0))
    4.0
    """
    moving = step > 0.0
    quotient = (x - last) / ops.where(moving, step, 1.0)
    share = relaxed_share(ops, step / ops.maximum(smoothing, 1e-300))
    return ops.where(moving, share * quotient + (1.0 - share) * rate, rate)


def rate_record(
    x: FloatArray, last: float, rate: float, step: float, smoothing: float
) -> FloatArray:
    """Return `measured_rate` after each sample of a record.

    Parameters
    ----------
    x : array
        Input, shape (N,), N >= 1, any unit.
    last, rate : float
        Input and rate before the first sample.
    step : float
        Time between samples, s, positive.
    smoothing : float
        Time constant of the lag, s.

    Returns
    -------
    array
        Shape (N,), unit of the input per s.

    Examples
    --------
    >>> rate_record(np.array([1.0, 3.0]), 0.0, 0.0, 0.5, 0.0).tolist()
    [2.0, 4.0]
    """
    quotients = np.diff(x, prepend=last) / step
    share = float(relaxed_share(NUMPY, step / max(smoothing, 1e-300)))
    from scipy.signal import lfilter  # late: half a second of every import

    smooth, _ = lfilter([share], [1.0, share - 1.0], quotients, zi=[(1.0 - share) * rate])
    return np.asarray(smooth)
