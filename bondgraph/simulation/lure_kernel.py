"""The step of a model with its sensitivities, and the loop over a record in one compiled call.

With gcc the march over the record and the laws' CasADi code are compiled, and cached by content;
without gcc one whole step is a CasADi function that runs in CasADi's virtual machine.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.simulation.banks import PlacedBank, TakenOut, loaded, taken_out, unloaded
from bondgraph.simulation.block_recursion import blocked_record
from bondgraph.simulation.halving import Within
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.lure_closing import ClosedLaws, closed_laws
from bondgraph.simulation.lure_layout import KernelLayout, layout
from bondgraph.simulation.lure_march import (
    blocks_of,
    compiled_march,
    has_slopes,
    lanes_of,
    law_functions,
    law_table,
)
from bondgraph.support.arrays import Array
from bondgraph.support.native import compiler

MANY_STATES = 32
"""States from which a linear model runs in blocks."""


def unpack(m: ca.SX, lay: KernelLayout) -> list[ca.SX]:
    """Return the packed matrices of a step."""
    out, at = [], 0
    for r, c in lay.pieces:
        out.append(ca.reshape(m[at : at + r * c], r, c))
        at += r * c
    return out


def step_function(compiled: Compiled, n_d: int) -> ca.Function:
    """One step ``(z, u0, u1, M, q, dM, dq) -> (z+, out)``; columns 1.. are the directions."""
    lay, closed = layout(compiled, n_d), closed_laws(compiled, n_d > 0)
    z = ca.SX.sym("z", lay.n_z, 1 + n_d)
    u0, u1 = ca.SX.sym("u0", lay.n_u), ca.SX.sym("u1", lay.n_u)
    m, q = ca.SX.sym("M", lay.n_packed), ca.SX.sym("q", lay.n_q)
    dm, dq = ca.SX.sym("dM", lay.n_packed, n_d), ca.SX.sym("dq", lay.n_q, n_d)
    phi, g0, g1, cs, ds, gain, cy, dy = unpack(m, lay)
    n, k = lay.n_x, lay.n_x + lay.n_w
    x, w0, memory = z[:n, 0], z[n:k, 0], z[k:, 0]
    v0, v1u = ca.vertcat(u0, w0), ca.vertcat(u1, ca.SX.zeros(lay.n_w))
    x_free = phi @ x + g0 @ v0 + g1 @ v1u
    s_free = cs @ x_free + ds @ u1
    w1, memory1, *response = closed.function(s_free, gain, memory, q, w0, m[-1])
    late = g1[:, lay.n_u :]
    x1, s1 = x_free + late @ w1, s_free + gain @ w1
    v1 = ca.vertcat(u1, w1)
    out = [ca.vertcat(cy @ x1 + dy @ v1, s1, w1)]
    carried = [ca.vertcat(x1, w1, memory1)]
    for d in range(n_d):
        tphi, tg0, tg1, tcs, tds, tgain, tcy, tdy = unpack(dm[:, d], lay)
        tx, tw0, tm = z[:n, 1 + d], z[n:k, 1 + d], z[k:, 1 + d]
        tv0 = ca.vertcat(ca.SX.zeros(lay.n_u), tw0)
        tx_free = phi @ tx + tphi @ x + g0 @ tv0 + tg0 @ v0 + tg1 @ v1u
        ts_free = cs @ tx_free + tcs @ x_free + tds @ u1
        tw = _moved(closed, response, ts_free, tgain, w1, tm, dq[:, d])
        tx1 = tx_free + late @ tw + tg1[:, lay.n_u :] @ w1
        ts1 = ts_free + gain @ tw + tgain @ w1
        tm1 = _remembered(closed, response, lay.n_m, ca.vertcat(ts1, tm, dq[:, d]))
        tv1 = ca.vertcat(ca.SX.zeros(lay.n_u), tw)
        out.append(ca.vertcat(cy @ tx1 + tcy @ x1 + dy @ tv1 + tdy @ v1, ts1, tw))
        carried.append(ca.vertcat(tx1, tw, tm1))
    return ca.Function(
        "bondsight_step",
        [z, u0, u1, m, q, dm, dq],
        [ca.densify(ca.horzcat(*carried)), ca.densify(ca.horzcat(*out))],
        {"cse": True},
    )


def _moved(
    closed: ClosedLaws, response: list[ca.SX], ts: ca.SX, tg: ca.SX, w: ca.SX, tm: ca.SX, tq: ca.SX
) -> ca.SX:
    """Change of the deviations along one direction."""
    if not w.numel():
        return ca.SX(0, 1)
    resolvent, by_free, by_gain, by_memory, by_q, _ = response
    own = ca.diag(tg)
    alone = by_free * (ts + tg @ w - own * w) + by_gain * own
    alone += _by_law(by_memory * tm, closed.memories) + _by_law(by_q * tq, closed.parameters)
    return resolvent @ alone


def _by_law(terms: ca.SX, counts: tuple[int, ...]) -> ca.SX:
    """Sum the terms of each law."""
    ends = np.cumsum([0, *counts])
    return ca.vertcat(*(ca.sum1(terms[a:b]) for a, b in pairwise(ends.tolist())))


def _remembered(closed: ClosedLaws, response: list[ca.SX], n_m: int, change: ca.SX) -> ca.SX:
    """Change of the new memory along one direction."""
    new = [ca.SX(0.0) for _ in range(n_m)]
    for number, (row, column) in enumerate(zip(closed.rows, closed.columns, strict=True)):
        new[row] += response[-1][number] * change[column]
    return ca.vertcat(*new) if new else ca.SX(0, 1)


# -- running over a record -------------------------------------------------------------------

March = Callable[..., tuple[Array, Array, Array]]
ManyRuns = Callable[[Array, Array, int, Array, Array], tuple[Array, Array]]
"""Runs records one after the other, see `many_runs`."""
Packed = tuple[Array, Array]
Runner = Callable[[Packed, Packed, Array, Array], March]


def runner(compiled: Compiled, n_d: int) -> Runner:
    """Return ``run(moving, standing, q, dq)(u, z, n_sub, before, begin, last) -> (y, laws, z)``.

    It has `n_d` directions. `moving` and `standing` are the matrices (n_M,) of a sub-step and of
    one of no length, which an input that jumps at a sample takes first, and their derivatives
    (n_M, n_d). With `begin` the first row is the state as it is given, laws solved. Shapes: u
    (n_samples * n_sub, 2, n_u), before (n_u,): the inputs as they ended before; last (n_u,) or
    None: those after the last sample, with which readings are taken after jumps; z (n_z, 1 + n_d),
    q (n_q,), dq (n_q, n_d); y (n_samples, n_y, 1 + n_d), laws (n_samples, 2 n_w): arguments and
    deviations. Threads may share a march.
    """
    return _runner(_Key(compiled, n_d))


def many_runs(compiled: Compiled, n_d: int) -> Callable[..., ManyRuns] | None:
    """Return what runs many short records in one call, each from a state of its own.

    ``run(moving, standing, q, dq)(u, z, n_sub, before, samples)``: u of all records one after the
    other, z (n_records, n_z, 1 + n_d), before (n_records, n_u), samples (n_records,) with those at
    which they begin. None where nothing is compiled, and of sums of plays.
    """
    return _many_runs(_Key(compiled, n_d))


class _Key:
    """Structure of a kernel; equal keys share one compiled step."""

    def __init__(self, compiled: Compiled, n_d: int) -> None:
        self.compiled, self.n_d = compiled, n_d
        laws = tuple((port.law.structure, len(port.parameters)) for port in compiled.laws)
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
    if compiler() is not None:
        left, taken = without_banks(key.compiled)
        inner = layout(left, key.n_d)
        slopes = has_slopes(inner, taken.banks)
        laws = closed_laws(left, slopes)
        libraries = compiled_march(inner, laws, slopes)
        if libraries:
            run = _native_runner(libraries, laws, inner, taken.banks).one
            return _reordered(run, lay, inner, taken) if taken.banks else run
    return _machine_runner(step_function(key.compiled, key.n_d), lay)


def _blocked_runner(lay: KernelLayout) -> Runner:
    """Run a large linear model: many steps at once are a product of matrices."""

    def run(moving: Packed, _standing: Packed, q: Array, dq: Array) -> March:
        m, at = moving[0], np.cumsum([0, *(r * c for r, c in lay.pieces)])
        phi, g0, g1, _, _, _, cy, dy = (
            m[at[i] : at[i + 1]].reshape(shape, order="F") for i, shape in enumerate(lay.pieces)
        )
        late = np.hstack([np.zeros_like(dy), dy])

        def march(
            u: Array,
            z: Array,
            n_sub: int,
            before: Array,
            begin: bool,
            last: Array | None = None,
        ) -> tuple[Array, Array, Array]:
            v = u.reshape(u.shape[0], 2 * lay.n_u)
            y, x = blocked_record(phi, np.hstack([g0, g1]), cy, late, v, z[:, 0], n_sub)
            if last is not None:
                begun = np.concatenate([u[n_sub::n_sub, 0], last[None]])
                y += (begun - u[n_sub - 1 :: n_sub, 1]) @ dy.T
            if begin:
                y = np.concatenate([(cy @ z[:, 0] + dy @ before)[None], y])
            return y[:, :, None], np.empty((y.shape[0], 0)), x[:, None]

        return march

    return run


def without_banks(compiled: Compiled) -> tuple[Compiled, TakenOut]:
    """Return a model with the plays taken out of its laws, and what was taken out."""
    ports = compiled.laws
    taken = taken_out([(port.law, len(port.parameters)) for port in ports])
    laws = tuple(replace(port, law=law) for port, law in zip(ports, taken.laws, strict=True))
    return replace(compiled, laws=laws), taken


def _reordered(run: Runner, lay: KernelLayout, inner: KernelLayout, taken: TakenOut) -> Runner:
    """Carry the plays behind all the rest."""
    head = lay.n_x + lay.n_w
    plays = [i for b in taken.banks for i in range(b.states.start, b.states.stop)]
    outside = np.array([*range(head), *(head + i for i in (*taken.kept, *plays))])
    inside = np.array([*range(head), *(head + i for i in taken.left), *range(len(plays))])
    inside[len(inside) - len(plays) :] += inner.n_z

    def started(moving: Packed, standing: Packed, q: Array, dq: Array) -> March:
        march = run(moving, standing, q, dq)

        def reordered(
            u: Array, z: Array, n_sub: int, before: Array, begin: bool, last: Array | None = None
        ) -> tuple[Array, Array, Array]:
            carried = np.zeros((inner.n_z + len(plays), z.shape[1]))
            carried[inside] = z[outside]
            y, seen, carried = march(u, carried, n_sub, before, begin, last)
            after = np.empty_like(z)
            after[outside] = carried[inside]
            return y, seen, after

        return reordered

    return started


NONE = np.zeros(0)
LocatedRunner = Callable[..., Callable[..., tuple[Array, Array, Array]]]


@lru_cache(maxsize=64)
def _located_runner(key: _Key) -> LocatedRunner | None:
    lay = layout(key.compiled, 0)
    if compiler() is None or not lay.n_w or without_banks(key.compiled)[1].banks:
        return None
    slopes = has_slopes(lay)
    laws = closed_laws(key.compiled, slopes)
    libraries = compiled_march(lay, laws, slopes, located=True)
    return _native_runner(libraries, laws, lay, ()).one if libraries else None


@lru_cache(maxsize=256)
def _many_runs(key: _Key) -> Callable[..., ManyRuns] | None:
    lay = layout(key.compiled, key.n_d)
    if compiler() is None or lay.n_m:
        return None
    laws = closed_laws(key.compiled, has_slopes(lay))
    libraries = compiled_march(lay, laws, has_slopes(lay))
    return _native_runner(libraries, laws, lay, ()).many if libraries else None


def located_runner(compiled: Compiled) -> LocatedRunner | None:
    """Return ``run(moving, standing, q, dq, halves)(u, z, n_sub, before, begin, last, within)``.

    It is that of `runner` without directions, its steps halved where they and their halves differ;
    `halves` are the matrices of steps of a half, a quarter and so on, `DEPTH` of them. None where
    nothing is compiled, without laws, and of sums of plays.
    """
    return _located_runner(_Key(compiled, 0))


@dataclass(frozen=True)
class _Native:
    """What runs one record, and what runs many short ones."""

    one: Any
    many: Callable[..., ManyRuns]


def _native_runner(
    libraries: tuple[Path, ...],
    laws: ClosedLaws,
    lay: KernelLayout,
    banks: tuple[PlacedBank, ...],
) -> _Native:
    march_library, *code = libraries
    library = ctypes.CDLL(str(march_library))
    native, several = library.run_record, getattr(library, "run_records", None)
    native.restype = None
    addresses, numbers = ctypes.c_void_p, ctypes.c_longlong
    native.argtypes = [addresses] * 4 + [numbers] * 9 + [addresses] * 17
    if several is not None:
        several.restype = None
        several.argtypes = [
            *[addresses] * 3, numbers, addresses, *[numbers] * 7, *[addresses] * 14
        ]  # fmt: skip
    table = law_table(lay, laws, banks, code[0] if code else None)
    pointer = ctypes.POINTER(ctypes.c_double)
    width, each, blocks = 1 + lay.n_d, lanes_of(lay, banks), blocks_of(lay, banks)
    row = each * blocks
    inputs, number = _entries(lay)
    used = law_functions(laws) if lay.n_w else ()
    sizes = [
        max((size(f) for f in used), default=1) + 1
        for size in (ca.Function.sz_iw, ca.Function.sz_w, ca.Function.sz_arg, ca.Function.sz_res)
    ]
    sizes[3] += 1  # the deviations come before what follows from them

    def wide(first: Array, rest: Array, lanes: int) -> Array:
        """Return rows of a number and its derivatives, cut or padded to `lanes`."""
        found = np.zeros((first.size, lanes))
        found[:, 0] = first
        found[:, 1 : 1 + rest.shape[1]] = rest[:, : lanes - 1]
        return found

    def at(v: Array) -> int:
        return int(v.__array_interface__["data"][0])

    def further(within: Within, quiet: Array) -> list[ctypes.c_void_p]:
        return [ctypes.c_void_p(at(v)) for v in (quiet, *within.arrays)]

    def posed(
        moving: Packed, standing: Packed, q: Array, dq: Array, halves: Sequence[Packed] = ()
    ) -> tuple[int, Any, list[Any]]:
        """Return how many blocks of slopes there are, and the addresses of what a run takes."""
        ladder = (moving, *halves)
        both = (*ladder, standing)
        along = np.flatnonzero(np.any([dm.any(axis=0) for _, dm in both], axis=0))
        lead = 1 + (int(along[-1]) + 1) // each if along.size else 1
        lanes = each * lead
        *slopes, still = (wide(np.where(inputs, m, 0.0), dm, lanes) for m, dm in both)
        touched = number[np.any([dm.any(axis=1) for _, dm in both], axis=0)]
        live = (np.bincount(touched, minlength=len(lay.pieces) + 1)[:-1] > 0).astype(np.int64)
        by_q = wide(np.zeros(lay.n_q), dq, row)
        steps = np.concatenate([m for m, _ in ladder]), standing[0], q
        along_steps = np.concatenate(slopes), still, by_q
        given = [np.ascontiguousarray(v, float) for v in (*steps, *along_steps)]
        # these addresses keep their arrays alive
        at_live, *at_given = (v.ctypes.data_as(addresses) for v in (live, *given))
        return lead, at_live, at_given

    def many(moving: Packed, standing: Packed, q: Array, dq: Array) -> ManyRuns:
        lead, at_live, at_given = posed(moving, standing, q, dq)

        def march(
            u: Array, z: Array, n_sub: int, before: Array, samples: Array
        ) -> tuple[Array, Array]:
            u, before = (np.ascontiguousarray(v, float) for v in (u, before))
            assert several is not None
            counts, n = np.ascontiguousarray(samples, np.int64), int(np.sum(samples))
            carried = np.zeros((counts.size, lay.n_z, row))
            shown = min(z.shape[2], row)
            carried[:, :, :shown] = z[:, :, :shown]
            y, seen = np.empty((n, lay.n_y, width)), np.empty((n, 2 * lay.n_w))
            iw, work = (ctypes.c_longlong * sizes[0])(), np.empty(sizes[1])
            shape = (lay.n_x, lay.n_u, blocks, n_sub, lay.n_y, width, lead)
            arg, res = (pointer * sizes[2])(), (pointer * sizes[3])()
            several(
                ctypes.byref(table), at(u), at(before), counts.size, at(counts), *shape, at_live,
                at(carried), *at_given, at(y), at(seen), iw, at(work), arg, res,
            )  # fmt: skip
            return y, seen

        return march

    def run(
        moving: Packed, standing: Packed, q: Array, dq: Array, halves: Sequence[Packed] = ()
    ) -> March:
        lead, at_live, at_given = posed(moving, standing, q, dq, halves)
        stride = ctypes.c_longlong(moving[0].size)
        filled = [b.bank.filled(q[b.parameters], dq[b.parameters], row) for b in banks]

        def march(
            u: Array,
            z: Array,
            n_sub: int,
            before: Array,
            begin: bool,
            last: Array | None = None,
            within: Within | None = None,
            quiet: Array = NONE,
        ) -> tuple[Array, Array, Array]:
            u, before = (np.ascontiguousarray(v, float) for v in (u, before))
            n = u.shape[0] // n_sub + begin
            last = None if last is None else np.ascontiguousarray(last, float)
            carried = wide(z[: lay.n_z, 0], z[: lay.n_z, 1:], row)
            held = loaded(banks, filled, z[lay.n_z :], row)
            y, seen = np.empty((n, lay.n_y, width)), np.empty((n, 2 * lay.n_w))
            iw, work = (ctypes.c_longlong * sizes[0])(), np.empty(sizes[1])
            shape = (lay.n_x, lay.n_u, blocks, begin, n, n_sub, lay.n_y, width, lead)
            arg, res = (pointer * sizes[2])(), (pointer * sizes[3])()
            inputs = at(u), at(before), None if last is None else at(last)
            native(
                ctypes.byref(table), *inputs, *shape, at_live, at(carried),
                *at_given, at(y), at(seen), iw, at(work), arg, res, *map(at, held),
                *(() if within is None else (stride, *further(within, quiet))),
            )  # fmt: skip
            plays = unloaded(banks, *held, width)
            return y, seen, np.concatenate([carried[:, :width], plays])

        return march

    return _Native(run, many)


def _entries(lay: KernelLayout) -> tuple[Array, Array]:
    """Where inputs enter the packed matrices, and of which matrix the other entries are."""
    marks = [np.zeros(shape, bool) for shape in lay.pieces]
    for piece, mark in enumerate(marks):
        if piece in (1, 2, 7):
            mark[:, : lay.n_u] = True
        mark |= piece == 4  # what inputs add to the laws' arguments
    flat = [mark.ravel(order="F") for mark in marks]
    inputs = np.append(np.concatenate(flat), False)
    number = np.append(np.repeat(np.arange(len(flat)), [f.size for f in flat]), len(flat))
    return inputs, np.where(inputs, len(flat), number)


def _machine_runner(step: ca.Function, lay: KernelLayout) -> Runner:
    chunk, width = 128, 1 + lay.n_d
    many = step.mapaccum("record", chunk, 1)
    begin = sum(r * c for r, c in lay.pieces[:4])
    direct = slice(begin, begin + lay.n_w * lay.n_u)

    def run(moving: Packed, standing: Packed, q: Array, dq: Array) -> March:
        acting = moving[0][direct].reshape(lay.n_w, lay.n_u, order="F").any(axis=0)
        laws = [ca.DM(q.reshape(-1, 1)), ca.DM(dq)]
        sets = [(ca.DM(m.reshape(-1, 1)), ca.DM(dm)) for m, dm in (moving, standing)]

        def taken(ways: Array, z: Array, u0: Array, u1: Array) -> tuple[Array, Array]:
            """Take sub-steps and jumps (ways 0 and 1) one after the other."""
            n = ways.size
            m, dm = (ca.horzcat(*(sets[int(way)][i] for way in ways)) for i in (0, 1))
            q_, dq_ = (ca.repmat(v, 1, n) for v in laws)
            z_, out = (many if n == chunk else step)(z, u0.T, u1.T, m, q_, dm, dq_)
            made = np.asarray(out.full()).reshape(lay.n_out, n, width).transpose(1, 0, 2)
            return np.asarray(z_[:, -width:].full()), made

        def march(
            u: Array,
            z: Array,
            n_sub: int,
            before: Array,
            begin: bool,
            last: Array | None = None,
        ) -> tuple[Array, Array, Array]:
            ended = np.concatenate([before[None], u[n_sub - 1 :: n_sub, 1]])
            begun = np.concatenate([u[::n_sub, 0], ended[-1:] if last is None else last[None]])
            seen = acting if last is None else np.ones_like(acting)
            jumps = n_sub * np.flatnonzero((begun != ended)[:, seen].any(axis=1))
            jumps = np.repeat(jumps, 2)  # from far Newton's method gets twice the steps
            onward = np.ones(u.shape[0] + jumps.size, bool)
            onward[jumps + np.arange(jumps.size)] = False
            u = np.insert(u, jumps, begun[jumps // n_sub][:, None, :].repeat(2, axis=1), axis=0)
            if begin:
                start = np.broadcast_to(before, (2, 2, before.size))
                u, onward = np.concatenate([start, u]), np.concatenate([[False, False], onward])
            out, k = np.empty((onward.size, lay.n_out, width)), 0
            while k < onward.size:
                part = slice(k, k + (chunk if onward.size - k >= chunk else 1))
                z, out[part] = taken(~onward[part], z, u[part, 0], u[part, 1])
                k = part.stop
            ends = np.flatnonzero(onward)[n_sub - 1 :: n_sub]
            if last is not None:  # two steps of no length follow where inputs jump
                follow = np.append(~onward, False)[ends + 1]
                ends = ends + 2 * follow
            kept = out[ends]
            out = np.concatenate([out[1:2], kept]) if begin else kept
            return out[:, : lay.n_y], out[:, lay.n_y :, 0], z

        return march

    return run
