"""When a number is known so well that what it trades off with is no matter."""

from __future__ import annotations

import numpy as np

WELL = 0.01
"""Half an interval over the value, up to which a trade-off is no fault."""


def well_known(low: float, high: float) -> bool:
    """Whether a 95 % interval is so narrow that the number needs no combination to be told.

    Examples
    --------
    >>> well_known(7.399, 7.401), well_known(5.0, 9.0), well_known(-0.1, 0.1)
    (True, False, False)
    """
    if not np.isfinite([low, high]).all() or not low * high > 0:
        return False
    return abs(high - low) < WELL * abs(high + low)
