"""Process noise between two samples: its exact covariance and the derivatives of it.

``dx = A x dt + G dW`` with a diffusion of unit intensity in `W` adds over a step the covariance::

    Q(h) = integral over 0..h of exp(A s) G G' exp(A' s) ds

(Van Loan, IEEE TAC 23 (1978) 395), so that the same diffusion serves every sampling rate. His block
exponential holds ``exp(-A h)``, which overflows for stiff models; here a short step is expanded in
a series and doubled, ``Q(2 h) = Q(h) + Phi(h) Q(h) Phi(h)'``, which only adds what is positive.

A derivative is the covariance of a state with what a change of `A` and `G` makes of it, so it comes
from the same sums over a system of twice the size.
"""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array

LONGEST = 0.25
"""Norm of ``A h`` up to which the series is used."""

TERMS = 16
"""Terms of the series: the first one left out is below ``0.5^16 / 17!``."""


def added_covariance(
    a: Array, intensity: Array, step: float, da: Array, dintensity: Array
) -> tuple[Array, Array]:
    """Return ``Q(step)`` and its derivatives, shapes (n_x, n_x) and (n_d, n_x, n_x).

    Parameters
    ----------
    a : ndarray, shape (n_x, n_x), 1/s
        Linear dynamics; balance its units beforehand.
    intensity : ndarray, shape (n_x, n_x)
        ``G G'``, symmetric, in squared units of the states a second.
    step : float
        s.
    da, dintensity : ndarray, shape (n_d, n_x, n_x)
        Derivatives of `a` and `intensity`.

    Examples
    --------
    >>> import numpy as np
    >>> zero = np.zeros((0, 1, 1))
    >>> random_walk, _ = added_covariance(np.zeros((1, 1)), np.array([[4.0]]), 0.5, zero, zero)
    >>> print(random_walk)
    [[2.]]
    """
    n, n_d = a.shape[0], da.shape[0]
    size = float(np.abs(a).sum(axis=1).max(initial=0.0)) * step
    doublings = max(0, int(np.ceil(np.log2(size / LONGEST)))) if size > 0 else 0
    wide, both = np.zeros((2, n_d, 2 * n, 2 * n))
    wide[:, :n, :n] = wide[:, n:, n:] = a
    wide[:, n:, :n], both[:, :n, :n] = da, intensity
    both[:, n:, :n] = both[:, :n, n:] = 0.5 * dintensity
    half = _summed(wide, both, step, doublings)[:, n:, :n]
    return _summed(a, intensity, step, doublings), half + half.swapaxes(-1, -2)


def _summed(a: Array, s: Array, step: float, doublings: int) -> Array:
    """Series of a short step, doubled: ``h sum L^k(S) h^k / (k + 1)!``, ``L(X) = A X + X A'``."""
    h = step / 2**doublings
    x, q = a * h, s * h
    phi = power = np.broadcast_to(np.eye(a.shape[-1]), a.shape)
    term = q
    for i in range(1, TERMS + 1):
        power = power @ x / i
        phi = phi + power
        half = x @ term
        term = (half + half.swapaxes(-1, -2)) / (i + 1)
        q = q + term
    for _ in range(doublings):
        q = q + phi @ q @ phi.swapaxes(-1, -2)
        phi = phi @ phi
    return np.asarray(0.5 * (q + q.swapaxes(-1, -2)))
