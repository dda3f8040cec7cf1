"""The step of a model with its sensitivities, and the loop over a record in one compiled call.

The step is a CasADi function. With gcc its C code is compiled together with a small loop and
cached by content; without gcc the same function runs in CasADi's virtual machine.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.laws.law import Law, split
from bondgraph.simulation.block_recursion import blocked_record
from bondgraph.simulation.lure import (
    Compiled,
    advance_laws,
    law_arguments,
    law_slices,
    scalar_solution,
    solve_laws,
)
from bondgraph.support.native import build, c_source
from bondgraph.support.ops import CASADI

Array = np.ndarray

MANY_STATES = 32
"""States from which a linear model runs in blocks."""


@dataclass(frozen=True, slots=True)
class KernelLayout:
    """Sizes of a kernel: n_z carried numbers (states, deviations, memory), n_d directions."""

    n_x: int
    n_u: int
    n_w: int
    n_m: int
    n_y: int
    n_q: int
    n_d: int

    @property
    def n_z(self) -> int:
        """Carried numbers."""
        return self.n_x + self.n_w + self.n_m

    @property
    def n_out(self) -> int:
        """Numbers given out a sample: outputs, then the laws' arguments and deviations."""
        return self.n_y + 2 * self.n_w

    @property
    def pieces(self) -> tuple[tuple[int, int], ...]:
        """Shapes of the packed matrices, in order."""
        v = self.n_u + self.n_w
        return (
            (self.n_x, self.n_x),
            (self.n_x, v),
            (self.n_x, v),
            (self.n_w, self.n_x),
            (self.n_w, self.n_u),
            (self.n_w, self.n_w),
            (self.n_y, self.n_x),
            (self.n_y, v),
        )

    @property
    def n_packed(self) -> int:
        """Length of the packed matrices and the step behind them."""
        return sum(r * c for r, c in self.pieces) + 1


def layout(compiled: Compiled, n_d: int) -> KernelLayout:
    """Sizes for `compiled` with `n_d` sensitivity directions."""
    n_m = sum(port.law.n_memory for port in compiled.space.laws)
    n_y = compiled.n_y + len(compiled.observed)
    return KernelLayout(
        compiled.n_x, compiled.n_u, compiled.n_w, n_m, n_y, len(compiled.law_parameters), n_d
    )


def _unpack(m: ca.SX, lay: KernelLayout) -> list[ca.SX]:
    out, at = [], 0
    for r, c in lay.pieces:
        out.append(ca.reshape(m[at : at + r * c], r, c))
        at += r * c
    return out


def step_function(compiled: Compiled, n_d: int) -> ca.Function:
    """One step ``(z, u0, u1, M, q, dM, dq) -> (z+, out)``; columns 1.. are the directions."""
    lay = layout(compiled, n_d)
    z = ca.SX.sym("z", lay.n_z, 1 + n_d)
    u0, u1 = ca.SX.sym("u0", lay.n_u), ca.SX.sym("u1", lay.n_u)
    m, q = ca.SX.sym("M", lay.n_packed), ca.SX.sym("q", lay.n_q)
    dm, dq = ca.SX.sym("dM", lay.n_packed, n_d), ca.SX.sym("dq", lay.n_q, n_d)
    phi, g0, g1, cs, ds, gain, cy, dy = _unpack(m, lay)
    h = m[-1]
    n, k = lay.n_x, lay.n_x + lay.n_w
    x, w0, memory = z[:n, 0], z[n:k, 0], z[k:, 0]
    v0, v1u = ca.vertcat(u0, w0), ca.vertcat(u1, ca.SX.zeros(lay.n_w))
    x_free = phi @ x + g0 @ v0 + g1 @ v1u
    s_free = cs @ x_free + ds @ u1
    p = ca.SX.zeros(len(compiled.parameter_names))
    for position, i in enumerate(compiled.law_parameters):
        p[i] = q[position]
    w1 = solve_laws(compiled, s_free, gain, memory, p, w0, h) if lay.n_w else ca.SX(0, 1)
    late = g1[:, lay.n_u :]
    x1, s1 = x_free + late @ w1, s_free + gain @ w1
    memory1 = advance_laws(compiled, s1, memory, q, h)
    v1 = ca.vertcat(u1, w1)
    out = [ca.vertcat(cy @ x1 + dy @ v1, s1, w1)]
    carried = [ca.vertcat(x1, w1, memory1)]
    partial = _law_partials(compiled, lay, s_free, gain, memory, q, w1, h)
    for d in range(n_d):
        tphi, tg0, tg1, tcs, tds, tgain, tcy, tdy = _unpack(dm[:, d], lay)
        tx, tw0, tm = z[:n, 1 + d], z[n:k, 1 + d], z[k:, 1 + d]
        tv0 = ca.vertcat(ca.SX.zeros(lay.n_u), tw0)
        tx_free = phi @ tx + tphi @ x + g0 @ tv0 + tg0 @ v0 + tg1 @ v1u
        ts_free = cs @ tx_free + tcs @ x_free + tds @ u1
        tw = partial(ts_free, tgain, tm, dq[:, d])
        tx1 = tx_free + late @ tw + tg1[:, lay.n_u :] @ w1
        ts1 = ts_free + gain @ tw + tgain @ w1
        tm1 = _memory_tangent(compiled, s1, memory, q, ts1, tm, dq[:, d], h)
        tv1 = ca.vertcat(ca.SX.zeros(lay.n_u), tw)
        out.append(ca.vertcat(cy @ tx1 + tcy @ x1 + dy @ tv1 + tdy @ v1, ts1, tw))
        carried.append(ca.vertcat(tx1, tw, tm1))
    return ca.Function(
        "bondsight_step",  # plain "step" is a symbol of glibc
        [z, u0, u1, m, q, dm, dq],
        [ca.densify(ca.horzcat(*carried)), ca.densify(ca.horzcat(*out))],
        {"cse": True},
    )


Partial = Callable[[ca.SX, ca.SX, ca.SX, ca.SX], ca.SX]


def _law_partials(
    compiled: Compiled,
    lay: KernelLayout,
    s_free: ca.SX,
    gain: ca.SX,
    memory: ca.SX,
    q: ca.SX,
    w: ca.SX,
    h: ca.SX,
) -> Partial:
    """Total derivative of the closed laws, by the implicit function theorem for Newton laws."""
    if not lay.n_w:
        return lambda ts, tg, tm, tq: ca.SX(0, 1)
    rows = []
    for j, (port, ms, qs) in enumerate(law_slices(compiled)):
        free = s_free[j] + gain[j, :] @ w - gain[j, j] * w[j]
        at = (free, gain[j, j], memory[ms], q[qs], w[j], h)
        rows.append((ms, qs, _one_partial(port, *at)))

    def total(ts: ca.SX, tg: ca.SX, tm: ca.SX, tq: ca.SX) -> ca.SX:
        coupling, right = ca.SX.eye(lay.n_w), []
        for j, (ms, qs, (by_free, by_gain, by_memory, by_q)) in enumerate(rows):
            r = by_free * (ts[j] + tg[j, :] @ w - tg[j, j] * w[j]) + by_gain * tg[j, j]
            if by_memory.numel():
                r = r + by_memory @ tm[ms]
            if by_q.numel():
                r = r + by_q @ tq[qs]
            right.append(r)
            for k in range(lay.n_w):
                if k != j:
                    coupling[j, k] = -by_free * gain[j, k]
        if lay.n_w == 1:
            return right[0]
        return ca.solve(coupling, ca.vertcat(*right))

    return total


def _one_partial(
    port: Any, free: ca.SX, gain: ca.SX, memory: ca.SX, q: ca.SX, w: ca.SX, h: ca.SX
) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    law: Law = port.law
    t, g, step = ca.SX.sym("t"), ca.SX.sym("g"), ca.SX.sym("h")
    mem, par = ca.SX.sym("mem", memory.numel()), ca.SX.sym("par", q.numel())
    if law.closed:
        last = ca.SX.sym("last")
        value = scalar_solution(port, t, g, mem, par, last, step)
        parts = [_jac(value, v) for v in (t, g, mem, par)]
        f = ca.Function("partial", [t, g, mem, par, last, step], parts)
        return tuple(f(free, gain, memory, q, w, h))  # type: ignore[return-value]
    value = ca.SX(law.deviation(CASADI, t, split(mem), law_arguments(law, par, step)))
    f = ca.Function("partial", [t, mem, par, step], [_jac(value, v) for v in (t, mem, par)])
    slope, by_memory, by_q = f(free + gain * w, memory, q, h)
    share = 1 / (1 - gain * slope)
    return slope * share, w * slope * share, by_memory * share, by_q * share


def _jac(value: Any, by: ca.SX) -> ca.SX:
    return ca.densify(ca.jacobian(ca.SX(value), by))


def _memory_tangent(
    compiled: Compiled,
    s: ca.SX,
    memory: ca.SX,
    q: ca.SX,
    ts: ca.SX,
    tm: ca.SX,
    tq: ca.SX,
    h: ca.SX,
) -> ca.SX:
    if not memory.numel():
        return ca.SX(0, 1)
    a, b, c = ca.SX.sym("s", s.numel()), ca.SX.sym("m", memory.numel()), ca.SX.sym("q", q.numel())
    seeds = [ca.SX.sym("d", v.numel()) for v in (a, b, c)]
    step = ca.SX.sym("h")
    new = advance_laws(compiled, a, b, c, step)
    tangent = ca.densify(ca.jtimes(new, ca.vertcat(a, b, c), ca.vertcat(*seeds)))
    f = ca.Function("memory", [a, b, c, *seeds, step], [tangent])
    return f(s, memory, q, ts, tm, tq, h)


# -- running over a record -------------------------------------------------------------------

Runner = Callable[[Array, Array, int, Array, Array, Array, Array], tuple[Array, Array]]

_LOOP = """
void run_record(const double* u, casadi_int n_samples, casadi_int n_sub, casadi_int n_u,
                casadi_int n_z, casadi_int n_out, double* z, const double* m, const double* q,
                const double* dm, const double* dq, double* out,
                casadi_int* iw, double* w, const double** arg, double** res) {
  casadi_int i, j, k;
  double* znew = z + n_z;
  for (i = 0; i < n_samples; ++i) {
    for (j = 0; j < n_sub; ++j) {
      arg[0] = z; arg[1] = u; arg[2] = u + n_u; arg[3] = m; arg[4] = q; arg[5] = dm; arg[6] = dq;
      res[0] = znew; res[1] = out;
      bondsight_step(arg, res, iw, w, 0);
      for (k = 0; k < n_z; ++k) z[k] = znew[k];
      u += 2 * n_u;
    }
    out += n_out;
  }
}
"""


def runner(compiled: Compiled, n_d: int) -> Runner:
    """Return ``run(u, z, n_sub, M, q, dM, dq) -> (out, z)`` for a model with `n_d` directions.

    Shapes: u (n_samples * n_sub, 2, n_u), z (n_z, 1 + n_d), M (n_M,), q (n_q,), dM (n_M, n_d),
    dq (n_q, n_d); out (n_samples, n_out, 1 + n_d).
    """
    return _runner(_Key(compiled, n_d))


class _Key:
    """Structure of a kernel; equal keys share one compiled step."""

    def __init__(self, compiled: Compiled, n_d: int) -> None:
        self.compiled, self.n_d = compiled, n_d
        laws = tuple((port.law.structure, len(port.parameters)) for port in compiled.space.laws)
        self.id = (layout(compiled, n_d), laws)

    def __hash__(self) -> int:
        return hash(self.id)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.id == other.id


@lru_cache(maxsize=256)
def _runner(key: _Key) -> Runner:
    lay = layout(key.compiled, key.n_d)
    if lay.n_x >= MANY_STATES and not lay.n_w and not lay.n_d:
        return _blocked_runner(lay)
    step = step_function(key.compiled, key.n_d)
    library = build(c_source(step) + _LOOP)
    if library is None:
        return _machine_runner(step, lay)
    return _native_runner(library, step, lay)


def _blocked_runner(lay: KernelLayout) -> Runner:
    """Run a large linear model: its unrolled step would take gcc minutes."""

    def run(
        u: Array, z: Array, n_sub: int, m: Array, q: Array, dm: Array, dq: Array
    ) -> tuple[Array, Array]:
        at = np.cumsum([0, *(r * c for r, c in lay.pieces)])
        phi, g0, g1, _, _, _, cy, dy = (
            m[at[i] : at[i + 1]].reshape(shape, order="F") for i, shape in enumerate(lay.pieces)
        )
        v = u.reshape(u.shape[0], 2 * lay.n_u)
        late = np.hstack([np.zeros_like(dy), dy])
        y, x = blocked_record(phi, np.hstack([g0, g1]), cy, late, v, z[:, 0], n_sub)
        return y[:, :, None], x[:, None]

    return run


def _native_runner(library: Path, step: ca.Function, lay: KernelLayout) -> Runner:
    handle = ctypes.CDLL(str(library))
    loop = handle.run_record
    loop.restype = None
    pointer = ctypes.POINTER(ctypes.c_double)
    n_arg, n_res = step.sz_arg(), step.sz_res()

    def run(
        u: Array, z: Array, n_sub: int, m: Array, q: Array, dm: Array, dq: Array
    ) -> tuple[Array, Array]:
        u = np.ascontiguousarray(u, float)
        n_samples = u.shape[0] // n_sub
        width = 1 + lay.n_d
        buffer = np.zeros((2, lay.n_z * width))
        buffer[0] = np.asarray(z, float).ravel(order="F")
        out = np.empty((n_samples, width, lay.n_out))
        columns = [np.asfortranarray(v, dtype=float).ravel(order="F") for v in (m, q, dm, dq)]
        iw = (ctypes.c_longlong * max(step.sz_iw(), 1))()
        w = np.empty(max(step.sz_w(), 1))

        def at(v: Array) -> Any:
            return v.ctypes.data_as(pointer)

        arg, res = (pointer * n_arg)(), (pointer * n_res)()
        sizes = (n_samples, n_sub, lay.n_u, lay.n_z * width, lay.n_out * width)
        loop(
            at(u), *map(ctypes.c_longlong, sizes), at(buffer), *map(at, columns), at(out),
            iw, at(w), arg, res,
        )  # fmt: skip
        return out.transpose(0, 2, 1), buffer[0].reshape(lay.n_z, width, order="F")

    return run


def _machine_runner(step: ca.Function, lay: KernelLayout) -> Runner:
    chunk = 128
    many = step.mapaccum("record", chunk, 1)
    one = step

    def run(
        u: Array, z: Array, n_sub: int, m: Array, q: Array, dm: Array, dq: Array
    ) -> tuple[Array, Array]:
        width = 1 + lay.n_d
        steps = u.shape[0]
        out = np.empty((steps, lay.n_out, width))
        fixed = [ca.DM(v) for v in (m.reshape(-1, 1), q.reshape(-1, 1), dm, dq)]
        wide = [ca.repmat(v, 1, chunk) for v in fixed]
        k = 0
        while k < steps:
            if steps - k >= chunk:
                a, b = u[k : k + chunk, 0].T, u[k : k + chunk, 1].T
                zs, ys = many(z, a, b, *wide)
                z = np.asarray(zs[:, -width:].full())
                out[k : k + chunk] = (
                    np.asarray(ys.full()).reshape(lay.n_out, chunk, width).transpose(1, 0, 2)
                )
                k += chunk
            else:
                zs, y = one(z, u[k, 0], u[k, 1], *fixed)
                z, out[k] = np.asarray(zs.full()), np.asarray(y.full())
                k += 1
        return out[n_sub - 1 :: n_sub], z

    return run
