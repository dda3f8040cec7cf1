"""The laws of a model at the end of one step, and how their answer moves: one CasADi function.

Everything else in a step is linear, and is left to whoever runs it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import casadi as ca

from bondgraph.laws.iteration import Iteration
from bondgraph.laws.law import Law, split
from bondgraph.simulation.lure import (
    Compiled,
    advance_laws,
    law_arguments,
    law_slices,
    others_at,
    scalar_solution,
    solve_laws,
    solved_together,
    sweeps,
    together,
    with_entry,
)
from bondgraph.support.ops import CASADI


@dataclass(frozen=True, slots=True)
class ClosedPart:
    """One law, or all at once, in compiled steps; see `bondgraph.laws.iteration.Iteration`.

    Attributes
    ----------
    begin : casadi.Function
        ``(s_free, gain, memory, q, w, h) -> numbers``; the deviations (n_w,) where there is no
        step.
    step, end : casadi.Function or None
        ``(numbers, s_free, gain, memory, q, w, h) ->`` numbers; deviations.
    size, arguments, most : int
        As of the iteration.
    """

    begin: ca.Function
    step: ca.Function | None = None
    end: ca.Function | None = None
    size: int = 0
    arguments: int = 0
    most: int = 0


@dataclass(frozen=True)
class ClosedLaws:
    """The laws of a step, solved.

    Attributes
    ----------
    after : casadi.Function
        ``(s_free, gain, memory, q, w, h) -> (memory+,)`` at the deviations that solve the step,
        shapes (n_w,), (n_w, n_w), (n_m,), (n_q,), (n_w,), a number. With slopes also ``(resolvent,
        by_free, by_gain, by_memory, by_q, slopes)``: a change of the deviations is the resolvent
        (n_w, n_w) times the change each law makes alone, by its free argument and own gain (n_w,),
        its memory (n_m,) and parameters (n_q,); the last are the nonzeros of the derivative of the
        new memory.
    memories, parameters : tuple of int
        How many of each belong to each law.
    rows, columns : tuple of int
        Where those nonzeros stand; the columns are the arguments, the memory and the parameters.
    """

    compiled: Compiled
    after: ca.Function
    memories: tuple[int, ...]
    parameters: tuple[int, ...]
    rows: tuple[int, ...] = ()
    columns: tuple[int, ...] = ()

    @cached_property
    def function(self) -> ca.Function:
        """``(s_free, gain, memory, q, w_last, h) -> (w, *after)``, every step written out."""
        given = _given(self.compiled)
        free, gain, memory, q, last, h = given
        w = ca.SX(0, 1)
        if self.compiled.n_w:
            w = solve_laws(self.compiled, free, gain, memory, q, last, h)
        after = self.after.call([free, gain, memory, q, w, h])
        # a plain name might be a symbol of the C library
        return ca.Function("bondsight_laws", given, [ca.densify(w), *after], {"cse": True})

    @property
    def sweeps(self) -> int:
        """Sweeps over the parts that are always enough."""
        return 1 if solved_together(self.compiled) else sweeps(self.compiled)

    @cached_property
    def parts(self) -> tuple[ClosedPart, ...]:
        """What is swept over; empty if all of it is one formula."""
        laws = law_slices(self.compiled)
        given = _given(self.compiled)
        free, gain, memory, q, w, h = given
        if solved_together(self.compiled):
            whole = together(laws, memory, q, h)
            return (_part(0, given, whole, free, gain, w, lambda v: v),)
        if self.sweeps == 1 and not any(port.law.iterates for port, _, _ in laws):
            return ()
        found = []
        for j, (port, ms, qs) in enumerate(laws):
            others, own = others_at(free, gain, w, j), gain[j, j]
            if port.law.iterates:
                way = port.law.iteration(split(memory[ms]), law_arguments(port.law, q[qs], h))
                found.append(_part(j, given, way, others, own, w[j], partial(with_entry, w, j)))
                continue
            value = scalar_solution(port, others, own, memory[ms], q[qs], w[j], h)
            made = ca.densify(with_entry(w, j, value))
            found.append(
                ClosedPart(ca.Function(f"bondsight_begin_{j}", given, [made], {"cse": True}))
            )
        return tuple(found)


def _part(
    number: int, given: list[ca.SX], way: Iteration, free: Any, gain: Any, last: Any, placed: Any
) -> ClosedPart:
    v = ca.SX.sym("v", way.size)

    def function(name: str, asked: list[ca.SX], made: Any) -> ca.Function:
        made = ca.densify(ca.SX(made))
        return ca.Function(f"bondsight_{name}_{number}", asked, [made], {"cse": True})

    return ClosedPart(
        function("begin", given, way.begin(free, gain, last)),
        function("step", [v, *given], way.step(v, free, gain)),
        function("end", [v, *given], placed(way.end(v))),
        way.size,
        way.arguments,
        way.most,
    )


def _given(compiled: Compiled) -> list[ca.SX]:
    n_w, n_m = compiled.n_w, sum(port.law.n_memory for port in compiled.laws)
    return [
        ca.SX.sym("free", n_w), ca.SX.sym("gain", n_w, n_w), ca.SX.sym("memory", n_m),
        ca.SX.sym("q", len(compiled.law_parameters)), ca.SX.sym("w", n_w), ca.SX.sym("h"),
    ]  # fmt: skip


def closed_laws(compiled: Compiled, slopes: bool) -> ClosedLaws:
    """Return the laws of `compiled`, with the derivatives of their answer if `slopes`."""
    given = _given(compiled)
    free, gain, memory, q, w, h = given
    s = free + gain @ w
    made = [advance_laws(compiled, s, memory, q, h)]
    rows: list[int] = []
    columns: list[int] = []
    if slopes and compiled.n_w:
        made += _response(compiled, free, gain, memory, q, w, h)
        values, rows, columns = _memory_slopes(compiled, s, memory, q, h)
        made.append(values)
    made = [ca.densify(v) for v in made]
    after = ca.Function("bondsight_after", given, made, {"cse": True})
    ports = compiled.laws
    memories = tuple(port.law.n_memory for port in ports)
    parameters = tuple(len(port.parameters) for port in ports)
    return ClosedLaws(compiled, after, memories, parameters, tuple(rows), tuple(columns))


def _response(
    compiled: Compiled, free: ca.SX, gain: ca.SX, memory: ca.SX, q: ca.SX, w: ca.SX, h: ca.SX
) -> list[ca.SX]:
    """Total derivative of the closed laws, by the implicit function theorem for Newton laws."""
    n_w = compiled.n_w
    coupling = ca.SX.eye(n_w)
    parts: tuple[list[ca.SX], ...] = ([], [], [], [])
    for j, (port, ms, qs) in enumerate(law_slices(compiled)):
        alone = free[j] + gain[j, :] @ w - gain[j, j] * w[j]
        slopes = _one_response(port, alone, gain[j, j], memory[ms], q[qs], w[j], h)
        for k in range(n_w):
            if k != j:
                coupling[j, k] = -slopes[0] * gain[j, k]
        for part, slope in zip(parts, slopes, strict=True):
            part.append(ca.vec(slope))
    resolvent = ca.SX.eye(1) if n_w == 1 else ca.solve(coupling, ca.SX.eye(n_w))
    return [resolvent, *(ca.vertcat(*part) for part in parts)]


def _one_response(
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


def _memory_slopes(
    compiled: Compiled, s: ca.SX, memory: ca.SX, q: ca.SX, h: ca.SX
) -> tuple[ca.SX, list[int], list[int]]:
    """Nonzeros of the derivative of the new memory, with their rows and columns."""
    a, b, c = (ca.SX.sym(n, v.numel()) for n, v in (("s", s), ("m", memory), ("q", q)))
    step = ca.SX.sym("h")
    by_all = ca.jacobian(advance_laws(compiled, a, b, c, step), ca.vertcat(a, b, c))
    rows, columns = by_all.sparsity().get_triplet()
    nonzeros = ca.vertcat(*(by_all[i, k] for i, k in zip(rows, columns, strict=True)))
    f = ca.Function("memory", [a, b, c, step], [nonzeros])
    return f(s, memory, q, h), list(rows), list(columns)
