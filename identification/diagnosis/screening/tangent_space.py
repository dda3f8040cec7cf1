"""What a fit can do to the readings by its own parameters, nuisances and initial states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.signals.recording import Split
from bondgraph.support.arrays import Array
from identification.estimation.single_record import Fit
from identification.study.factors import stated_gains
from identification.study.joint import stack_of
from identification.study.residual import ResidualEvaluation, evaluate, windows


def within_calibration(fit: Fit, e: ResidualEvaluation) -> Array:
    """Return the Jacobian of a fit without the gains of its channels that ended at a bound.

    How far a calibration may be off is stated: what lies beyond is no freedom, but a finding.

    Returns
    -------
    ndarray, shape (M, p)
    """
    problem = fit.problem
    lower, upper = stack_of((problem,)).bounds
    gains = set(stated_gains(problem.with_chain).values())
    theta = fit.point.theta
    ended = [
        i for i, f in enumerate(problem.free)
        if f.parameter.name in gains and not lower[i] + AT < theta[i] < upper[i] - AT
    ]  # fmt: skip
    return np.delete(e.jacobian, ended, axis=1)


AT = 1e-6
"""Distance from a bound, of a number scaled to one, that is none."""


def freedom(fit: Fit) -> Array:
    """Return the tangents of a fit over the whole record, held-out samples included.

    Columns are scaled as the fit scales them: parameters, lags, declared delays, offsets, then the
    initial states of every window. Samples that no part of the split covers are zero.

    Returns
    -------
    ndarray, shape (N, n_y, p), SI
    """
    problem = fit.problem
    data = problem.data
    n_y = len(data.names)
    parts = []
    spans = windows(problem)
    for train, test in ((data.split.train, data.split.test), (data.split.test, data.split.train)):
        turned = replace(data, split=Split(train, test, data.split.rule))
        one = replace(problem, data=turned, whitening=(), built=problem.dynamics)
        mask = turned.mask("train")
        if mask.any():
            parts.append((mask, evaluate(one, fit.point)))
    shared = parts[0][1].jacobian.shape[1]
    states = [e.local[0][1].shape[1] for _, e in parts if e.local]
    each = max(states, default=0)
    out = np.zeros((data.n, n_y, shared + each * len(spans)))
    for mask, e in parts:
        at, row = 0, 0
        for k, span in enumerate(spans):
            chosen = np.flatnonzero(mask[span]) + (span.start or 0)
            if not chosen.size:
                continue
            size = n_y * chosen.size
            block = e.jacobian[at : at + size].reshape(n_y, chosen.size, shared)
            out[chosen, :, :shared] = block.transpose(1, 0, 2)
            local = e.local[row][1].reshape(n_y, chosen.size, each)
            first = shared + each * k
            out[chosen, :, first : first + each] = local.transpose(1, 0, 2)
            at, row = at + size, row + 1
    return np.asarray(out * data.floor[None, :, None])
