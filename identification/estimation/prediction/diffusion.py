"""Process noise between two samples: its exact covariance and the derivatives of it.

``dx = A x dt + G dW`` with a diffusion of unit intensity in `W` adds over a step the covariance::

    Q(h) = integral over 0..h of exp(A s) G G' exp(A' s) ds

(Van Loan, IEEE TAC 23 (1978) 395), so that the same diffusion serves every sampling rate. His block
exponential holds ``exp(-A h)``, which overflows for stiff models; here a short step is expanded in
a series and doubled, ``Q(2 h) = Q(h) + Phi(h) Q(h) Phi(h)'``, which only adds what is positive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array

LONGEST = 0.25
"""Norm of ``A h`` up to which the series is used."""

TERMS = 16
"""Terms of the series: the first one left out is below ``0.5^16 / 17!``."""


@dataclass(frozen=True, slots=True)
class AddedCovariance:
    """Covariance added over a step.

    Attributes
    ----------
    value : ndarray, shape (n_x, n_x)
    derivative : ndarray, shape (n_d, n_x, n_x)
    """

    value: Array
    derivative: Array


def added_covariance(
    a: Array, intensity: Array, step: float, da: Array, dintensity: Array
) -> AddedCovariance:
    """Return ``Q(step)`` and its derivatives.

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
    >>> random_walk = added_covariance(np.zeros((1, 1)), np.array([[4.0]]), 0.5, zero, zero)
    >>> print(random_walk.value)
    [[2.]]
    """
    size = float(np.abs(a).sum(axis=1).max(initial=0.0)) * step
    doublings = max(0, int(np.ceil(np.log2(size / LONGEST)))) if size > 0 else 0
    h = step / 2**doublings
    phi, dphi = _exponential(a * h, da * h)
    q, dq = _series(a * h, intensity * h, da * h, dintensity * h)
    for _ in range(doublings):
        carried = phi @ q @ phi.T
        half = dphi @ (q @ phi.T)
        dq = dq + half + _transposed(half) + phi @ dq @ phi.T
        q = q + carried
        dphi = dphi @ phi + phi @ dphi
        phi = phi @ phi
    return AddedCovariance(0.5 * (q + q.T), 0.5 * (dq + _transposed(dq)))


def _transposed(v: Array) -> Array:
    return np.swapaxes(v, -1, -2)


def _exponential(a: Array, da: Array) -> tuple[Array, Array]:
    term, dterm = np.eye(a.shape[0]), np.zeros_like(da)
    total, dtotal = term.copy(), dterm.copy()
    for i in range(1, TERMS + 1):
        dterm = (dterm @ a + term @ da) / i
        term = term @ a / i
        total, dtotal = total + term, dtotal + dterm
    return total, dtotal


def _series(a: Array, s: Array, da: Array, ds: Array) -> tuple[Array, Array]:
    """Sum of ``L^i(S) / (i + 1)!`` with ``L(X) = A X + X A'``."""
    term, dterm = s, ds
    total, dtotal = term.copy(), dterm.copy()
    for i in range(1, TERMS + 1):
        half, dhalf = a @ term, da @ term + a @ dterm
        term = (half + half.T) / (i + 1)
        dterm = (dhalf + _transposed(dhalf)) / (i + 1)
        total, dtotal = total + term, dtotal + dterm
    return total, dtotal
