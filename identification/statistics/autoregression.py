"""The autoregression that predicts a residual best from its own past, from its autocorrelation.

Levinson, J. Math. Phys. 25 (1947) 261; Durbin, Rev. Int. Stat. Inst. 28 (1960) 233: the Yule-Walker
equations, whose filter is always stable. The order is that of the least information criterion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.statistics.correlation import autocorrelation


@dataclass(frozen=True, eq=False)
class Autoregression:
    """``e(t) = sum a_k e(t - k) + innovation``.

    Attributes
    ----------
    coefficients : ndarray, shape (order,)
    innovation : float
        Power of the innovations over that of the residual, 0 .. 1.
    """

    coefficients: Array
    innovation: float

    @property
    def polynomial(self) -> Array:
        """Filter ``1, -a_1, ..., -a_p`` that whitens, shape (order + 1,)."""
        return np.concatenate([[1.0], -self.coefficients])

    @property
    def memory(self) -> float:
        """Spectral density at frequency zero over that of white noise of the same power."""
        left = 1.0 - float(self.coefficients.sum())
        return self.innovation / max(left**2, 1e-300)


def autoregression(
    correlations: Array, n: int, most: int | None = None, penalty: float = 2.0
) -> Autoregression:
    """Fit an autoregression.

    Parameters
    ----------
    correlations : ndarray, shape (lags + 1,)
        Autocorrelation, 1 at lag 0.
    n : int
        Samples it was made from.
    most : int, optional
        Largest order; ``10 log10 n`` if not given.
    penalty : float
        What a further coefficient must gain: 2 by Akaike, ``log n`` by Schwarz.
    """
    r = np.asarray(correlations, float)
    order = round(10 * np.log10(max(n, 2))) if most is None else most
    found = Autoregression(np.zeros(0), 1.0)
    a, error, score = np.zeros(0), 1.0, 0.0
    for k in range(1, min(order, r.size - 1) + 1):
        reflection = (r[k] - (a @ r[k - 1 : 0 : -1] if k > 1 else 0.0)) / error
        if not abs(reflection) < 1:
            break
        a = np.append(a - reflection * a[::-1], reflection)
        error *= 1 - reflection**2
        now = n * np.log(max(error, 1e-300)) + penalty * k
        if now < score:
            found, score = Autoregression(a, float(error)), now
    return found


def whitening_filter(residual: Array, largest: int = 20) -> Array:
    """Return the polynomial that whitens a record of residuals, shape (p + 1,), its order by BIC.

    Parameters
    ----------
    residual : ndarray, shape (N,)
        In time order; its mean is removed.
    largest : int
        Largest order that is tried.
    """
    n = residual.size
    most = max(0, min(largest, n // 10))
    r = autocorrelation([residual - residual.mean()], most)
    return autoregression(r, n, most, float(np.log(n))).polynomial


def innovations(residual: Array, polynomial: Array) -> Array:
    """Return the residual after its whitening filter, without the run-in, shape (N - p,)."""
    return np.asarray(np.convolve(residual, polynomial, mode="valid"))
