"""What SUNDIALS is given of a program: a step, the unknowns of a state, the turns of arguments.

Time runs from 0 to 1 within a step; states and algebraic unknowns are measured in their own size (a
charge of 1e-6 C beside a field of 1e5 V/m), so that one tolerance serves all.
"""

from __future__ import annotations

from typing import Any, Final

import casadi as ca
import numpy as np

from bondgraph.equations.program import LawCall, Program
from bondgraph.simulation.radau.memory import arguments_of
from bondgraph.support.arrays import Array

SOLVED: Final = 1e-12
"""Correction of an algebraic unknown over its size, below which it is solved."""
GRID: Final = np.arange(1, 9) / 8
"""Parts of a step at which turns are looked for."""
MOST_STEPS: Final = 100_000
"""Between two accepted ones."""


def unknowns_of(program: Program, size: Array) -> ca.Function:
    """Return ``(t, x, z_guess, u, p, m, h) -> z``, without a line search.

    A guess is an accepted value, where plays have a corner: CasADi's line search, which asks for
    half of what the slope there promises, ends there.
    """
    v = [ca.SX.sym(n, *program.rhs.size_in(n)) for n in program.rhs.name_in()]
    own = size[len(program.states) :]
    given = ca.vertcat(*v[:2], *v[3:])
    problem = {"x": v[2], "p": given, "g": program.residual(*v[:2], own * v[2], *v[3:])}
    options = {"line_search": False, "abstol": 0.0, "abstolStep": SOLVED, "max_iter": 100}
    w = [ca.MX.sym(n, *program.rhs.size_in(n)) for n in program.rhs.name_in()]
    z: Any = w[2]
    if own.size:
        solver = ca.rootfinder("unknowns", "newton", problem, options)
        z = own * solver(x0=z / own, p=ca.vertcat(*w[:2], *w[3:]))["x"]
    return ca.Function("unknowns", w, [z])


def integrator_of(program: Program, plugin: str, size: Array, tolerance: float) -> ca.Function:
    """Return a step over local time, states and unknowns in their own size, at every `GRID`."""
    n_x, n_z = len(program.states), len(program.algebraic)
    # at a turn Newton's method of IDAS has two slopes to choose from, and no line to its solution
    solved = plugin == "cvodes" or any(not c.law.timed for c in kept_laws(program))
    kind: Any = ca.MX if n_z and solved else ca.SX
    shapes = {n: program.rhs.size_in(n) for n in program.rhs.name_in()}
    t, x, z, u, p, m, length = (kind.sym(n, *s) for n, s in shapes.items())
    last, part, guess = kind.sym("u1", *shapes["u"]), kind.sym("part"), kind.sym("z0", n_z)
    since = part * length
    at, now = (t + since, size[:n_x] * x), (u + (last - u) * part, p, m, since)
    problem = {"t": part, "x": x, "p": ca.vertcat(t, length, u, last, p, m, guess)}
    inner = size[n_x:] * z
    if kind is ca.MX:
        inner = unknowns_of(program, size)(*at, guess, *now)
    elif n_z:
        problem |= {"z": z, "alg": program.residual(*at, inner, *now)}
    problem["ode"] = length * program.rhs(*at, inner, *now)[0] / size[:n_x]
    options = {
        "abstol": tolerance, "reltol": tolerance, "max_num_steps": MOST_STEPS,
        "disable_internal_warnings": True, "show_eval_warnings": False,
    }  # fmt: skip
    if plugin == "idas":  # their slope is not known at the start; they follow from the states
        options["suppress_algebraic"] = True
    return ca.integrator("accepted", plugin, problem, 0.0, GRID, options)


def turning_of(base: Program, program: Program) -> ca.Function | None:
    """Return ``(t, x, z, u, p, m, h, du/dt) -> (ds/dt, ds/dv)`` of laws that must see every turn.

    They are those with a memory of the argument alone; None without any. `base` is the program
    before it was made `flowing`; v are its states and algebraic unknowns.
    """
    at = [i for i, c in enumerate(kept_laws(base)) if not c.law.timed]
    if not at:
        return None
    v = t, x, z, u, p, m, h = [ca.SX.sym(n, *program.rhs.size_in(n)) for n in program.rhs.name_in()]
    du, whole, n = ca.SX.sym("du", u.numel()), ca.SX(m), len(base.states)
    if flows := [program.memory.index(name) for name in program.states[n:]]:
        whole[flows] = x[n:]  # CasADi takes no empty list for an index
    inside = (t, ca.vertcat(x[:n], z), u, p, whole, 0.0 if program is not base else h)
    found, g = arguments_of(base)(*inside), program.residual(*v)
    s = found[0][at]
    moving = ca.vertcat(t, x, u, h)
    rates = ca.vertcat(1.0, program.rhs(*v)[0], du, 1.0)
    total = ca.jtimes(s, moving, rates)
    if z.numel():
        followed = ca.solve(ca.jacobian(g, z), -ca.jtimes(g, moving, rates))
        total += ca.jtimes(s, z, followed)
    return ca.Function("turning", [*v, du], [ca.densify(total), found[1][at, :]])


def kept_laws(program: Program) -> list[LawCall]:
    """Return the laws that have a memory."""
    return [c for c in program.laws if c.law.n_memory]
