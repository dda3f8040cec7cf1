"""Log-likelihood of the innovations with its exact gradient and the expected information.

With innovations `e` of variance `s` (readings one after the other, so all are scalars)::

    log L = -1/2 sum (log(2 pi s) + e^2 / s)

The gradient comes from the exact derivatives of the filter, the information from first derivatives
only: ``I_ij = sum (de_i de_j / s + ds_i ds_j / (2 s^2))`` (Segal and Weinstein, IEEE TIT 35 (1989)
682; Astrom, Automatica 16 (1980) 551).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.prediction.assembly import assemble
from identification.estimation.prediction.kalman import KalmanFilter
from identification.estimation.prediction.loop import Passed, filter_runner

BLOCKS = 40
"""Runs of samples over which scores are summed for the robust covariance."""


@dataclass(frozen=True, slots=True)
class LikelihoodEvaluation:
    """The likelihood at one theta.

    Attributes
    ----------
    log_likelihood : float
        Of the training readings, SI; minus infinity where the filter fails.
    gradient : ndarray, shape (n_theta,)
    information : ndarray, shape (n_theta, n_theta)
    scores : ndarray, shape (n_blocks, n_theta)
        Gradient by runs of samples.
    """

    log_likelihood: float
    gradient: Array
    information: Array
    scores: Array


def evaluate(kalman: KalmanFilter, theta: Array, derivatives: bool = True) -> LikelihoodEvaluation:
    """Filter all records; log-likelihoods of records add up."""
    n = theta.size
    gradient, information = np.zeros(n), np.zeros((n, n))
    scores: list[Array] = []
    total = 0.0
    for record in range(len(kalman.problems)):
        mask = scored(kalman, record)
        with np.errstate(all="ignore"):
            passed, where = pass_over(kalman, theta, record, mask, derivatives)
            value = _value(passed, mask)
        total += value - float((mask * np.log(kalman.reading_scale(record))).sum())
        if not np.isfinite(value) or not derivatives:
            continue
        by_sample, expected = _derivatives(passed, mask)
        gradient[where] += by_sample.sum(axis=0)
        information[np.ix_(where, where)] += expected
        for part in np.array_split(by_sample, BLOCKS):
            row = np.zeros(n)
            row[where] = part.sum(axis=0)
            scores.append(row)
    if not np.isfinite(total):
        total = -np.inf
    return LikelihoodEvaluation(total, gradient, information, np.array(scores).reshape(-1, n))


def pass_over(
    kalman: KalmanFilter, theta: Array, record: int, mask: Array, derivatives: bool = False
) -> tuple[Passed, Array]:
    """Run the filter over the first ``len(mask)`` samples of a record; `mask` says what is seen.

    Returns
    -------
    Passed
    ndarray of int
        Positions in theta of the directions of its derivatives.
    """
    made, n = assemble(kalman, theta, record, derivatives), mask.shape[0]
    readings = kalman.problems[record].data.readings[:n]
    y = np.where(mask > 0, readings, 0.0) / kalman.reading_scale(record)
    u = kalman.fine[record][: n * kalman.n_sub]
    run = filter_runner(kalman.plants[record])
    return run(u, y, mask, kalman.n_sub, made), made.where


def scored(kalman: KalmanFilter, record: int) -> Array:
    """One where a reading is scored, up to the last such sample."""
    data = kalman.problems[record].data
    seen = np.isfinite(data.readings) & data.mask("train")[:, None]
    last = int(np.flatnonzero(seen.any(axis=1)).max(initial=0))
    return np.asarray(seen[: last + 1], float)


def _value(passed: Passed, mask: Array) -> float:
    e, s = passed.innovation, passed.variance
    seen = mask > 0
    if not (s[seen] > 0).all():
        return -np.inf
    terms = np.log(2.0 * np.pi * s[seen]) + e[seen] ** 2 / s[seen]
    return float(-0.5 * terms.sum())


def _derivatives(passed: Passed, mask: Array) -> tuple[Array, Array]:
    """Score of each sample, shape (N, n_d), and the expected information."""
    e, s = passed.innovation, passed.variance
    de, ds = passed.dinnovation, passed.dvariance
    weight = mask / s
    score = -np.einsum("kj,kdj->kd", weight * e, de)
    score -= 0.5 * np.einsum("kj,kdj->kd", weight * (1.0 - e**2 / s), ds)
    n_d = de.shape[1]
    root = np.sqrt(weight)[:, None, :]
    means = (de * root).transpose(0, 2, 1).reshape(-1, n_d)
    spreads = (ds * (root / np.sqrt(2.0 * s)[:, None, :])).transpose(0, 2, 1).reshape(-1, n_d)
    return score, means.T @ means + spreads.T @ spreads
