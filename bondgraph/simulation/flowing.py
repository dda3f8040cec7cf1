"""Memories that obey a differential equation in time, as states of a program.

The rate of such a memory is that of `Law.advance` at a step of zero, with what it keeps of the last
argument put equal to the argument. What remains a memory is replaced once a step is accepted.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from bondgraph.equations.program import Program
from bondgraph.simulation.radau.memory import arguments_of


def flowing(program: Program) -> Program:
    """Return `program` with the memories of laws that claim `flows` as further states.

    The same program where no law does, or where another law needs the time since its memory: a
    program has one such time for all. The memory vector keeps its length and its order.
    """
    timed = [c for c in program.laws if c.law.timed]
    if not timed or not all(c.law.flows for c in timed):
        return program
    t, x, z, u, p, m, h = (ca.SX.sym(n, *program.rhs.size_in(n)) for n in program.rhs.name_in())
    s = arguments_of(program)(t, ca.vertcat(x, z), u, p, m, 0.0)[0]
    kept = [c for c in program.laws if c.law.n_memory]
    rows, rates = [], []
    for j, call in enumerate(kept):
        if call.law.flows:
            own, slopes = rates_of(call.advance)
            rows += [call.memory.start + i for i in own]
            q = ca.vertcat(*[p[program.parameters.index(n)] for n in call.parameters])
            rates.append(slopes(s[j], m[call.memory], q))
    n, state = len(program.states), ca.SX.sym("x", len(program.states) + len(rows))
    whole = ca.SX(m)
    whole[rows] = state[n:]
    inside = (t, state[:n], z, u, p, whole, 0.0)
    moved = ca.substitute([ca.vertcat(*rates)], [x, m], [state[:n], whole])[0]
    ins, labels = [t, state, z, u, p, m, h], program.rhs.name_in()
    dx, y = program.rhs(*inside)
    return replace(
        program,
        model=None,
        states=(*program.states, *(program.memory[i] for i in rows)),
        start=(*program.start, *(program.virgin[i] for i in rows)),
        rhs=ca.Function("rhs", ins, [ca.vertcat(dx, moved), y], labels, ["dx", "y"]),
        residual=ca.Function("residual", ins, [program.residual(*inside)], labels, ["g"]),
        advance=ca.Function("advance", ins, [program.advance(*inside)], labels, ["m_next"]),
    )


def rates_of(advance: ca.Function) -> tuple[list[int], ca.Function]:
    """Return which entries of a memory flow, and ``(s, m, q) -> their rates``."""
    s, m, q, h = (ca.SX.sym(n, *advance.size_in(n)) for n in advance.name_in())
    after = ca.vertsplit(advance(s, m, q, h))
    last = [i for i, new in enumerate(after) if ca.is_equal(new, s)]
    own = [i for i in range(len(after)) if i not in last]
    slope = ca.jacobian(ca.vertcat(*[after[i] for i in own]), h)
    for i in last:
        slope = ca.substitute(slope, m[i], s)
    slope = ca.substitute(slope, h, 0.0)
    return own, ca.Function("rates", [s, m, q], [ca.densify(slope)])
