"""What a latent signal must have been, sample by sample, for the readings to come out as they did.

The smoother that belongs to a filter which is blind to the signal: what the filter leaves is sent
backwards through it (fixed-interval smoothing: Bryson and Frazier, 1963; Anderson and Moore,
Optimal Filtering, 1979, chapter 7).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.relations.latent import Sampled
from identification.diagnosis.localisation.relations.whitening import Blind, blind_filter, scan

ROUNDS = 2
"""Times that the size of the signal is read off its own course."""
LEAST = 1e-6
"""Part of the first size below which a signal counts as silent."""


def latent_course(model: Sampled, size: Array, residual: Array) -> Array:
    """Return the likeliest course of latent signals, the state at the start unknown.

    Parameters
    ----------
    model : Sampled
        From the signals to the weighted readings.
    size : ndarray, shape (k,)
        Standard deviation that is ample for the signals; their own is found from there.
    residual : ndarray, shape (N, n_y)
        Weighted residual of one unbroken record.

    Returns
    -------
    ndarray, shape (N, k)
        Values at the samples, linear between them, in the unit of the model's inputs.
    """
    least = LEAST * size
    course = followed(model, size, residual)
    for _ in range(ROUNDS):
        size = np.maximum(np.sqrt(np.mean(course**2, axis=0)), least)
        course = followed(model, size, residual)
    return course


def followed(model: Sampled, size: Array, residual: Array) -> Array:
    """Return the course of signals of a given size: ample ones follow the readings' noise too."""
    return _smoothed(model, blind_filter(model, size), size, residual)


def _smoothed(model: Sampled, blind: Blind, size: Array, residual: Array) -> Array:
    """One pass: innovations, the start taken out, then backwards."""
    seen = _without_start(blind, blind(residual.T[:, None, :])[:, 0])
    back = solve_triangular(blind.root, seen, lower=True, trans="T")
    reach = blind.reach
    gamma, d = model.gamma * size * reach[:, None], model.d * size
    # what all later readings say of the state, from the last sample to the first
    later = scan(blind.a.T, (blind.c.T @ back)[:, None, ::-1])[:, 0, ::-1]
    told = d.T @ back + (gamma - blind.k @ d).T @ later
    return np.asarray(told.T * size)


def _without_start(blind: Blind, seen: Array) -> Array:
    """Take out what any state at the start would have left."""
    if not blind.states:
        return seen
    starts = blind.starts(seen.shape[1]).transpose(1, 0, 2).reshape(blind.states, -1)
    sizes = np.linalg.norm(starts, axis=1)
    sound = sizes > 0
    columns = (starts[sound] / sizes[sound, None]).T
    weights = np.linalg.lstsq(columns, seen.ravel(), rcond=1e-8)[0]
    return np.asarray(seen - (columns @ weights).reshape(seen.shape))
