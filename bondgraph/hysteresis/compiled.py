"""Any operator over a whole record, forwards and backwards, inside one compiled call.

The operator's own formulas become a CasADi function with its numbers as inputs, so that operators
of one kind and size share a library. Without a compiler CasADi's virtual machine runs forwards and
SciPy's root finder backwards.

Sizes: N samples, n memory states, k parameters.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from importlib.resources import files
from typing import Any, cast

import casadi as ca
import numpy as np

from bondgraph.hysteresis.checks import numbers
from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.native import MACHINE, build, c_source
from bondgraph.support.ops import CASADI, FloatArray

INLINED = ("-O2", *MACHINE)
"""The step of an operator is short, and becomes part of the loop over a record."""


def compiled_record(
    operator: Operator, x: FloatArray, memory: Memory, step: float
) -> tuple[FloatArray, Memory]:
    """Return the output over a checked record and the memory after it, see `Operator.run`."""
    loops = _loops(_structure(operator))
    return loops.forwards(x, np.array(memory, float), step, np.array(_numbers(operator)))


def compiled_inverse(
    operator: Operator,
    y: FloatArray,
    memory: Memory,
    step: float,
    start: float,
    tolerance: float,
) -> tuple[FloatArray, Memory]:
    """Return the input that makes the output ``y``, and the memory after it, see `numeric_inverse`.

    `start` is the input at which the memory was left, `tolerance` the largest error of the input.

    Raises
    ------
    NotInvertible
        If no input reaches a sample; names it.
    """
    loops = _loops(_structure(operator))
    p = np.array(_numbers(operator))
    return loops.backwards(y, np.array(memory, float), step, p, start, tolerance)


def _numbers(operator: Operator) -> list[float]:
    """All real parameters in order, those of inner operators too."""
    found: list[float] = []
    for name, value in _fields(operator):
        if isinstance(value, Operator):
            found.extend(_numbers(value))
        elif isinstance(value, tuple):
            found.extend(numbers(name, value))
        elif not isinstance(value, int):
            found.extend(numbers(name, (value,)))
    return found


def _fields(operator: Operator) -> Iterator[tuple[str, Any]]:
    for f in fields(cast(Any, operator)):
        yield f.name, getattr(operator, f.name)


def _filled(operator: Operator, values: Iterator[Any]) -> Operator:
    """Replace the real parameters, one after the other; counts and zeros that are marks stay."""
    new: dict[str, Any] = {}
    for name, value in _fields(operator):
        if isinstance(value, Operator):
            new[name] = _filled(value, values)
        elif isinstance(value, tuple):
            taken = [next(values) for _ in value]
            # a threshold that is exactly 0 marks the linear part and has to stay a number
            new[name] = tuple(v if v == 0.0 else t for v, t in zip(value, taken, strict=True))
        elif not isinstance(value, int):
            new[name] = next(values)
    return cast(Operator, replace(cast(Any, operator), **new))


@dataclass(frozen=True, slots=True)
class _Structure:
    """An operator up to its numbers; equal structures share a library."""

    shape: tuple[Any, ...]
    example: Operator = field(compare=False)


def _structure(operator: Operator) -> _Structure:
    return _Structure(_shape(operator), operator)


def _shape(operator: Operator) -> tuple[Any, ...]:
    parts: list[Any] = [operator.kind]
    for _, value in _fields(operator):
        if isinstance(value, Operator):
            parts.append(_shape(value))
        elif isinstance(value, tuple):
            parts.append(tuple(v == 0.0 for v in value))
        else:
            parts.append(value if isinstance(value, int) else "number")
    return tuple(parts)


Forwards = Callable[[FloatArray, FloatArray, float, FloatArray], tuple[FloatArray, Memory]]
Backwards = Callable[
    [FloatArray, FloatArray, float, FloatArray, float, float], tuple[FloatArray, Memory]
]


@dataclass(frozen=True, slots=True)
class RecordLoops:
    """A step function over whole records, and its inverse."""

    forwards: Forwards
    backwards: Backwards


@lru_cache(maxsize=256)
def _loops(structure: _Structure) -> RecordLoops:
    return loops_of(_step_function(structure.example))


def loops_of(step: ca.Function) -> RecordLoops:
    """Compile the loops of a step ``(input, memory, time, parameters) -> (output, memory)``.

    The function is called ``operator_step`` and has no sparse output.
    """
    loops = files("bondgraph.hysteresis").joinpath("compiled.c").read_text(encoding="utf-8")
    library = build(c_source(step) + loops, INLINED)
    return _machine_loops(step) if library is None else _native_loops(str(library), step)


def _step_function(operator: Operator) -> ca.Function:
    x, h = ca.SX.sym("x"), ca.SX.sym("h")
    m, p = ca.SX.sym("m", operator.n_memory), ca.SX.sym("p", len(_numbers(operator)))
    symbolic = _filled(operator, iter(ca.vertsplit(p) if p.numel() else ()))
    states = tuple(ca.vertsplit(m)) if operator.n_memory else ()
    y = symbolic.value(CASADI, x, states, h)
    after = symbolic.advance(CASADI, x, states, h)
    new = ca.densify(ca.vertcat(*after)) if after else ca.SX(0, 1)
    return ca.Function(
        "operator_step", [x, m, h, p], [ca.densify(ca.SX(y)), new], {"cse": True}
    )  # fmt: skip


def _native_loops(library: str, step: ca.Function) -> RecordLoops:
    handle = ctypes.CDLL(library)
    pointer = ctypes.POINTER(ctypes.c_double)
    long, real = ctypes.c_longlong, ctypes.c_double
    handle.forwards.restype = None
    handle.backwards.restype = long
    n_arg, n_res, n_iw, n_w = step.sz_arg(), step.sz_res(), step.sz_iw(), step.sz_w()

    def at(v: FloatArray) -> Any:
        return v.ctypes.data_as(pointer)

    def workspace() -> tuple[Any, ...]:
        iw = (long * max(n_iw, 1))()
        return iw, at(np.empty(max(n_w, 1))), (pointer * n_arg)(), (pointer * n_res)()

    def forwards(
        x: FloatArray, m: FloatArray, h: float, p: FloatArray
    ) -> tuple[FloatArray, Memory]:
        x, y, spare = np.ascontiguousarray(x), np.empty(x.size), np.empty(m.size + 1)
        seconds = np.array([h])
        handle.forwards(
            at(x), long(x.size), long(m.size), at(m), at(spare), at(seconds), at(p), at(y),
            *workspace(),
        )  # fmt: skip
        return y, tuple(m.tolist())

    def backwards(
        y: FloatArray, m: FloatArray, h: float, p: FloatArray, start: float, tolerance: float
    ) -> tuple[FloatArray, Memory]:
        y, x, spare = np.ascontiguousarray(y), np.empty(y.size), np.empty(m.size + 1)
        seconds, reach = np.array([h]), max(1e3 * tolerance, 1e-300)
        bad = handle.backwards(
            at(y), long(y.size), long(m.size), at(m), at(spare), at(seconds), at(p), real(start),
            real(reach), real(tolerance), at(x), *workspace(),
        )  # fmt: skip
        if bad < y.size:
            raise _unreached(int(bad), float(y[bad]))
        return x, tuple(m.tolist())

    return RecordLoops(forwards, backwards)


def _machine_loops(step: ca.Function) -> RecordLoops:
    def forwards(
        x: FloatArray, m: FloatArray, h: float, p: FloatArray
    ) -> tuple[FloatArray, Memory]:
        chunk, y, state = 512, np.empty(x.size), ca.DM(m)
        for first in range(0, x.size, chunk):
            part = x[first : first + chunk]
            # the states are the accumulated input of mapaccum, so they come first
            outputs = _ordered(step).mapaccum(part.size)(
                state, ca.DM(part).T, ca.repmat(ca.DM(h), 1, part.size),
                ca.repmat(ca.DM(p), 1, part.size),
            )  # fmt: skip
            state = outputs[0][:, -1]
            y[first : first + part.size] = outputs[1].full().ravel()
        return y, tuple(state.full().ravel().tolist())

    def backwards(
        y: FloatArray, m: FloatArray, h: float, p: FloatArray, start: float, tolerance: float
    ) -> tuple[FloatArray, Memory]:
        from scipy.optimize import brentq

        x, state, last = np.empty(y.size), ca.DM(m), start
        for k, wanted in enumerate(y):

            def miss(at: float, state: Any = state, wanted: float = float(wanted)) -> float:
                return float(step(at, state, h, p)[0]) - wanted

            first = miss(last)
            reach, other = max(1e3 * tolerance, 1e-300), last
            for _ in range(45):
                if first == 0.0 or first * miss(other) < 0.0:
                    break
                other = last + (reach if first < 0.0 else -reach)
                reach *= 2.0
            else:
                raise _unreached(k, float(wanted))
            if first != 0.0:
                last = float(brentq(miss, last, other, xtol=max(tolerance, 1e-300), rtol=1e-15))
            x[k] = last
            state = step(last, state, h, p)[1]
        return x, tuple(state.full().ravel().tolist())

    return RecordLoops(forwards, backwards)


def _ordered(step: ca.Function) -> ca.Function:
    x, m, h, p = (ca.SX.sym(name, step.size1_in(i)) for i, name in enumerate("xmhp"))
    y, after = step(x, m, h, p)
    return ca.Function("ordered", [m, x, h, p], [after, y])


def _unreached(k: int, wanted: float) -> NotInvertible:
    return NotInvertible(
        f"no input reaches y[{k}] = {wanted:.6g}: the output is bounded, or does not rise with the "
        "input there; keep the reference within the range of the operator",
        k,
    )
