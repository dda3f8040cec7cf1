"""How readings correct a predicted state, one after the other; the same for every model."""

from __future__ import annotations

from typing import Any

import casadi as ca

Symbol = Any
"""SX or MX of CasADi: scalar expressions, or those of matrices."""


def _place(i: int, j: int, n: int) -> int:
    """Position of an entry in a packed lower triangle, by columns."""
    i, j = max(i, j), min(i, j)
    return j * n - j * (j - 1) // 2 + i - j


def full(packed: Symbol, n: int) -> Symbol:
    """Return the symmetric matrix of a packed lower triangle."""
    return ca.reshape(packed[[_place(i, j, n) for j in range(n) for i in range(n)]], n, n)


def packed(matrix: Symbol) -> Symbol:
    """Return the lower triangle of a matrix by columns."""
    n = int(matrix.size1())
    column: Symbol = ca.vec(matrix)
    return column[[i + j * n for j in range(n) for i in range(j, n)]]


def with_tangent(
    name: str, inputs: list[Symbol], outputs: list[Symbol], moving: list[int]
) -> list[ca.Function]:
    """Return the function and one that carries a direction along the `moving` inputs."""
    seeds = [type(inputs[i]).sym(f"d{i}", inputs[i].numel()) for i in moving]
    dense = [ca.densify(o) for o in outputs]
    (found,) = ca.forward(dense, [inputs[i] for i in moving], [seeds])
    tangents = [ca.densify(t) for t in found]
    options = {"cse": True}
    return [
        ca.Function(f"bondsight_{name}", inputs, dense, options),
        ca.Function(f"bondsight_{name}_t", [*inputs, *seeds], tangents, options),
    ]


def corrected(
    z: Symbol, u: Symbol, m: Symbol, x0: Symbol, p: Symbol, reading: Symbol, c: Symbol, rest: Symbol
) -> list[ca.Function]:
    """Return the function ``update`` of `FilterSteps` and its tangent.

    Parameters
    ----------
    z, u, m : arguments
    x0, p : predicted state and its covariance
    reading, c : what the sensors read there, without their offsets, and its slope by the state
    rest : what else of z is carried on
    """
    kind, n_y = type(z), reading.numel()
    y, mask = kind.sym("y", n_y), kind.sym("mask", n_y)
    noise, offset = m[-2 * n_y : -n_y], m[-n_y:]
    reading, x = reading + offset, x0
    innovations, variances, gains = [], [], []
    for j in range(n_y):
        row, r = c[j, :], noise[j]
        ph = p @ row.T
        s = row @ ph + r
        e = y[j] - reading[j] - row @ (x - x0)
        k = mask[j] * ph / s
        x = x + k * e
        a = p - k @ ph.T
        p = a - (a @ row.T) @ k.T + r * (k @ k.T)
        innovations.append(e)
        variances.append(s)
        gains.append(k)
    out = ca.vertcat(reading, *innovations, *variances)
    new = ca.vertcat(x, packed(p), rest)
    return with_tangent("update", [z, y, mask, u, m], [new, out, ca.vertcat(*gains)], [0, 4])
