"""The equations of a program as C, by CasADi.

Sizes: n_x states, n_z algebraic unknowns, n_v = n_x + n_z, n_s arguments of laws with memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bondgraph.equations.codegen import law_arguments
from bondgraph.equations.program import Program
from bondgraph.export.switches import switches


@dataclass(frozen=True)
class Equations:
    """Functions of ``(t, v, u, p, m, h)`` with ``v = (x, z)``, and their C source.

    Attributes
    ----------
    source : str
        ``bg_rates -> (f, g)``; ``bg_newton -> (f, g), its Jacobian by v, size of its terms``;
        ``bg_readings -> y``; ``bg_advance -> m``; ``bg_arguments -> s, its Jacobian by v``;
        ``bg_switches ->`` what crosses zero where a law without memory changes its piece.
    work : tuple of int
        Largest lengths of the arrays ``arg, res, iw, w``.
    n_s : int
    events : tuple of int
        Those arguments whose rate follows from the states (not from inputs alone).
    n_k : int
        Crossings of `bg_switches`.
    feedthrough : ndarray of bool, shape (n_y, n_u + n_x)
        Which inputs and states each output can depend on directly.
    rates_by : ndarray of bool, shape (n_x, n_u + n_x)
        The same of the rates.
    linear : tuple of ndarray
        ``A`` (n_v, n_v) and ``B`` (n_v, n_u) at the start.
    """

    source: str
    work: tuple[int, int, int, int]
    n_s: int
    events: tuple[int, ...]
    n_k: int
    feedthrough: np.ndarray
    rates_by: np.ndarray
    linear: tuple[np.ndarray, np.ndarray]


def equations(program: Program) -> Equations:
    """Generate the functions of `program`."""
    n_x, n_z, n_u = len(program.states), len(program.algebraic), len(program.inputs)
    t, h = ca.SX.sym("t"), ca.SX.sym("h")
    v, u = ca.SX.sym("v", n_x + n_z), ca.SX.sym("u", n_u)
    p, m = ca.SX.sym("p", len(program.parameters)), ca.SX.sym("m", len(program.memory))
    x, z = v[:n_x], v[n_x:]
    point = (t, x, z, u, p, m, h)
    rates, readings = program.rhs(*point)
    both = ca.densify(ca.vertcat(rates, program.residual(*point)))
    by_v, by_u = ca.jacobian(both, v), ca.jacobian(both, u)
    size = ca.fabs(by_v) @ ca.fabs(v) + ca.fabs(by_u) @ ca.fabs(u)
    size += ca.fabs(ca.jacobian(both, t) * t)
    arguments = law_arguments(program)(*point) if program.memory else ca.SX(0, 1)
    arguments_by_v = ca.jacobian(arguments, v)
    ins = [t, v, u, p, m, h]
    pieces = switches(both, ins, v, m)
    table: dict[str, list[Any]] = {
        "bg_rates": [both],
        "bg_newton": [both, by_v, size],
        "bg_readings": [readings],
        "bg_advance": [program.advance(*point)],
        "bg_arguments": [arguments, arguments_by_v],
        "bg_switches": [pieces],
    }
    functions = [
        ca.Function(name, ins, [ca.densify(ca.SX(o)) for o in outs], {"cse": True})
        for name, outs in table.items()
    ]
    moving = _structure(arguments, v).any(axis=1)
    known = ca.vertcat(u, x)
    lines = ca.Function("linear", ins, [ca.densify(by_v), ca.densify(by_u)])
    start = (0.0, [*program.start, *program.guess], [0.0] * n_u, program.nominal, program.virgin, 0)
    direct = (readings, rates)
    if n_z:  # through the unknowns everything may reach everything
        full = np.ones((max(readings.numel(), n_x), n_u + n_x), bool)
        patterns = [full[: o.numel()] for o in direct]
    else:
        patterns = [_structure(o, known) for o in direct]
    a, b = lines(*start)
    return Equations(
        _source(functions),
        (
            max(f.sz_arg() for f in functions),
            max(f.sz_res() for f in functions),
            max(f.sz_iw() for f in functions),
            max(f.sz_w() for f in functions),
        ),
        arguments.numel(),
        tuple(int(i) for i in np.flatnonzero(moving)),
        pieces.numel(),
        patterns[0],
        patterns[1],
        (np.asarray(a.full()), np.asarray(b.full())),
    )


def _structure(expression: Any, by: Any) -> np.ndarray:
    """Which entries of the Jacobian are not zero by structure."""
    found = np.zeros((expression.numel(), by.numel()), bool)
    pattern = ca.jacobian(expression, by).sparsity()
    rows, columns = pattern.get_triplet()
    found[rows, columns] = True
    return found


def _source(functions: list[ca.Function]) -> str:
    generator = ca.CodeGenerator("equations.c", {"with_header": False, "main": False})
    for function in functions:
        generator.add(function)
    # one translation unit holds everything, so that two units may be linked together
    return "#define CASADI_SYMBOL_EXPORT static\n" + str(generator.dump())
