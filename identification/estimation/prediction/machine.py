"""The filter without a compiler: the same functions, mapped over the record by CasADi.

Slower than the compiled loop, because every direction runs through the whole record and the gain of
a linear model is computed at every sample.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.prediction.steps import Steps


def run_in_machine(
    steps: Steps, u: Array, y: Array, mask: Array, n_sub: int,
    z: Array, dz: Array, m: Array, dm: Array, m0: Array, dm0: Array,
) -> tuple[Any, ...]:  # fmt: skip
    """Run the filter; arguments and result as those of the compiled loop."""
    lay, n, n_d = steps.places.lay, y.shape[0], dm.shape[1]
    sample, tangent = _sample(steps, 1), _sample_tangent(steps, 1)
    h = m[steps.places.packed.stop - 1]
    zs, outs = np.empty((n + 1, z.size)), np.empty((n, 3 * lay.n_y))
    zs[0] = z
    start = u[n_sub - 1, 1]
    first = (np.r_[start, start], 0.0, y[0], mask[0], m0, m)
    zs[1], outs[0] = (np.asarray(v).ravel() for v in sample(z, *first))
    tangents = np.empty((n, n_d, 2 * lay.n_y))
    seeds = np.empty((n_d, z.size))
    for d in range(n_d):
        moved, t = tangent(z, *first, dz[:, d], dm0[:, d], dm[:, d])
        seeds[d], tangents[0, d] = np.asarray(moved).ravel(), np.asarray(t).ravel()
    if n > 1:
        ends = u[n_sub:].reshape(n - 1, n_sub * 2 * lay.n_u).T
        elapsed = np.full((n_sub, n - 1), h)
        elapsed[0, 0] = 0.0
        many = [ca.DM(v) for v in (ends, elapsed, y[1:].T, mask[1:].T)]
        fixed = ca.repmat(ca.DM(m), 1, n - 1)
        whole = _sample(steps, n_sub).mapaccum("record", n - 1)
        states, out = whole(zs[1], *many, fixed, fixed)
        zs[2:], outs[1:] = np.asarray(states.full()).T, np.asarray(out.full()).T
        along = _seeded(_sample_tangent(steps, n_sub)).mapaccum("tangents", n - 1)
        for d in range(n_d):
            dfixed = ca.repmat(ca.DM(dm[:, d]), 1, n - 1)
            _, t = along(seeds[d], ca.DM(zs[1:-1].T), *many, fixed, fixed, dfixed, dfixed)
            tangents[1:, d] = np.asarray(t.full()).T
    k = lay.n_y
    return (
        outs[:, :k], outs[:, k : 2 * k], outs[:, 2 * k :], zs[1:, : lay.n_x],
        tangents[:, :, :k], tangents[:, :, k:], -1, zs[-1].copy(),
    )  # fmt: skip


def _inputs(steps: Steps, n_sub: int) -> list[ca.MX]:
    at, lay = steps.places, steps.places.lay
    sizes = {
        "z": at.n_z, "u": n_sub * 2 * lay.n_u, "elapsed": n_sub, "y": lay.n_y, "mask": lay.n_y,
        "ms": at.n_m, "m": at.n_m,
    }  # fmt: skip
    return [ca.MX.sym(name, size) for name, size in sizes.items()]


def _pieces(steps: Steps, n_sub: int, given: list[ca.MX]) -> list[tuple[ca.MX, ...]]:
    """Arguments of `predict` for each sub-step, then of `update`."""
    z, u, elapsed, y, mask, ms, m = given
    n_u, f = steps.places.lay.n_u, steps.functions
    found: list[tuple[ca.MX, ...]] = []
    for j in range(n_sub):
        a, b = u[2 * j * n_u : (2 * j + 1) * n_u], u[(2 * j + 1) * n_u : (2 * j + 2) * n_u]
        roots = ca.MX(0, 1)
        if not steps.linear:
            roots = f["bondsight_roots"](z, a, b, ms, elapsed[j])
        found.append((z, roots, a, b, ms, elapsed[j]))
        z = f["bondsight_predict"](*found[-1])
    found.append((z, y, mask, b, m))
    return found


def _sample(steps: Steps, n_sub: int) -> ca.Function:
    given = _inputs(steps, n_sub)
    z, out, _ = steps.functions["bondsight_update"](*_pieces(steps, n_sub, given)[-1])
    return ca.Function("sample", given, [z, out])


def _sample_tangent(steps: Steps, n_sub: int) -> ca.Function:
    given = _inputs(steps, n_sub)
    at = steps.places
    dz, dms, dm = ca.MX.sym("dz", at.n_z), ca.MX.sym("dms", at.n_m), ca.MX.sym("dm", at.n_m)
    moved = dz
    pieces = _pieces(steps, n_sub, given)
    for piece in pieces[:-1]:
        moved = steps.functions["bondsight_predict_t"](*piece, moved, dms)
    z, out, _ = steps.functions["bondsight_update_t"](*pieces[-1], moved, dm)
    return ca.Function("sample_tangent", [*given, dz, dms, dm], [z, out[at.lay.n_y :]])


def _seeded(tangent: ca.Function) -> ca.Function:
    """Put the carried tangent first, where `mapaccum` looks for what it carries."""
    z, u, elapsed, y, mask, ms, m, dz, dms, dm = (
        ca.MX.sym(f"a{i}", tangent.size1_in(i)) for i in range(tangent.n_in())
    )
    outputs = list(tangent(z, u, elapsed, y, mask, ms, m, dz, dms, dm))
    return ca.Function("seeded", [dz, z, u, elapsed, y, mask, ms, m, dms, dm], outputs)
