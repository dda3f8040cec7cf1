"""How well a hypothesis predicts stretches it has not seen, with the noise that it needs itself.

The score of a stretch is minus the logarithm of its predictive density, Gaussian with a standard
deviation for each reading that is fitted with the hypothesis: a floor that was read wrongly
decides nothing, and where an effect shows rarely the quiet stretches speak as well, because they
tell how sharp the better model is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from bondgraph.support.arrays import Array
from identification.diagnosis.evidence.leave_out import LeftOut, Rows, left_out, stretch_sums
from identification.estimation.single_record import Fit
from identification.statistics.blocks import mean_z

LEAST = 1e-3
"""Smallest standard deviation over the floor: no model predicts rounding."""


@dataclass(frozen=True, eq=False)
class BlockScore:
    """Score of one hypothesis; smaller is better.

    Attributes
    ----------
    loss : ndarray, shape (B,)
        Minus the log predictive density, mean over the samples and readings of each stretch.
    noise : ndarray, shape (n_y,)
        Standard deviation of each reading's prediction error, over the floor.
    """

    loss: Array
    noise: Array

    @property
    def mean(self) -> float:
        """Mean loss."""
        return float(np.mean(self.loss))


def score_of(out: LeftOut) -> BlockScore:
    """Score residuals that were predicted without their own stretch."""
    n_y = int(out.rows.channel.max(initial=0)) + 1
    square = stretch_sums(out.rows, np.minimum(out.residual**2, 1e300), n_y)
    count = stretch_sums(out.rows, np.ones(out.residual.size), n_y)
    variance = np.maximum(square.sum(axis=0) / np.maximum(count.sum(axis=0), 1), LEAST**2)
    loss = 0.5 * (count * np.log(variance) + square / variance).sum(axis=1)
    return BlockScore(loss / np.maximum(count.sum(axis=1), 1), np.sqrt(variance))


def score(fit: Fit) -> BlockScore:
    """Score a fit."""
    return score_of(left_out(fit))


def behind(worse: BlockScore, better: BlockScore) -> float:
    """Standard errors by which `worse` predicts worse, by stretches; negative if it is better."""
    return mean_z(worse.loss - better.loss, np.inf)


def chance(z: float, blocks: int) -> float:
    """One-sided chance of such a lead between equals.

    Examples
    --------
    >>> chance(0.0, 40)
    0.5
    """
    return float(student.sf(z, max(blocks - 1, 1)))


