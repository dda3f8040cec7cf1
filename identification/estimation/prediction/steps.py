"""The filter's steps as CasADi functions: predict, correct, and both for a settled gain.

Carried numbers ``z``: mean (n_x), covariance (lower triangle by columns), deviations (n_w) and
memory (n_m) of the laws, all in scaled units. The memory is the one *before* the arguments of the
present state: it advances at the next prediction, with the filtered argument, and is taken as known
exactly. Numbers that depend on the parameters stand in one vector ``m`` (`Places`).

The covariance follows the exact Jacobian of the step (extended Kalman filter; Jazwinski, Stochastic
Processes and Filtering Theory, 1970); readings are taken in one after the other (white noise,
independent between sensors), in Joseph's form, so that it stays positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from bondgraph.laws.law import split
from bondgraph.simulation.lure import Compiled, advance_laws, law_arguments, law_slices, solve_laws
from bondgraph.support.ops import CASADI
from identification.estimation.prediction.places import Places, places


@dataclass(frozen=True)
class Steps:
    """Functions of the filter; those ending in ``_t`` carry one direction of differentiation.

    ``roots(z, u0, u1, m, elapsed) -> w``, ``predict(z, w, u0, u1, m, elapsed) -> z``,
    ``update(z, y, mask, u, m) -> (z, out, gain)`` with ``out = (reading, innovation, variance)``;
    ``drift(x, u0, u1, m) -> x`` and ``correct(x, gain, y, u, m) -> (x, out)`` for a settled gain.
    """

    places: Places
    linear: bool
    functions: dict[str, ca.Function]


def make_steps(compiled: Compiled, feedthrough: bool) -> Steps:
    """Build the functions; `feedthrough` where a reading contains a law's deviation."""
    at = places(compiled)
    made = [_predict(compiled, at), _update(compiled, at, feedthrough)]
    if at.lay.n_w:
        made.append([_roots(compiled, at)])
    else:
        made.extend([_drift(at), _correct(at)])
    return Steps(at, not at.lay.n_w, {f.name(): f for group in made for f in group})


# -- pieces ----------------------------------------------------------------------------------


def _matrices(m: ca.SX, at: Places) -> list[ca.SX]:
    out, start = [], 0
    for r, c in at.lay.pieces:
        out.append(ca.reshape(m[start : start + r * c], r, c))
        start += r * c
    return out


def _full(packed: ca.SX, n: int) -> ca.SX:
    matrix, k = ca.SX.zeros(n, n), 0
    for j in range(n):
        for i in range(j, n):
            matrix[i, j] = matrix[j, i] = packed[k]
            k += 1
    return matrix


def _packed(matrix: ca.SX) -> ca.SX:
    n = matrix.shape[0]
    entries = [matrix[i, j] for j in range(n) for i in range(j, n)]
    return ca.vertcat(*entries) if entries else ca.SX(0, 1)


def _cut(z: ca.SX, at: Places) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    n, p, w = at.lay.n_x, at.n_p, at.lay.n_w
    return z[:n], z[n : n + p], z[n + p : n + p + w], z[n + p + w :]


def _with_tangent(
    name: str, inputs: list[ca.SX], outputs: list[ca.SX], moving: list[int]
) -> list[ca.Function]:
    """Return the function and one that carries a direction along the `moving` inputs."""
    at = ca.vertcat(*(inputs[i] for i in moving))
    seeds = [ca.SX.sym(f"d{i}", inputs[i].numel()) for i in moving]
    along = ca.vertcat(*seeds)
    tangents = [ca.densify(ca.jtimes(ca.vec(o), at, along)) for o in outputs]
    dense = [ca.densify(o) for o in outputs]
    options = {"cse": True}
    return [
        ca.Function(f"bondsight_{name}", inputs, dense, options),
        ca.Function(f"bondsight_{name}_t", [*inputs, *seeds], tangents, options),
    ]


def _law_numbers(compiled: Compiled, m: ca.SX, at: Places) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Parameters of the laws, the vector `p` that holds them, direct gain and step."""
    q = m[at.laws]
    p = ca.SX.zeros(len(compiled.parameter_names))
    for position, i in enumerate(compiled.law_parameters):
        p[i] = q[position]
    direct = ca.reshape(m[at.direct], at.lay.n_w, at.lay.n_w)
    return q, p, direct, m[at.packed][-1]


def _polished(
    compiled: Compiled,
    free: ca.SX,
    gain: ca.SX,
    memory: ca.SX,
    q: ca.SX,
    guess: ca.SX,
    step: Any,
) -> ca.SX:
    """Deviations near `guess`, already a solution, as functions with exact derivatives.

    Two Newton steps from a constant: the first gives the first derivatives of the implicit
    function, the second the second ones, which the derivatives of the filter's Jacobian need.
    """
    n = len(compiled.space.laws)
    w = ca.SX.sym("w", n)
    mapped = []
    for j, (port, ms, qs) in enumerate(law_slices(compiled)):
        arguments = law_arguments(port.law, q[qs], step)
        others = free[j] + sum(gain[j, k] * w[k] for k in range(n) if k != j)
        if port.law.closed:
            value = port.law.solve(others, gain[j, j], split(memory[ms]), arguments, guess[j])
        else:
            s = others + gain[j, j] * w[j]
            value = port.law.deviation(CASADI, s, split(memory[ms]), arguments)
        mapped.append(ca.SX(value))
    right = ca.vertcat(*mapped)
    slope = ca.SX.eye(n) - ca.jacobian(right, w)
    missing = w - right
    move = missing / slope if n == 1 else ca.solve(slope, missing)
    once = ca.substitute(w - move, w, guess)
    return ca.substitute(w - move, w, once)


def _kept(compiled: Compiled, made: ca.SX, carried: ca.SX) -> ca.SX:
    """Laws that jump keep their carried value: they act with the end value of a step only."""
    ports = compiled.space.laws
    values = [carried[j] if port.law.set_valued else made[j] for j, port in enumerate(ports)]
    return ca.vertcat(*values) if values else ca.SX(0, 1)


# -- the steps -------------------------------------------------------------------------------


def _symbols(at: Places) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
    z, m = ca.SX.sym("z", at.n_z), ca.SX.sym("m", at.n_m)
    u0, u1 = ca.SX.sym("u0", at.lay.n_u), ca.SX.sym("u1", at.lay.n_u)
    return z, m, u0, u1, ca.SX.sym("elapsed")


def _accepted(
    compiled: Compiled, z: ca.SX, u0: ca.SX, m: ca.SX, elapsed: ca.SX, at: Places
) -> ca.SX:
    x, _, w, memory = _cut(z, at)
    q, _, direct, _ = _law_numbers(compiled, m, at)
    cs, ds = _matrices(m, at)[3:5]
    return advance_laws(compiled, cs @ x + ds @ u0 + direct @ w, memory, q, elapsed)


def _roots(compiled: Compiled, at: Places) -> ca.Function:
    z, m, u0, u1, elapsed = _symbols(at)
    x, _, w, _ = _cut(z, at)
    _, p, direct, h = _law_numbers(compiled, m, at)
    phi, g0, g1, cs, ds, gain, _, _ = _matrices(m, at)
    memory = _accepted(compiled, z, u0, m, elapsed, at)
    w0 = _kept(compiled, solve_laws(compiled, cs @ x + ds @ u0, direct, memory, p, w, 0.0), w)
    free = phi @ x + g0 @ ca.vertcat(u0, w0) + g1[:, : at.lay.n_u] @ u1
    w1 = solve_laws(compiled, cs @ free + ds @ u1, gain, memory, p, w0, h)
    both = ca.densify(ca.vertcat(w0, w1))
    return ca.Function("bondsight_roots", [z, u0, u1, m, elapsed], [both], {"cse": True})


def _predict(compiled: Compiled, at: Places) -> list[ca.Function]:
    z, m, u0, u1, elapsed = _symbols(at)
    n_w, n_x = at.lay.n_w, at.lay.n_x
    roots = ca.SX.sym("w", 2 * n_w)
    x, packed, w, _ = _cut(z, at)
    phi, g0, g1, cs, ds, gain, _, _ = _matrices(m, at)
    q, _, direct, h = _law_numbers(compiled, m, at)
    memory = _accepted(compiled, z, u0, m, elapsed, at)
    # the state's own symbol, so that the Jacobian leaves out what the memory takes from it
    xs, ms = ca.SX.sym("xs", n_x), ca.SX.sym("ms", memory.numel())
    w0 = w1 = ca.SX(0, 1)
    if n_w:
        args = (compiled, cs @ xs + ds @ u0, direct, ms, q, roots[:n_w], 0.0)
        w0 = _kept(compiled, _polished(*args), w)
    x1 = phi @ xs + g0 @ ca.vertcat(u0, w0) + g1[:, : at.lay.n_u] @ u1
    if n_w:
        w1 = _polished(compiled, cs @ x1 + ds @ u1, gain, ms, q, roots[n_w:], h)
        x1 = x1 + g1[:, at.lay.n_u :] @ w1
    f = ca.jacobian(x1, xs) if n_w else phi
    before, after = ca.vertcat(xs, ms), ca.vertcat(x, memory)
    x1, w1, f = ca.substitute([x1, w1, f], [before], [after])
    covariance = f @ _full(packed, n_x) @ f.T + _full(m[at.added], n_x)
    new = ca.vertcat(x1, _packed(covariance), w1, memory)
    return _with_tangent("predict", [z, roots, u0, u1, m, elapsed], [new], [0, 4])


def _update(compiled: Compiled, at: Places, feedthrough: bool) -> list[ca.Function]:
    z, m, _, u, _ = _symbols(at)
    n_y = at.lay.n_y
    y, mask = ca.SX.sym("y", n_y), ca.SX.sym("mask", n_y)
    x0, packed, w, memory = _cut(z, at)
    cy, dy = _matrices(m, at)[6:]
    reading = cy @ x0 + dy @ ca.vertcat(u, w) + m[at.offset]
    c = cy + _through_laws(compiled, at, z, u, m) if feedthrough else cy
    x, p = x0, _full(packed, at.lay.n_x)
    innovations, variances, gains = [], [], []
    for j in range(n_y):
        row, r = c[j, :], m[at.noise][j]
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
    gain = ca.vertcat(*gains) if gains else ca.SX(0, 1)
    new = ca.vertcat(x, _packed(p), w, memory)
    return _with_tangent("update", [z, y, mask, u, m], [new, out, gain], [0, 4])


def _through_laws(compiled: Compiled, at: Places, z: ca.SX, u: ca.SX, m: ca.SX) -> ca.SX:
    """How readings follow the state through the slopes of the laws; a jump has none."""
    x, _, w, memory = _cut(z, at)
    q, _, direct, h = _law_numbers(compiled, m, at)
    cs, ds = _matrices(m, at)[3:5]
    dyw = _matrices(m, at)[7][:, at.lay.n_u :]
    s = ca.SX.sym("s", at.lay.n_w)
    slopes = []
    for j, (port, ms, qs) in enumerate(law_slices(compiled)):
        arguments = law_arguments(port.law, q[qs], h)
        value = ca.SX(port.law.deviation(CASADI, s[j], split(memory[ms]), arguments))
        slopes.append(ca.SX(0) if port.law.set_valued else ca.jacobian(value, s[j]))
    slope = ca.diag(ca.substitute(ca.vertcat(*slopes), s, cs @ x + ds @ u + direct @ w))
    return dyw @ slope @ ca.solve(ca.SX.eye(at.lay.n_w) - direct @ slope, cs)


def _drift(at: Places) -> list[ca.Function]:
    _, m, u0, u1, _ = _symbols(at)
    x = ca.SX.sym("x", at.lay.n_x)
    phi, g0, g1 = _matrices(m, at)[:3]
    return _with_tangent("drift", [x, u0, u1, m], [phi @ x + g0 @ u0 + g1 @ u1], [0, 3])


def _correct(at: Places) -> list[ca.Function]:
    _, m, _, u, _ = _symbols(at)
    n, n_y = at.lay.n_x, at.lay.n_y
    x0, gain, y = ca.SX.sym("x", n), ca.SX.sym("gain", n * n_y), ca.SX.sym("y", n_y)
    cy, dy = _matrices(m, at)[6:]
    reading = cy @ x0 + dy @ u + m[at.offset]
    x, innovations = x0, []
    for j in range(n_y):
        e = y[j] - reading[j] - cy[j, :] @ (x - x0)
        x = x + gain[j * n : (j + 1) * n] * e
        innovations.append(e)
    out = ca.vertcat(reading, *innovations)
    return _with_tangent("correct", [x0, gain, y, u, m], [x, out], [0, 1, 4])
