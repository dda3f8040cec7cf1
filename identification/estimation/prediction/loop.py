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

from bondgraph.simulation.lure import Compiled
from bondgraph.support.arrays import Array
from bondgraph.support.native import build
from identification.estimation.prediction.machine import run_in_machine
from identification.estimation.prediction.steps import Steps, make_steps


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
    last : ndarray, shape (n_z,)
        Carried numbers after the last sample.
    """

    reading: Array
    innovation: Array
    variance: Array
    state: Array
    dinnovation: Array
    dvariance: Array
    settled_at: int
    last: Array


Runner = Callable[..., Passed]
"""``run(u, y, mask, n_sub, z, dz, m, dm, m0, dm0)``; shapes in `loop.c`, directions last."""


def filter_runner(compiled: Compiled, feedthrough: bool) -> Runner:
    """Return the filter for a model; models of equal structure share one."""
    return _runner(_Key(compiled, feedthrough))


class _Key:
    """Structure of a filter; equal keys share one compiled loop."""

    def __init__(self, compiled: Compiled, feedthrough: bool) -> None:
        self.compiled, self.feedthrough = compiled, feedthrough
        laws = tuple((port.law, len(port.parameters)) for port in compiled.space.laws)
        sizes = (compiled.n_x, compiled.n_u, compiled.n_w, compiled.n_y)
        self.id = (sizes, laws, compiled.law_parameters, len(compiled.parameter_names), feedthrough)

    def __hash__(self) -> int:
        return hash(self.id)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.id == other.id


@lru_cache(maxsize=64)
def _runner(key: _Key) -> Runner:
    steps = make_steps(key.compiled, key.feedthrough)
    library = build(_source(steps))
    if library is None:
        return lambda *a: Passed(*run_in_machine(steps, *a))
    return _native(steps, ctypes.CDLL(str(library)))


def _source(steps: Steps) -> str:
    generator = ca.CodeGenerator("code.c", {"with_header": False, "main": False})
    for f in steps.functions.values():
        generator.add(f)
    text = str(generator.dump())
    # comparisons instead of calls that must look for NaN, as in the simulation's kernel
    text = text.replace("return fmax(x, y);", "return x > y ? x : y;")
    text = text.replace("return fmin(x, y);", "return x < y ? x : y;")
    loop = files("identification.estimation.prediction").joinpath("loop.c").read_text()
    step_at = steps.places.packed.stop - 1
    head = f"#define BONDSIGHT_LINEAR {int(steps.linear)}\n#define BONDSIGHT_STEP_AT {step_at}\n"
    return text + head + loop


def _native(steps: Steps, handle: ctypes.CDLL) -> Runner:
    loop = handle.filter_record
    loop.restype = ctypes.c_longlong
    pointer = ctypes.POINTER(ctypes.c_double)
    functions = list(steps.functions.values())
    n_arg = max(f.sz_arg() for f in functions)
    n_res = max(f.sz_res() for f in functions)
    n_iw = max(max(f.sz_iw() for f in functions), 1)
    n_w = max(max(f.sz_w() for f in functions), 1)
    at, lay = steps.places, steps.places.lay

    def run(
        u: Array, y: Array, mask: Array, n_sub: int,
        z: Array, dz: Array, m: Array, dm: Array, m0: Array, dm0: Array,
    ) -> Passed:  # fmt: skip
        n, n_d = y.shape[0], dm.shape[1]
        sizes = (n, n_sub, lay.n_u, lay.n_y, lay.n_x, at.n_p, lay.n_w, at.n_z, at.n_m, n_d)
        packed = (ctypes.c_longlong * 11)(*sizes, int(steps.linear))
        carried, dcarried = np.zeros((2, at.n_z)), np.zeros((2, n_d, at.n_z))
        carried[0], dcarried[0] = z, dz.T
        wide = 1 + n_d
        gains = lay.n_x * lay.n_y
        room = np.zeros(2 * lay.n_w + wide * (at.n_p + gains + lay.n_y) + 3 * lay.n_y)
        out = np.empty((n, 3 * lay.n_y + lay.n_x))
        tangents = np.empty((n, n_d, 2 * lay.n_y))
        work, integers = np.zeros(n_w), (ctypes.c_longlong * n_iw)()
        inputs = [np.ascontiguousarray(v, float) for v in (u, y, mask)]
        numbers = [np.ascontiguousarray(v, float) for v in (m, dm.T, m0, dm0.T)]

        def address(v: Array) -> Any:
            return v.ctypes.data_as(pointer)

        settled = loop(
            ctypes.byref(packed), *map(address, inputs), address(carried), address(dcarried),
            *map(address, numbers), address(room), address(out), address(tangents),
            integers, address(work), (pointer * n_arg)(), (pointer * n_res)(),
        )  # fmt: skip
        k = lay.n_y
        return Passed(
            out[:, :k], out[:, k : 2 * k], out[:, 2 * k : 3 * k], out[:, 3 * k :],
            tangents[:, :, :k], tangents[:, :, k:], int(settled), carried[0].copy(),
        )  # fmt: skip

    return run
