"""Who runs a record of a `Program`: the compiled loop, or CasADi's virtual machine without gcc."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from bondgraph.equations.codegen import program_of, with_signals
from bondgraph.equations.program import Program
from bondgraph.simulation.banks import PlacedBank, TakenOut, loaded, taken_out, unloaded
from bondgraph.simulation.halving import Within
from bondgraph.simulation.radau.interpreted import Carried, machine_record, machine_step
from bondgraph.simulation.radau.native_source import (
    GeneralFunctions,
    general_functions,
    general_source,
    lanes,
)
from bondgraph.support.arrays import Array
from bondgraph.support.native import build

START = 48
SOLVED = 1e-9
ROUNDING = 1e-14


@dataclass(frozen=True, slots=True)
class Order:
    """What to run.

    Attributes
    ----------
    time, h : float
        Of the first sample; of a sub-step, s.
    n_sub : int
        Sub-steps between two rows of the outputs.
    p : ndarray, shape (n_p,)
    directions : tuple of int
        Parameters that the first tangents belong to.
    first : ndarray, shape (n_u,)
        Inputs at the first sample.
    u : ndarray, shape (n, 2, n_u)
        At both ends of each sub-step.
    solved : bool
        Whether the algebraic unknowns at the start belong to the state already; with tangents they
        are always solved for.
    within : Within or None
        Where sub-steps are halved until they and their halves agree: what each of the unknowns and
        memories may differ by; `located_recorder` alone does so.
    """

    time: float
    h: float
    n_sub: int
    p: Array
    directions: tuple[int, ...]
    first: Array
    u: Array
    solved: bool = False
    within: Within | None = None


Recorder: TypeAlias = Callable[[Order, Carried, Array], tuple[Carried, int]]
"""``(order, begin, out) -> (end, reached)``; out of shape (rows, n_y * (1 + n_d)) is filled."""


def recorder(program: Program) -> Recorder:
    """Return what runs records of `program`, compiled at the first call."""
    return _recorder(Key(program), not os.environ.get("BONDSIGHT_NO_COMPILER"))


def functions_of(program: Program) -> GeneralFunctions:
    """Return the functions of `program`, made at the first call."""
    return _functions(Key(program))


class Key:
    """A program as itself: its expressions are too large to be compared."""

    def __init__(self, program: Program) -> None:
        self.program = program

    def __hash__(self) -> int:
        """Return that of the object."""
        return id(self.program)

    def __eq__(self, other: object) -> bool:
        """Whether it is the same object."""
        return isinstance(other, Key) and self.program is other.program


@lru_cache(maxsize=64)
def _functions(key: Key) -> GeneralFunctions:
    return general_functions(key.program)


def located_recorder(program: Program) -> Recorder | None:
    """Return what runs records in steps that are halved where they and their halves differ.

    None where nothing is compiled, of sums of plays, and of laws that are held: what they jump by
    within a step no comparison of two steps shows.
    """
    if program.held or without_banks(program)[1].banks:
        return None
    return _compiled(Key(program), not os.environ.get("BONDSIGHT_NO_COMPILER"))


@lru_cache(maxsize=64)
def _recorder(key: Key, native: bool) -> Recorder:
    return _compiled(key, native) or _machine_recorder(_functions(key))


@lru_cache(maxsize=64)
def _compiled(key: Key, native: bool) -> Recorder | None:
    if not native:
        return None
    left, taken = without_banks(key.program)
    functions = general_functions(left) if taken.banks else _functions(key)
    library = build(general_source(left, functions, taken.banks))
    if library is None:
        return None
    run = _native_recorder(library, functions, left, taken.banks)
    return _reordered(run, taken) if taken.banks else run


def without_banks(program: Program) -> tuple[Program, TakenOut]:
    """Return a program with the plays taken out of its laws, and what was taken out."""
    model, calls = program.model, program.laws
    taken = taken_out([(c.law, len(c.parameters)) for c in (calls if model else ())])
    if model is None or not taken.banks:
        return program, taken
    uses = zip(model.laws, taken.laws, strict=True)
    left = replace(model, laws=tuple(replace(use, law=law) for use, law in uses))
    own = len(model.output_names)
    return with_signals(program_of(left, program.held), left, program.outputs[own:]), taken


def _reordered(run: Recorder, taken: TakenOut) -> Recorder:
    """Carry the plays behind all the rest of the memory."""
    plays = [i for b in taken.banks for i in range(b.states.start, b.states.stop)]
    n_left = sum(law.n_memory for law in taken.laws)
    outside = np.array([*taken.kept, *plays], int)
    inside = np.array([*taken.left, *range(n_left, n_left + len(plays))], int)

    def reordered(order: Order, begin: Carried, out: Array) -> tuple[Carried, int]:
        m, tm = np.zeros(n_left + len(plays)), np.zeros((n_left + len(plays), begin.tm.shape[1]))
        m[inside], tm[inside] = begin.m[outside], begin.tm[outside]
        end, reached = run(order, Carried(begin.v, m, begin.tv, tm), out)
        m, tm = np.empty_like(begin.m), np.empty_like(begin.tm)
        m[outside], tm[outside] = end.m[inside], end.tm[inside]
        return Carried(end.v, m, end.tv, tm), reached

    return reordered


def _native_recorder(
    library: Path, functions: GeneralFunctions, program: Program, banks: tuple[PlacedBank, ...]
) -> Recorder:
    loop = ctypes.CDLL(str(library)).bondsight_record
    loop.restype = ctypes.c_longlong
    n_arg = max(f.sz_arg() for f in functions.all)
    n_res = max(f.sz_res() for f in functions.all)
    n_iw = max(f.sz_iw() for f in functions.all) + 1
    n_w = max(f.sz_w() for f in functions.all) + 1
    n_left, each = len(program.memory), lanes()
    own = [program.parameters.index(n) for c in program.laws for n in c.parameters]

    def run(order: Order, begin: Carried, out: Array) -> tuple[Carried, int]:
        n, n_m, n_d = begin.v.size, n_left, begin.tv.shape[1]
        k, n_u = 2 * n, order.first.size
        row = each * (n_d // each + 1)
        size = k * k + 9 * k + n * n + 2 * n_u + functions.largest + 2 * k * n_d
        work = np.zeros(size + n_m * (1 + n_d) + 4 * n + 64 + 3 * row)
        memory = begin.m[:n_m], begin.tv.ravel(), begin.tm[:n_m].ravel()
        state = np.concatenate([begin.v, *memory, [0.0]])
        q, dq = order.p[own], _picked(order, n_d)[own]
        filled = [b.bank.filled(q[b.parameters], dq[b.parameters], row) for b in banks]
        plays = np.column_stack([begin.m[n_m:], begin.tm[n_m:]])
        held = loaded(banks, filled, plays, row)
        numbers = np.array([order.time, order.h, order.solved and not n_d])
        samples = order.u.shape[0] // order.n_sub
        sizes = np.array([samples, order.n_sub, n_d, len(order.directions)], np.int64)
        positions = np.array([*order.directions, 0], np.int64)
        pivots, integers = np.zeros(k + 1, np.int64), np.zeros(n_iw, np.int64)
        columns = [np.ascontiguousarray(v, float) for v in (order.first, order.u, order.p)]
        arg, res = (ctypes.c_void_p * n_arg)(), (ctypes.c_void_p * n_res)()
        within = (None,) * 3 if order.within is None else map(_at, order.within.arrays)
        reached = loop(
            *map(_at, (numbers, sizes, *columns, positions, state, out, work, pivots, integers)),
            _at(np.zeros(n_w)), arg, res, *map(_at, held), *within,
        )  # fmt: skip
        v, m, tv, tm, _ = np.split(state, np.cumsum([n, n_m, n * n_d, n_m * n_d]))
        plays = unloaded(banks, *held, 1 + n_d)
        m, tm = np.append(m, plays[:, 0]), np.vstack([tm.reshape(n_m, n_d), plays[:, 1:]])
        return Carried(v, m, tv.reshape(n, n_d), tm), int(reached)

    return run


def _at(v: Array) -> Any:
    return v.ctypes.data_as(ctypes.c_void_p)


def _machine_recorder(functions: GeneralFunctions) -> Recorder:
    @lru_cache(maxsize=8)
    def step(n_d: int) -> Any:
        return machine_step(functions, functions.n_x, n_d)

    def run(order: Order, begin: Carried, out: Array) -> tuple[Carried, int]:
        n_d = begin.tv.shape[1]
        picked = _picked(order, n_d)
        started = begin if order.solved and not n_d else consistent(functions, order, begin)
        if started is None:
            return begin, 0
        begin, first = started, _first(functions, order, started)
        rest, end, done = machine_record(
            step(n_d), begin, order.time, order.h, order.n_sub, order.u, order.p, picked,
            functions.held,
        )  # fmt: skip
        found = np.concatenate([first[None], rest])
        n_y = found.shape[1]
        out[:, :n_y] = found[:, :, 0]
        out[:, n_y:] = found[:, :, 1:].reshape(out.shape[0], n_y * n_d)
        return end, done + 1

    return run


def _picked(order: Order, n_d: int) -> Array:
    """Directions among the parameters, shape (n_p, n_d)."""
    picked = np.zeros((order.p.size, n_d))
    for column, row in enumerate(order.directions):
        picked[row, column] = 1.0
    return picked


def _full(function: Any, order: Order, v: Array, m: Array) -> list[Array]:
    found = function(order.time, v, order.first, order.p, m, 0.0)
    return [a.full() for a in (found if isinstance(found, tuple) else (found,))]


def consistent(functions: GeneralFunctions, order: Order, begin: Carried) -> Carried | None:
    """Return `begin` with the unknowns that belong to its state, and their tangents."""
    n_x, v, tv = functions.n_x, begin.v.copy(), begin.tv.copy()
    if v.size == n_x:
        return begin
    for _ in range(START):
        value, slope = _full(functions.stage, order, v, begin.m)
        size = np.abs(slope[n_x:]) @ np.abs(v)
        quiet = (np.abs(value[n_x:, 0]) <= ROUNDING * size).all()
        try:
            correction = np.linalg.solve(slope[n_x:, n_x:], value[n_x:, 0])
        except np.linalg.LinAlgError:
            return None
        v[n_x:] -= correction
        if quiet or (np.abs(correction) <= SOLVED * np.abs(v[n_x:])).all():
            break
    else:
        return None
    if tv.shape[1]:
        slope = _full(functions.stage, order, v, begin.m)[1]
        by_p, by_m = _full(functions.seed, order, v, begin.m)
        seed = by_p[n_x:] @ _picked(order, tv.shape[1]) + by_m[n_x:] @ begin.tm
        tv[n_x:] = -np.linalg.solve(slope[n_x:, n_x:], slope[n_x:, :n_x] @ tv[:n_x] + seed)
    return Carried(v, begin.m, tv, begin.tm)


def _first(functions: GeneralFunctions, order: Order, at: Carried) -> Array:
    """Return the outputs at the first sample and their derivatives, shape (n_y, 1 + n_d)."""
    by_v, by_p, by_m = _full(functions.slope, order, at.v, at.m)
    y = _full(functions.reading, order, at.v, at.m)[0]
    dy = by_v @ at.tv + by_p @ _picked(order, at.tv.shape[1]) + by_m @ at.tm
    return np.hstack([y, dy])
