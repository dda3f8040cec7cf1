"""The filter over a whole record in one compiled call; without gcc in CasADi's virtual machine."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.native import LOOPS, build, c_source
from identification.estimation.prediction.assembly import Numbers
from identification.estimation.prediction.plant import FilterPlant, FilterSteps


@dataclass(frozen=True, slots=True)
class Passed:
    """One pass of the filter, in scaled units.

    Attributes
    ----------
    reading, innovation, variance : ndarray, shape (N, n_y)
        One-step prediction; what each reading adds to the ones before it, and its variance.
    state : ndarray, shape (N, n_x)
        Filtered mean.
    dinnovation, dvariance : ndarray, shape (N, n_d, n_y)
    settled_at : int
        Sample from which the gain of a linear model stands still; -1 if never.
    """

    reading: Array
    innovation: Array
    variance: Array
    state: Array
    dinnovation: Array
    dvariance: Array
    settled_at: int


Runner = Callable[[Array, Array, Array, int, Numbers], Passed]
"""``run(u, y, mask, n_sub, numbers)``; shapes in `loop.c`."""


@lru_cache(maxsize=64)
def filter_runner(plant: FilterPlant) -> Runner:
    """Return what runs the filter of a model over a record."""
    steps = plant.steps
    library = build(_source(steps))
    if library is None:
        return lambda *given: _interpreted(steps, *given)
    return _native(steps, ctypes.CDLL(str(library)))


def _source(steps: FilterSteps) -> str:
    loop = files("identification.estimation.prediction").joinpath("loop.c").read_text()
    return (
        f"{c_source(*steps.functions.values())}{LOOPS}"
        f"#define BONDSIGHT_LINEAR {int(steps.linear)}\n"
        f"#define BONDSIGHT_STEP_AT {steps.step_at}\n{loop}"
    )


def _native(steps: FilterSteps, handle: ctypes.CDLL) -> Runner:
    loop = handle.filter_record
    loop.restype = ctypes.c_longlong
    pointer = ctypes.POINTER(ctypes.c_double)
    functions = list(steps.functions.values())
    n_arg = max(f.sz_arg() for f in functions)
    n_res = max(f.sz_res() for f in functions)
    n_iw = max(max(f.sz_iw() for f in functions), 1)
    n_w = max(max(f.sz_w() for f in functions), 1)

    def run(u: Array, y: Array, mask: Array, n_sub: int, numbers: Numbers) -> Passed:
        (n, n_y), n_d, n_x = y.shape, numbers.where.size, steps.n_x
        sizes = (
            n, n_sub, steps.n_u, n_y, n_x, steps.n_p, steps.n_roots, steps.n_z, steps.n_m, n_d
        )  # fmt: skip
        carried, dcarried = np.zeros((2, steps.n_z)), np.zeros((2, n_d, steps.n_z))
        carried[0], dcarried[0] = numbers.z, numbers.dz.T
        room = np.zeros(steps.n_roots + (1 + n_d) * (steps.n_p + n_x * n_y + n_y) + 3 * n_y)
        out, tangents = np.empty((n, 3 * n_y + n_x)), np.empty((n, n_d, 2 * n_y))
        work, integers = np.zeros(n_w), (ctypes.c_longlong * n_iw)()
        given = (numbers.m, numbers.dm.T, numbers.still, numbers.dstill.T)
        inputs = [np.ascontiguousarray(v, float) for v in (u, y, mask)]
        vectors = [np.ascontiguousarray(v, float) for v in given]

        def address(v: Array) -> Any:
            return v.ctypes.data_as(pointer)

        settled = loop(
            ctypes.byref((ctypes.c_longlong * 10)(*sizes)), *map(address, inputs),
            address(carried), address(dcarried), *map(address, vectors), address(room),
            address(out), address(tangents), integers, address(work), (pointer * n_arg)(),
            (pointer * n_res)(),
        )  # fmt: skip
        return _passed(out, tangents, n_y, int(settled))

    return run


def _passed(out: Array, tangents: Array, n_y: int, settled: int) -> Passed:
    return Passed(
        out[:, :n_y], out[:, n_y : 2 * n_y], out[:, 2 * n_y : 3 * n_y], out[:, 3 * n_y :],
        tangents[:, :, :n_y], tangents[:, :, n_y:], settled,
    )  # fmt: skip


def _interpreted(
    steps: FilterSteps, u: Array, y: Array, mask: Array, n_sub: int, numbers: Numbers
) -> Passed:
    """Call the same functions one after the other: slower, and no gain settles."""
    (n, n_y), n_d, n_x = y.shape, numbers.where.size, steps.n_x
    call = {name.removeprefix("bondsight_"): f for name, f in steps.functions.items()}
    out, tangents = np.empty((n, 3 * n_y + n_x)), np.empty((n, n_d, 2 * n_y))
    z, dz, roots, end = ca.DM(numbers.z), ca.DM(numbers.dz), ca.DM(0, 1), u[n_sub - 1, 1]
    for k in range(n):
        m, dm = (numbers.m, numbers.dm) if k else (numbers.still, numbers.dstill)
        for j in range(n_sub if k else 1):
            # the memory given belongs to the first sample: no time has passed
            elapsed = m[steps.step_at] if k > 1 or j else 0.0
            a, end = u[k * n_sub + j] if k else (end, end)
            if steps.n_roots:
                roots = call["roots"](z, a, end, m, elapsed)
            if n_d:
                dz = call["predict_t"](z, roots, a, end, m, elapsed, dz, dm)
            z = call["predict"](z, roots, a, end, m, elapsed)
        if n_d:
            dz, t, _ = call["update_t"](z, y[k], mask[k], end, numbers.m, dz, numbers.dm)
            tangents[k] = np.asarray(t.full())[n_y:].T
        z, seen, _ = call["update"](z, y[k], mask[k], end, numbers.m)
        out[k] = np.concatenate([seen.full().ravel(), z.full().ravel()[:n_x]])
    return _passed(out, tangents, n_y, -1)
