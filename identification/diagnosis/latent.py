"""The effort or flow that a port must have added, from the residual alone, by smoothing.

A latent signal ``w`` at a port reaches the readings through the linearised model: ``r = H w + T c +
noise``, with ``T`` what the parameters of the model do. ``w`` is a random process with the spectral
density ``s^2 / (1 + (f / f_c)^2)`` (an Ornstein-Uhlenbeck process: it may jump); ``s`` and ``f_c``
maximise the marginal likelihood in the frequency domain (Whittle, J. R. Stat. Soc. B 15 (1953)
125), and ``w`` is then its mean given the residual: regularised least squares, solved by conjugate
gradients with a circulant preconditioner (Chan and Ng, SIAM Rev. 38 (1996) 427).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

__all__ = ["Latent", "Respond", "latent"]

Array = np.ndarray
Respond = Callable[[Array], Array]
"""Additions at a port, shape (N, k), to changes of the readings, shape (N, n_y, k)."""

POWERS = np.logspace(-6, 8, 43)
"""Prior power of ``w`` tried, over the power that one noise floor of the readings needs."""
CORNERS = np.logspace(-3.0, -0.4, 14)
"""Corner frequencies tried, cycles a sample."""
STEPS = 400
TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Latent:
    """A reconstructed signal at a port.

    Attributes
    ----------
    signal : ndarray, shape (N,), SI
        Mean of the addition, given the residual.
    explained : float
        Share of the residual's weighted sum of squares that it explains.
    power, corner : float
        Prior variance of the signal (SI squared) and its corner frequency (Hz).
    steps : int
        Conjugate gradient steps taken.
    """

    signal: Array
    explained: float
    power: float
    corner: float
    steps: int


def latent(
    respond: Respond,
    residual: Array,
    floor: Array,
    dt: float,
    tangents: Array | None = None,
) -> Latent:
    """Reconstruct the addition at one port that explains a residual.

    Parameters
    ----------
    respond : callable
        The linearised model from the port to the readings: time invariant and at rest before the
        first sample.
    residual : ndarray, shape (N, n_y), SI
        Measured less simulated.
    floor : ndarray, shape (n_y,), SI
        Standard deviation of the noise.
    dt : float
        Time between samples, s.
    tangents : ndarray, shape (N, n_y, p), optional
        Readings' change by the parameters and initial states of the fit. What they can imitate
        says nothing about the port and is left out.

    Examples
    --------
    >>> push = np.sin(0.1 * np.arange(200.0))
    >>> found = latent(lambda w: w[:, None, :], push[:, None], np.array([1e-3]), 0.1)
    >>> bool(np.abs(found.signal - push).max() < 0.01)
    True
    """
    n = residual.shape[0]
    # an impulse at the first sample would be half of one between the samples
    impulse = np.zeros((n + 1, 1))
    impulse[1] = 1.0
    answer = respond(impulse[:n])[:, :, 0] / floor
    kernel = np.zeros_like(answer)
    kernel[: n - 1] = answer[1:]
    before = answer[0]  # a straight line between samples answers one sample early
    data = residual / floor
    basis = _basis(tangents / floor[:, None]) if tangents is not None else None
    data = _free_of(data, basis)
    size = next_fast_len(2 * n, real=True)
    transfer = rfft(kernel, size, axis=0)
    transfer += before * np.exp(2j * np.pi * np.fft.rfftfreq(size))[:, None]
    gain = np.sum(np.abs(transfer) ** 2, axis=1)
    # the cut at the end of the record would look like high frequencies
    taper = np.hanning(n)
    seen = rfft(data * taper[:, None], size, axis=0)
    matched = np.sum(np.conj(transfer) * seen, axis=1)
    frequencies = np.fft.rfftfreq(size)
    power, corner = _likeliest(gain, np.abs(matched) ** 2 / np.sum(taper**2), frequencies)
    stiffness = 1.0 / _density(power, corner, frequencies)

    def forward(w: Array) -> Array:
        return np.asarray(irfft(transfer * rfft(w, size)[:, None], size, axis=0)[:n])

    def backward(r: Array) -> Array:
        both = np.sum(np.conj(transfer) * rfft(r, size, axis=0), axis=1)
        return np.asarray(irfft(both, size)[:n])

    def normal(w: Array) -> Array:
        smooth = irfft(stiffness * rfft(w, size), size)[:n]
        return np.asarray(backward(_free_of(forward(w), basis)) + smooth)

    def precondition(w: Array) -> Array:
        return np.asarray(irfft(rfft(w, size) / (gain + stiffness), size)[:n])

    signal, steps = _conjugate_gradients(normal, backward(data), precondition)
    left = data - _free_of(forward(signal), basis)
    total = float(np.sum(data**2)) or 1.0
    variance = float(np.sum(_density(power, corner, np.fft.fftfreq(n))) / n)
    return Latent(signal, 1 - float(np.sum(left**2)) / total, variance, corner / dt, steps)


def _density(power: float, corner: float, frequencies: Array) -> Array:
    return np.asarray(power / (1 + (frequencies / corner) ** 2))


def _likeliest(gain: Array, matched: Array, frequencies: Array) -> tuple[float, float]:
    """Prior power and corner of the largest marginal likelihood, frequency by frequency."""
    unit = 1.0 / (float(gain.mean()) or 1.0)
    best = (-np.inf, unit, 0.1)
    for corner in CORNERS:
        shape = _density(unit, corner, frequencies)
        for power in POWERS:
            s = power * shape
            seen = 1 + s * gain
            value = float(np.sum(s * matched / seen - np.log(seen)))
            if value > best[0]:
                best = value, float(power * unit), float(corner)
    return best[1], best[2]


def _conjugate_gradients(
    apply: Callable[[Array], Array], right: Array, precondition: Callable[[Array], Array]
) -> tuple[Array, int]:
    x = np.zeros_like(right)
    r = right.copy()
    z = precondition(r)
    p, rho = z, float(r @ z)
    goal = TOLERANCE**2 * rho
    for step in range(1, STEPS + 1):
        if rho <= goal or rho <= 0:
            return x, step - 1
        a = apply(p)
        curve = float(p @ a)
        if curve <= 0:  # rounding: no further step improves
            return x, step - 1
        x = x + rho / curve * p
        r = r - rho / curve * a
        z = precondition(r)
        rho, old = float(r @ z), rho
        p = z + rho / old * p
    return x, STEPS


def _basis(tangents: Array) -> Array:
    """Orthonormal columns of the directions of the fit, shape (N n_y, p)."""
    flat = tangents.reshape(-1, tangents.shape[2])
    size = np.linalg.norm(flat, axis=0)
    flat = flat[:, size > 0] / size[size > 0]
    u, s, _ = np.linalg.svd(flat, full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s.max(initial=0.0)])


def _free_of(x: Array, basis: Array | None) -> Array:
    if basis is None or not basis.shape[1]:
        return x
    flat = x.ravel()
    return np.asarray((flat - basis @ (basis.T @ flat)).reshape(x.shape))
