"""A record of a large linear model in blocks: dense products instead of one step after another.

With ``v = [u0; u1]``, ``G = [G0 G1]`` and ``H_i = C Phi^i`` a block of L steps from x is
``y_j = H_j x + sum(H_(j-1-i) G v_i) + D u_j`` and ``x+ = Phi^L x + sum(Phi^(L-1-i) G v_i)``:
every output of the block is one product. The powers come by doubling. The answers are those of the
steps; the work a sample falls from ``n_x^2`` to ``n_x^2 / L``, and nothing has to be compiled.
"""

from __future__ import annotations

import numpy as np

from bondgraph.support.arrays import Array

LONGEST = 64
"""Steps of a block."""


def blocked_record(
    phi: Array, g: Array, c: Array, d: Array, v: Array, x: Array, stride: int = 1
) -> tuple[Array, Array]:
    """Run ``x+ = phi x + g v``, ``y = c x+ + d v`` over all `v`.

    Parameters
    ----------
    phi : ndarray, shape (n_x, n_x)
    g : ndarray, shape (n_x, n_v)
    c : ndarray, shape (n_y, n_x)
    d : ndarray, shape (n_y, n_v)
    v : ndarray, shape (n, n_v)
        What acts during each step.
    x : ndarray, shape (n_x,)
        State before the first step.
    stride : int
        Outputs are kept after every `stride` steps.

    Returns
    -------
    y : ndarray, shape (n // stride, n_y)
    x : ndarray, shape (n_x,)
        State after the last step.

    Examples
    --------
    >>> import numpy as np
    >>> one = np.eye(1)
    >>> y, x = blocked_record(0.5 * one, one, one, 0 * one, np.ones((3, 1)), np.zeros(1))
    >>> y[:, 0].tolist(), x.tolist()
    ([1.0, 1.5, 1.75], [1.75])
    """
    n, n_v = v.shape
    n_x, n_y = phi.shape[0], c.shape[0]
    powers = _powers(phi, n)
    length = 2 ** (len(powers) - 1)
    whole = n // length
    pushes = _pushed(powers, g)
    blocks = v[: whole * length].reshape(whole, length * n_v)
    into = pushes[::-1].transpose(1, 0, 2).reshape(n_x, length * n_v)
    starts = blocks @ into.T
    for k in range(whole):
        starts[k], x = x, powers[-1] @ x + starts[k]
    inside = starts @ _observed(powers, c).T + blocks @ _forced(pushes, c).T
    y = np.empty((n, n_y))
    y[: whole * length] = inside.reshape(whole * length, n_y)
    for k in range(whole * length, n):
        x = phi @ x + g @ v[k]
        y[k] = c @ x
    y += v @ d.T
    return y[stride - 1 :: stride], x


def _powers(phi: Array, n: int) -> list[Array]:
    """Return ``phi^1, phi^2, phi^4, ..`` up to a block that is worth its preparation."""
    powers = [phi]
    while 2 ** (len(powers) - 1) < LONGEST and 2 ** (len(powers) + 2) <= n:
        powers.append(powers[-1] @ powers[-1])
    return powers


def _pushed(powers: list[Array], g: Array) -> Array:
    """Return ``phi^i g`` for i < L, shape (L, n_x, n_v)."""
    n_x, n_v = g.shape
    found = g[None]
    for power in powers[:-1]:
        flat = found.transpose(1, 0, 2).reshape(n_x, -1)
        found = np.concatenate([found, (power @ flat).reshape(n_x, -1, n_v).transpose(1, 0, 2)])
    return found


def _observed(powers: list[Array], c: Array) -> Array:
    """Return ``c phi^i`` for i = 1 .. L, one below the other, shape (L * n_y, n_x)."""
    found = np.asarray(c @ powers[0])
    for power in powers[:-1]:
        found = np.concatenate([found, found @ power])
    return found


def _forced(pushes: Array, c: Array) -> Array:
    """Return what the inputs of a block do to its outputs, shape (L * n_y, L * n_v)."""
    length, _, n_v = pushes.shape
    response = np.einsum("yx,lxv->lyv", c, pushes)
    forced = np.zeros((length, c.shape[0], length, n_v))
    for i in range(length):
        forced[i:, :, i] = response[: length - i]
    return forced.reshape(length * c.shape[0], length * n_v)
