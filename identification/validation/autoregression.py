"""The autoregression that predicts a residual best from its own past, from its autocorrelation.

Levinson, J. Math. Phys. 25 (1947) 261; Durbin, Rev. Int. Stat. Inst. 28 (1960) 233. The order is
that of the least Akaike criterion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


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
    def memory(self) -> float:
        """Spectral density at frequency zero over that of white noise of the same power."""
        left = 1.0 - float(self.coefficients.sum())
        return self.innovation / max(left**2, 1e-300)


def autoregression(correlations: Array, n: int, most: int | None = None) -> Autoregression:
    """Fit an autoregression.

    Parameters
    ----------
    correlations : ndarray, shape (lags + 1,)
        Autocorrelation, 1 at lag 0.
    n : int
        Samples it was made from.
    most : int, optional
        Largest order; ``10 log10 n`` if not given.
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
        now = n * np.log(max(error, 1e-300)) + 2 * k
        if now < score:
            found, score = Autoregression(a, float(error)), now
    return found
