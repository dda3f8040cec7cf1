"""How many samples a residual remembers."""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array
from identification.statistics.autoregression import autoregression


def memory(correlations: Array, n: int) -> float:
    """Integrated autocorrelation time ``1 + 2 sum r_k`` in samples, between 1 and `n`.

    The largest of three. Two estimate the same, since both fall short on short records: the sum up
    to the first lag beyond five times its own value (Sokal, in: Functional Integration, 1997,
    p. 131), and the spectral density at zero of the best autoregression. The third, ``1 + 2 sum
    r_k^2``, is what counts for a quantity that oscillates like the residual itself.

    Parameters
    ----------
    correlations : ndarray, shape (lags + 1,)
    n : int
        Samples they were made from.
    """
    r = np.asarray(correlations[1:], float)
    if not r.size:
        return 1.0
    slow, alike = _summed(r), _summed(r**2 - 1.0 / n)
    found = max(1.0, slow, alike, autoregression(correlations, n).memory)
    return float(min(found, max(n, 1)))


def _summed(terms: Array) -> float:
    """One and twice the sum of the terms, up to the first lag beyond five times that."""
    running = 1.0 + 2.0 * np.cumsum(terms)
    lags = np.arange(1, running.size + 1)
    ended = np.flatnonzero(lags >= 5.0 * np.maximum(running, 1.0))
    return float(running[ended[0]] if ended.size else running.max())
