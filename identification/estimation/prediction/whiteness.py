"""Test of the innovations: white if the model leaves nothing out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.estimation.prediction.model import PredictionModel

if TYPE_CHECKING:
    from identification.estimation.prediction.result import PredictionFit

__all__ = ["ljung_box", "whiteness"]

Array = np.ndarray


def whiteness(model: PredictionModel, fit: PredictionFit, lags: int = 20) -> dict[str, float]:
    """Return the Ljung-Box p-value of each reading's training innovations, the worst record's."""
    found: dict[str, float] = {}
    for j, name in enumerate(model.names):
        values = []
        for data, seen in zip(model.records, fit.predicted, strict=True):
            e = seen.innovation[data.mask("train"), j]
            values.append(ljung_box(e, lags))
        found[name] = min(1.0, min(values) * len(values))
    return found


def ljung_box(e: Array, lags: int = 20) -> float:
    """p-value of the hypothesis that `e` (shape (N,), NaN where missing) is white.

    Ljung and Box, Biometrika 65 (1978) 297. Missing samples leave out their products.

    Examples
    --------
    >>> import numpy as np
    >>> e = np.random.default_rng(1).standard_normal(2000)
    >>> ljung_box(e) > 0.01, ljung_box(np.cumsum(e)) < 1e-6
    (True, True)
    """
    from scipy.stats import chi2

    seen = np.isfinite(e)
    n = int(seen.sum())
    lags = min(lags, n // 5)
    if lags < 1:
        return 1.0
    v = np.where(seen, e - e[seen].mean(), 0.0)
    power = float(v @ v)
    if power == 0.0:
        return 1.0
    r = np.array([v[k:] @ v[:-k] / power for k in range(1, lags + 1)])
    statistic = n * (n + 2) * float(np.sum(r**2 / (n - np.arange(1, lags + 1))))
    return float(chi2.sf(statistic, lags))
