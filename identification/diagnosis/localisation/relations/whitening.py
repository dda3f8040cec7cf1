"""Filters that are blind to a latent signal: the readings less what the signal explains.

A latent signal of unknown course is noise of a very large variance at its port. The innovations of
the stationary Kalman filter of ``y = G w + e`` have ``sum |eps|^2 = r' (1 + lambda^2 G G')^-1 r``:
the residual projected on what no course of `w` can produce, without periods, tapers or leakage,
and blind to the state at the start (Anderson and Moore, Optimal Filtering, 1979, section 9.3;
Chow and Willsky, IEEE TAC 29 (1984) 603, for parity relations).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.relations.latent import Sampled

DOUBLINGS = 40
DRIFTS = (1e-9, 1e-7, 1e-5)
"""Variances of a state's own drift, for modes at the unit circle that the latent signal leaves."""
CONDITION = 1e7
GROWN = 1e15
"""Growth at which a model is taken to run away."""
NEXT, LATER = 64, 12
"""Samples, and doublings after them, over which the reach of a state is followed."""
MEMORY = 4096
"""Samples over which the expected size of filtered noise is summed."""


@dataclass(frozen=True, eq=False)
class Blind:
    """Predictor ``x+ = a x + k r`` and innovations ``root^-1 (r - c x)``.

    Blocks of readings have the shape (n_y, m, N): channels, columns, samples.

    Attributes
    ----------
    a, k, c : ndarray, shapes (n, n), (n, n_y), (n_y, n)
    root : ndarray, shape (n_y, n_y)
        Lower Cholesky factor of the innovations' covariance.
    reach : ndarray, shape (n,)
        Units of the states, of those of the model it was made from.
    """

    a: Array
    k: Array
    c: Array
    root: Array
    reach: Array

    def __call__(self, block: Array) -> Array:
        """Innovations of columns of readings, (n_y, m, N) -> (n_y, m, N)."""
        flat = block.reshape(block.shape[0], -1)
        made = self._inverse_root @ flat
        if self.a.size:
            made -= self._predicted(self.k, block).reshape(flat.shape)
        return np.asarray(made.reshape(block.shape))

    def starts(self, n: int) -> Array:
        """Innovations of a unit of each state at the start, shape (n_y, n, N)."""
        pulse = np.zeros((self.a.shape[0], self.a.shape[0], n + 1))
        pulse[:, :, 0] = np.eye(self.a.shape[0])
        return -self._predicted(np.eye(self.a.shape[0]), pulse)[:, :, 1:]

    def basis(self, n: int) -> Array:
        """Orthonormal rows of what any state at the start does to a stretch, shape (k, n_y n)."""
        if not self.states:
            return np.zeros((0, n * self.c.shape[0]))
        if n not in self._bases:
            starts = self.starts(n).transpose(1, 0, 2).reshape(self.states, -1)
            size = np.linalg.norm(starts, axis=1)
            starts = starts[size > 0] / size[size > 0, None]
            if starts.size:
                s, u = np.linalg.eigh(starts @ starts.T)
                sound = s > 1e-10 * s[-1]
                starts = (u[:, sound] / np.sqrt(s[sound])).T @ starts
            self._bases[n] = starts
        return self._bases[n]

    @cached_property
    def _bases(self) -> dict[int, Array]:
        return {}

    @property
    def states(self) -> int:
        """Number of states that a stretch starts from."""
        return int(self.a.shape[0])

    @cached_property
    def kept(self) -> float:
        """Expected sum of squares a sample of unit white readings (Parseval)."""
        n_y = self.c.shape[0]
        pulse = np.zeros((n_y, n_y, MEMORY))
        pulse[:, :, 0] = np.eye(n_y)
        return float(np.sum(self(pulse) ** 2))

    @cached_property
    def _inverse_root(self) -> Array:
        return np.asarray(solve_triangular(self.root, np.eye(self.root.shape[0]), lower=True))

    @cached_property
    def _modes(self) -> tuple[Array, Array, Array] | None:
        """Eigenvalues, what they do to the innovations, how they are driven; None if unsound."""
        values, vectors = np.linalg.eig(self.a)
        if np.linalg.cond(vectors) > CONDITION:
            return None
        picked = values.imag >= 0  # conjugates count twice
        weight = np.where(values.imag > 0, 2.0, 1.0)
        out = self._inverse_root @ self.c @ vectors * weight
        return values[picked], out[:, picked], np.linalg.inv(vectors)[picked]

    def _predicted(self, drive: Array, block: Array) -> Array:
        """``root^-1 c x`` with ``x(t+1) = a x(t) + drive @ block(t)`` from zero."""
        from scipy.signal import lfilter

        n_in, m, n = block.shape
        flat = block.reshape(n_in, -1)
        if self._modes is None:
            x = scan(self.a, (drive @ flat).reshape(-1, m, n))
            seen = self._inverse_root @ self.c @ x.reshape(self.a.shape[0], -1)
            return np.asarray(seen.reshape(-1, m, n))
        values, out, by = self._modes
        into = by @ drive
        driven = (np.concatenate([into.real, into.imag]) @ flat).reshape(2, values.size, m, n)
        # a mode that swings has two rows: what is seen of its real part, and of its imaginary one
        swings = np.flatnonzero(values.imag)
        rows = np.empty((values.size + swings.size, m, n))
        for i, v in enumerate(values):
            shifted = [0.0, 1.0]
            if v.imag:
                z = lfilter(shifted, [1.0, -v], driven[0, i] + 1j * driven[1, i], axis=1)
                rows[i], rows[values.size + np.searchsorted(swings, i)] = z.real, z.imag
            else:
                rows[i] = lfilter(shifted, [1.0, -v.real], driven[0, i], axis=1)
        seen = np.concatenate([out.real, -out.imag[:, swings]], axis=1)
        return np.asarray((seen @ rows.reshape(rows.shape[0], -1)).reshape(-1, m, n))


def scan(a: Array, drive: Array) -> Array:
    """Return the recursion by doubling: sums over ever longer stretches, for any stable matrix."""
    x = np.zeros_like(drive)
    x[..., 1:] = drive[..., :-1]
    power, step = a, 1
    while step < x.shape[-1] and np.abs(power).max() > 1e-18:
        later = x.copy()
        later[..., step:] += np.einsum("ij,jmn->imn", power, x[..., :-step])
        x, power, step = later, power @ power, 2 * step
    return x


def blind_filter(model: Sampled, size: Array) -> Blind:
    """Filter that is blind to latent signals of standard deviation `size`, shape (k,).

    Raises
    ------
    LinAlgError
        No stable filter was found: model and floor are too far apart for the arithmetic.
    """
    n, k = model.gamma.shape
    # states in units of what they reach: arithmetic and drift are the same for all
    reach = _reach(model.phi, model.c)
    reach = np.where(reach > 0, reach, 1.0)
    a = np.zeros((n + k, n + k))
    a[:n, :n] = model.phi * reach[:, None] / reach
    a[:n, n:] = model.gamma * size * reach[:, None]
    c = np.hstack([model.c / reach, model.d * size])
    for drift in DRIFTS:  # more where a mode at the unit circle asks for it
        p = _riccati(a, c, np.diag(np.concatenate([np.full(n, drift), np.ones(k)])))
        s = c @ p @ c.T + np.eye(c.shape[0])
        gain = np.linalg.solve(s, c @ p @ a.T).T
        closed = (a - gain @ c)[:n, :n]
        if np.isfinite(closed).all() and np.abs(np.linalg.eigvals(closed)).max(initial=0.0) < 1:
            break
    else:
        raise np.linalg.LinAlgError("the blind filter is not stable")
    # the latent sample itself cannot be predicted: its state stays zero and is left out
    return Blind(closed, gain[:n], c[:, :n], np.linalg.cholesky(0.5 * (s + s.T)), reach)


def _reach(phi: Array, c: Array) -> Array:
    """Most that a unit of each state ever moves a reading, shape (n,).

    A state may move nothing at once and much later on: its own drift must stay small all the way.
    """
    most, power = np.abs(c).max(axis=0, initial=0.0), c
    limit = GROWN * most.max(initial=0.0)
    jump, jumps = phi, 0
    while jumps < NEXT + LATER:
        if jumps >= NEXT:
            jump = jump @ jump
        power, jumps = power @ jump, jumps + 1
        if not np.abs(power).max(initial=0.0) < limit:
            break  # a model that runs away
        most = np.maximum(most, np.abs(power).max(axis=0, initial=0.0))
    return np.asarray(most)


def _riccati(a: Array, c: Array, q: Array) -> Array:
    """Predicted covariance of the stationary filter, unit noise, by structured doubling.

    Chu, Fan, Lin and Wang, Int. J. Control 77 (2004) 767.
    """
    forward, g, h = a.T.copy(), c.T @ c, q.copy()
    eye = np.eye(a.shape[0])
    for _ in range(DOUBLINGS):
        left = np.linalg.solve(eye + g @ h, np.hstack([forward, g @ forward.T]))
        one, two = left[:, : a.shape[0]], left[:, a.shape[0] :]
        change = forward.T @ h @ one
        g = g + forward @ two
        forward = forward @ one
        h = h + 0.5 * (change + change.T)
        g = 0.5 * (g + g.T)
        if np.abs(change).max() <= 1e-13 * np.abs(h).max():
            break
    return np.asarray(h)
