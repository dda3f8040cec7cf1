"""Covariance of a fit whose residuals may be correlated and uneven."""

from __future__ import annotations

import numpy as np
from scipy import stats

from bondgraph.support.arrays import FloatArray as Array
from hardware.synchrony.fit import AlignmentData, FittedTimeMap

BLOCKS = 32


def covariance_of(material: AlignmentData, fitted: FittedTimeMap) -> Array:
    """Return the covariance of the free numbers, (p, p), by scores summed over blocks.

    The sandwich of Newey and West's kind with `BLOCKS` blocks of neighbours (Driscoll and Kraay
    1998 for the idea): what is correlated over less than a block widens it. Never below the plain
    covariance of white residuals. Beliefs enter as observations.
    """
    j, rest = fitted.jacobian, fitted.rest
    n, p = j.shape
    variance = float(rest @ rest) / max(n - p - fitted.coefficients.size, 1)
    believed = np.zeros((p, p))
    for name, _, sd in material.beliefs:
        k = material.free.index(name)
        believed[k, k] = variance / sd**2
    h = j.T @ j + believed
    size = np.sqrt(np.maximum(np.diag(h), 1e-300))
    inverse = np.linalg.pinv(h / np.outer(size, size), rcond=1e-13, hermitian=True)
    inverse /= np.outer(size, size)
    edges = np.linspace(0, n, BLOCKS + 1).astype(int)[:-1]
    scores = np.add.reduceat(j * rest[:, None], edges, axis=0)
    robust = inverse @ (scores.T @ scores * (BLOCKS / (BLOCKS - p)) + variance * believed) @ inverse
    plain = inverse * variance
    least = np.maximum(np.diag(robust), 1e-300)
    larger = np.sqrt(np.maximum(np.diag(plain) / least, 1.0))
    return np.asarray(robust * np.outer(larger, larger))


def spread_out(found: Array, material: AlignmentData, fitted: FittedTimeMap) -> Array:
    """Return the covariance of all numbers of the map, zero where they are not free."""
    names = fitted.guess.map.names
    inner = [k for k, n in enumerate(material.free) if n != "lag"]
    where = [names.index(material.free[k]) for k in inner]
    whole = np.zeros((len(names), len(names)))
    whole[np.ix_(where, where)] = found[np.ix_(inner, inner)]
    return whole


def reach(count: int) -> float:
    """Half width of a 95 % interval in standard errors, with `count` fitted numbers."""
    return float(stats.t.ppf(0.975, BLOCKS - count))
