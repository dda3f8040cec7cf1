"""Baseline: sparse regression of what the nominal model leaves on the columns of the screening.

The regression for discrepancies (Kaheman and others, IEEE Access 7 (2019) 169404) by optimisers of
pysindy: sequentially thresholded least squares (Brunton, Proctor and Kutz, PNAS 113 (2016) 3932),
its relaxed form SR3 (Zheng and others, IEEE Access 7 (2019) 1404) and greedy selection, FROLS
(Billings, Nonlinear System Identification, 2013). Thresholds are chosen by the Bayesian information
criterion (Mangan and others, Proc. R. Soc. A 473 (2017) 20170009).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from tests.proof.trial.columns import Columns

THRESHOLDS = (0.01, 0.03, 0.1, 0.3)
"""Least weights of columns of size one, to the size of the residual."""
RIDGE = 0.05
"""Ridge on columns of size one, pysindy's default: laws that look alike make like columns."""
TERMS = (1, 2, 3)
"""Terms that a greedy selection keeps."""


def _thresholded(matrix: Array, target: Array) -> Iterator[Any]:
    import pysindy

    for t in THRESHOLDS:
        yield pysindy.STLSQ(threshold=t, alpha=0.0).fit(matrix, target)


def _relaxed(matrix: Array, target: Array) -> Iterator[Any]:
    import pysindy

    for t in THRESHOLDS:
        # weights below sqrt(2 lambda nu) fall
        yield pysindy.SR3(reg_weight_lam=0.5 * t**2, regularizer="L0").fit(matrix, target)


def _greedy(matrix: Array, target: Array) -> Iterator[Any]:
    import pysindy

    for terms in TERMS:
        yield pysindy.FROLS(max_iter=terms, alpha=0.0).fit(matrix, target)


OPTIMISERS: Mapping[str, Callable[[Array, Array], Iterator[Any]]] = MappingProxyType(
    {"STLSQ": _thresholded, "SR3": _relaxed, "FROLS": _greedy}
)
"""Optimisers by name: each yields regressions with a ``coef_``."""


def sparse_terms(columns: Columns) -> dict[str, list[list[Any]]]:
    """Return the terms that each optimiser keeps, the strongest first.

    Returns
    -------
    dict of str to list of [effect, element, contribution]
        The contribution is the rms that the term makes, over that of the residual. No term: the
        criterion takes the model as it is.
    """
    total = float(np.linalg.norm(columns.residual))
    if not columns.labels or total == 0.0:
        return {name: [] for name in OPTIMISERS}
    size = np.linalg.norm(columns.matrix, axis=0)
    # the same normal equations in as many rows as there are columns
    both = np.column_stack([columns.matrix / size, columns.residual / total])
    triangle: Array = np.asarray(np.linalg.qr(both, mode="r"))
    count = len(columns.labels)
    # as rows it holds for all optimisers alike
    matrix = np.vstack([triangle[:, :-1], math.sqrt(RIDGE) * np.eye(count)])
    target = np.concatenate([triangle[:, -1], np.zeros(count)])
    found = {}
    for name, optimiser in OPTIMISERS.items():
        weights = _chosen(optimiser, matrix, target, columns.residual.size)
        order = [int(i) for i in np.argsort(-np.abs(weights)) if weights[i] != 0.0]
        found[name] = [[*columns.labels[i], float(f"{abs(weights[i]):.4g}")] for i in order]
    return found


def _chosen(
    optimiser: Callable[[Array, Array], Iterator[Any]], matrix: Array, target: Array, rows: int
) -> Array:
    """Return the weights with the least information criterion, those of no term among them."""
    best = np.zeros(matrix.shape[1])
    least = rows * math.log(float(target @ target))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a threshold leaves nothing is an answer
        for made in optimiser(matrix, target):
            weights = np.ravel(made.coef_)
            left = target - matrix @ weights
            value = rows * math.log(max(float(left @ left), 1e-300))
            value += int(np.count_nonzero(weights)) * math.log(rows)
            if np.isfinite(weights).all() and value < least:
                best, least = weights, value
    return best
