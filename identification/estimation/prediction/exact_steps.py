"""The filter's steps for models linear up to scalar laws: predict, correct, both settled.

The memory carried is the one *before* the arguments of the present state: it advances at the next
prediction, with the filtered argument, and is taken as known exactly.

The covariance follows the exact Jacobian of the step (extended Kalman filter; Jazwinski, Stochastic
Processes and Filtering Theory, 1970); readings are taken in one after the other (white noise,
independent between sensors), in Joseph's form, so that it stays positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.laws.law import split
from bondgraph.simulation.lure import Compiled, advance_laws, law_arguments, law_slices, solve_laws
from bondgraph.simulation.lure_kernel import unpack
from bondgraph.simulation.lure_layout import KernelLayout, layout
from bondgraph.support.arrays import Array
from bondgraph.support.ops import CASADI
from identification.estimation.prediction.correction import corrected, full, packed, with_tangent
from identification.estimation.prediction.plant import FilterSteps, packed_size


@dataclass(frozen=True, slots=True)
class ExactPlaces:
    """Where each piece stands in the vector ``m``.

    Attributes
    ----------
    packed : slice
        Matrices of a step as `discretise` packs them, its length behind them.
    direct : slice
        How deviations act on the laws' arguments at once, (n_w, n_w).
    added : slice
        Covariance added over a step, packed.
    laws : slice
        Parameters of the laws.
    """

    lay: KernelLayout
    packed: slice
    direct: slice
    added: slice
    laws: slice

    @classmethod
    def of(cls, compiled: Compiled) -> ExactPlaces:
        """Places for `compiled`."""
        lay = layout(compiled, 0)
        lengths = (lay.n_packed, lay.n_w**2, packed_size(lay.n_x), lay.n_q)
        ends = accumulate(lengths)
        return cls(lay, *(slice(end - n, end) for end, n in zip(ends, lengths, strict=True)))

    @property
    def size(self) -> int:
        """Length of all of it."""
        return int(self.laws.stop)

    def piece(self, i: int) -> slice:
        """Return where matrix `i` stands among those packed."""
        ends = [0, *accumulate(r * c for r, c in self.lay.pieces)]
        return slice(ends[i], ends[i + 1])

    def factors(self, x: Array, y: Array) -> Array:
        """Change of units of the packed matrices to those of states `x` and readings `y`."""
        v, n_w = self.lay.n_u + self.lay.n_w, self.lay.n_w
        grids = (
            x[None, :] / x[:, None],
            np.repeat(1 / x[:, None], v, axis=1),
            np.repeat(1 / x[:, None], v, axis=1),
            np.repeat(x[None, :], n_w, axis=0),
            np.ones((n_w, self.lay.n_u)),
            np.ones((n_w, n_w)),
            x[None, :] / y[:, None],
            np.repeat(1 / y[:, None], v, axis=1),
            np.ones((1, 1)),
        )
        return np.concatenate([g.ravel(order="F") for g in grids])


def exact_steps(compiled: Compiled, feedthrough: bool) -> FilterSteps:
    """Build the functions; `feedthrough` where a reading contains a law's deviation."""
    at = ExactPlaces.of(compiled)
    made = [_predict(compiled, at), _update(compiled, at, feedthrough)]
    made += [[_roots(compiled, at)]] if at.lay.n_w else [_drift(at), _correct(at)]
    lay = at.lay
    return FilterSteps(
        lay.n_x, lay.n_u, lay.n_y, 2 * lay.n_w, _n_z(at), _n_m(at), at.packed.stop - 1,
        {f.name(): f for group in made for f in group},
    )  # fmt: skip


def _n_z(at: ExactPlaces) -> int:
    return at.lay.n_x + packed_size(at.lay.n_x) + at.lay.n_w + at.lay.n_m


def _n_m(at: ExactPlaces) -> int:
    return at.size + 2 * at.lay.n_y


# -- pieces ----------------------------------------------------------------------------------


def _cut(z: ca.SX, at: ExactPlaces) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    n, p, w = at.lay.n_x, packed_size(at.lay.n_x), at.lay.n_w
    return z[:n], z[n : n + p], z[n + p : n + p + w], z[n + p + w :]


def _law_numbers(m: ca.SX, at: ExactPlaces) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Parameters of the laws, direct gain and step."""
    direct = ca.reshape(m[at.direct], at.lay.n_w, at.lay.n_w)
    return m[at.laws], direct, m[at.packed][-1]


def _polished(
    compiled: Compiled, free: ca.SX, gain: ca.SX, memory: ca.SX, q: ca.SX, guess: ca.SX, step: Any
) -> ca.SX:
    """Deviations near `guess`, already a solution, as functions with exact derivatives.

    Two Newton steps from a constant: the first gives the first derivatives of the implicit
    function, the second the second ones, which the derivatives of the filter's Jacobian need.
    """
    n = len(compiled.laws)
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
    ports = compiled.laws
    values = [carried[j] if port.law.set_valued else made[j] for j, port in enumerate(ports)]
    return ca.vertcat(*values) if values else ca.SX(0, 1)


# -- the steps -------------------------------------------------------------------------------


def _symbols(at: ExactPlaces) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
    z, m = ca.SX.sym("z", _n_z(at)), ca.SX.sym("m", _n_m(at))
    u0, u1 = ca.SX.sym("u0", at.lay.n_u), ca.SX.sym("u1", at.lay.n_u)
    return z, m, u0, u1, ca.SX.sym("elapsed")


def _accepted(
    compiled: Compiled, z: ca.SX, u0: ca.SX, m: ca.SX, elapsed: ca.SX, at: ExactPlaces
) -> ca.SX:
    x, _, w, memory = _cut(z, at)
    q, direct, _ = _law_numbers(m, at)
    cs, ds = unpack(m, at.lay)[3:5]
    return advance_laws(compiled, cs @ x + ds @ u0 + direct @ w, memory, q, elapsed)


def _roots(compiled: Compiled, at: ExactPlaces) -> ca.Function:
    z, m, u0, u1, elapsed = _symbols(at)
    x, _, w, _ = _cut(z, at)
    q, direct, h = _law_numbers(m, at)
    phi, g0, g1, cs, ds, gain, _, _ = unpack(m, at.lay)
    memory = _accepted(compiled, z, u0, m, elapsed, at)
    w0 = _kept(compiled, solve_laws(compiled, cs @ x + ds @ u0, direct, memory, q, w, 0.0), w)
    free = phi @ x + g0 @ ca.vertcat(u0, w0) + g1[:, : at.lay.n_u] @ u1
    w1 = solve_laws(compiled, cs @ free + ds @ u1, gain, memory, q, w0, h)
    both = ca.densify(ca.vertcat(w0, w1))
    return ca.Function("bondsight_roots", [z, u0, u1, m, elapsed], [both], {"cse": True})


def _predict(compiled: Compiled, at: ExactPlaces) -> list[ca.Function]:
    z, m, u0, u1, elapsed = _symbols(at)
    n_w, n_x = at.lay.n_w, at.lay.n_x
    roots = ca.SX.sym("w", 2 * n_w)
    x, covariance, w, _ = _cut(z, at)
    phi, g0, g1, cs, ds, gain, _, _ = unpack(m, at.lay)
    q, direct, h = _law_numbers(m, at)
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
    added = f @ full(covariance, n_x) @ f.T + full(m[at.added], n_x)
    new = ca.vertcat(x1, packed(added), w1, memory)
    return with_tangent("predict", [z, roots, u0, u1, m, elapsed], [new], [0, 4])


def _update(compiled: Compiled, at: ExactPlaces, feedthrough: bool) -> list[ca.Function]:
    z, m, _, u, _ = _symbols(at)
    x, covariance, w, memory = _cut(z, at)
    cy, dy = unpack(m, at.lay)[6:]
    reading = cy @ x + dy @ ca.vertcat(u, w)
    c = cy + _through_laws(compiled, at, z, u, m) if feedthrough else cy
    return corrected(z, u, m, x, full(covariance, at.lay.n_x), reading, c, ca.vertcat(w, memory))


def _through_laws(compiled: Compiled, at: ExactPlaces, z: ca.SX, u: ca.SX, m: ca.SX) -> ca.SX:
    """How readings follow the state through the slopes of the laws; a level has none."""
    x, _, w, memory = _cut(z, at)
    q, direct, h = _law_numbers(m, at)
    cs, ds = unpack(m, at.lay)[3:5]
    dyw = unpack(m, at.lay)[7][:, at.lay.n_u :]
    s = ca.SX.sym("s", at.lay.n_w)
    slopes = []
    for j, (port, ms, qs) in enumerate(law_slices(compiled)):
        arguments = law_arguments(port.law, q[qs], h)
        value = ca.SX(port.law.deviation(CASADI, s[j], split(memory[ms]), arguments))
        slopes.append(ca.jacobian(value, s[j]))
    slope = ca.diag(ca.substitute(ca.vertcat(*slopes), s, cs @ x + ds @ u + direct @ w))
    return dyw @ slope @ ca.solve(ca.SX.eye(at.lay.n_w) - direct @ slope, cs)


def _drift(at: ExactPlaces) -> list[ca.Function]:
    _, m, u0, u1, _ = _symbols(at)
    x = ca.SX.sym("x", at.lay.n_x)
    phi, g0, g1 = unpack(m, at.lay)[:3]
    return with_tangent("drift", [x, u0, u1, m], [phi @ x + g0 @ u0 + g1 @ u1], [0, 3])


def _correct(at: ExactPlaces) -> list[ca.Function]:
    _, m, _, u, _ = _symbols(at)
    n, n_y = at.lay.n_x, at.lay.n_y
    x0, gain, y = ca.SX.sym("x", n), ca.SX.sym("gain", n * n_y), ca.SX.sym("y", n_y)
    cy, dy = unpack(m, at.lay)[6:]
    reading = cy @ x0 + dy @ u + m[at.size + n_y :]
    x, innovations = x0, []
    for j in range(n_y):
        e = y[j] - reading[j] - cy[j, :] @ (x - x0)
        x = x + gain[j * n : (j + 1) * n] * e
        innovations.append(e)
    out = ca.vertcat(reading, *innovations)
    return with_tangent("correct", [x0, gain, y, u, m], [x, out], [0, 1, 4])
