"""The effort or flow that a port must have added, from the residual alone, by smoothing.

A latent signal ``w`` at a port reaches the readings through the linearised model: ``r = H w + T c +
noise``, with ``T`` what the parameters of the model do. ``w`` is a random process with the spectral
density ``s^2 / (1 + (f / f_c)^2)`` (an Ornstein-Uhlenbeck process: it may jump); ``s`` and ``f_c``
maximise the marginal likelihood in the frequency domain (Whittle, J. R. Stat. Soc. B 15 (1953)
125), and ``w`` is then its mean given the residual: regularised least squares, solved by conjugate
gradients with a circulant preconditioner (Chan and Ng, SIAM Rev. 38 (1996) 427).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from bondgraph.support.arrays import Array

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
    windows: Sequence[slice] | None = None,
    scored: Array | None = None,
) -> Latent:
    """Reconstruct the addition at one port that explains a residual.

    Parameters
    ----------
    respond : callable
        The linearised model from the port to the readings: time invariant and at rest before the
        first sample of each window.
    residual : ndarray, shape (N, n_y), SI
        Measured less simulated.
    floor : ndarray, shape (n_y,), SI
        Standard deviation of the noise.
    dt : float
        Time between samples, s.
    tangents : ndarray, shape (N, n_y, p), optional
        Readings' change by the parameters and initial states of the fit. What they can imitate
        says nothing about the port and is left out.
    windows : sequence of slice, optional
        Stretches that the model simulates on their own; the whole record if not given. The signal
        is zero outside of them.
    scored : ndarray of bool, shape (N,), optional
        Samples whose residual counts; all if not given. What the others read is not known.

    Examples
    --------
    >>> push = np.sin(0.1 * np.arange(200.0))
    >>> found = latent(lambda w: w[:, None, :], push[:, None], np.array([1e-3]), 0.1)
    >>> bool(np.abs(found.signal - push).max() < 0.01)
    True
    """
    cut = _Cut.of(windows or [slice(0, residual.shape[0])])
    impulse = np.zeros((residual.shape[0], 1))
    # an impulse at the first sample would be half of one between the samples
    impulse[cut.parts[0].start + 1] = 1.0
    answer = respond(impulse)[cut.longest][:, :, 0] / floor
    size = next_fast_len(2 * cut.length, real=True)
    frequencies = np.fft.rfftfreq(size)
    # a straight line between samples answers one sample early
    transfer = rfft(answer, size, axis=0) * np.exp(2j * np.pi * frequencies)[:, None]
    known = np.ones(residual.shape[0]) if scored is None else np.asarray(scored, float)
    seen = cut.stacked(known)[:, :, None]
    basis = None
    if tangents is not None:
        basis = _basis(tangents * (known[:, None] / floor)[:, :, None], cut)
    data = _free_of(seen * cut.stacked(residual / floor), basis)
    gain = np.sum(np.abs(transfer) ** 2, axis=1)
    power, corner = _likeliest(transfer, gain, data, seen[:, :, 0], frequencies)
    stiffness = 1.0 / _density(power, corner, frequencies)

    def forward(w: Array) -> Array:
        out = irfft(transfer * rfft(w, size, axis=1)[:, :, None], size, axis=1)
        return np.asarray(out[:, : cut.length] * seen)

    def filtered(w: Array, by: Array) -> Array:
        out = irfft(by * rfft(w, size, axis=1), size, axis=1)[:, : cut.length]
        return np.asarray(out * cut.inside)

    def backward(r: Array) -> Array:
        both = np.sum(np.conj(transfer) * rfft(r, size, axis=1), axis=2)
        return np.asarray(irfft(both, size, axis=1)[:, : cut.length] * cut.inside)

    def normal(w: Array) -> Array:
        return np.asarray(backward(_free_of(forward(w), basis)) + filtered(w, stiffness))

    def precondition(w: Array) -> Array:
        return filtered(w, 1 / (gain + stiffness))

    found, steps = _conjugate_gradients(normal, backward(data), precondition)
    left = data - _free_of(forward(found), basis)
    total = float(np.sum(data**2)) or 1.0
    variance = float(np.mean(_density(power, corner, np.fft.fftfreq(cut.length))))
    explained = 1 - float(np.sum(left**2)) / total
    return Latent(cut.joined(found, residual.shape[0]), explained, variance, corner / dt, steps)


@dataclass(frozen=True, eq=False)
class _Cut:
    """Windows of a record side by side, filled up with zeros to the longest, shape (W, L, ..)."""

    parts: tuple[slice, ...]
    length: int
    inside: Array

    @classmethod
    def of(cls, windows: Sequence[slice]) -> _Cut:
        """From slices with a start and a stop; the longest first, so that its answer is whole."""
        parts = tuple(sorted(windows, key=lambda s: s.start - s.stop))
        length = parts[0].stop - parts[0].start
        inside = np.array([np.arange(length) < s.stop - s.start for s in parts], float)
        return cls(parts, length, inside)

    @property
    def longest(self) -> slice:
        """The window that the impulse is sent through."""
        return self.parts[0]

    def stacked(self, x: Array) -> Array:
        """Windows of a record, shape (W, L, ..)."""
        out = np.zeros((len(self.parts), self.length, *x.shape[1:]))
        for row, s in zip(out, self.parts, strict=True):
            row[: s.stop - s.start] = x[s]
        return out

    def joined(self, x: Array, n: int) -> Array:
        """Return the record of windows, zero elsewhere, shape (n,)."""
        out = np.zeros(n)
        for row, s in zip(x, self.parts, strict=True):
            out[s] = row[: s.stop - s.start]
        return out


def _density(power: float, corner: float, frequencies: Array) -> Array:
    return np.asarray(power / (1 + (frequencies / corner) ** 2))


def _likeliest(
    transfer: Array, gain: Array, data: Array, seen: Array, frequencies: Array
) -> tuple[float, float]:
    """Prior power and corner of the largest marginal likelihood, frequency by frequency."""
    # the cuts at the ends of a stretch would look like high frequencies
    taper = _tapers(seen)
    known = taper.any(axis=1)  # a recording that was held out says nothing
    taper, data = taper[known], data[known]
    size = 2 * (frequencies.size - 1) if frequencies[-1] == 0.5 else 2 * frequencies.size - 1
    read = rfft(data * taper[:, :, None], size, axis=1)
    each = np.abs(np.sum(np.conj(transfer) * read, axis=2)) ** 2
    matched = np.sum(each / np.sum(taper**2, axis=1)[:, None], axis=0)
    unit = 1.0 / (float(gain.mean()) or 1.0)
    best = (-np.inf, unit, 0.1)
    for corner in CORNERS:
        shape = _density(unit, corner, frequencies)
        for power in POWERS:
            s = power * shape
            left = 1 + s * gain
            value = float(np.sum(s * matched / left - len(taper) * np.log(left)))
            if value > best[0]:
                best = value, float(power * unit), float(corner)
    return best[1], best[2]


def _tapers(seen: Array) -> Array:
    """Hann's taper on every stretch of samples that are known, shape (W, L)."""
    out = np.zeros(seen.shape)
    for row, known in zip(out, seen > 0, strict=True):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(int), [0]])))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            row[begin:end] = np.hanning(end - begin + 2)[1:-1]
    return out


def _conjugate_gradients(
    apply: Callable[[Array], Array], right: Array, precondition: Callable[[Array], Array]
) -> tuple[Array, int]:
    x = np.zeros_like(right)
    r = right.copy()
    z = precondition(r)
    p, rho = z, float(np.sum(r * z))
    goal = TOLERANCE**2 * rho
    for step in range(STEPS):
        if rho <= goal or rho <= 0:
            return x, step
        a = apply(p)
        curve = float(np.sum(p * a))
        if curve <= 0:  # rounding: no further step improves
            return x, step
        x = x + rho / curve * p
        r = r - rho / curve * a
        z = precondition(r)
        rho, old = float(np.sum(r * z)), rho
        p = z + rho / old * p
    return x, STEPS


def _basis(tangents: Array, cut: _Cut) -> Array:
    """Orthonormal columns of the directions of the fit, shape (W L n_y, p)."""
    flat = cut.stacked(tangents).reshape(-1, tangents.shape[2])
    size = np.linalg.norm(flat, axis=0)
    flat = flat[:, size > 0] / size[size > 0]
    u, s, _ = np.linalg.svd(flat, full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s.max(initial=0.0)])


def _free_of(x: Array, basis: Array | None) -> Array:
    if basis is None or not basis.shape[1]:
        return x
    flat = x.ravel()
    return np.asarray((flat - basis @ (basis.T @ flat)).reshape(x.shape))
