"""BondGraph -> Program."""

from __future__ import annotations

import casadi as ca
import sympy as sp

from bondgraph.backend import CASADI
from bondgraph.elements import symbol
from bondgraph.equations import LawPort, StateSpace, derive
from bondgraph.graph import BondGraph
from bondgraph.laws.law import Law, split
from bondgraph.printing import to_casadi
from bondgraph.program import LawCall, Program, Step

__all__ = ["program"]


def program(graph: BondGraph) -> Program:
    """Derive `graph` and return its executable form."""
    return _from_space(derive(graph))


def law_functions(law: Law, n_q: int) -> tuple[ca.Function, ca.Function]:
    """Return ``(s, m, q, h) -> deviation`` and ``(s, m, q, h) -> memory``."""
    s, h = ca.SX.sym("s"), ca.SX.sym("h")
    m, q = ca.SX.sym("m", law.n_memory), ca.SX.sym("q", n_q)
    arguments = (*split(q), h) if law.timed else split(q)
    value = ca.SX(law.deviation(CASADI, s, split(m), arguments))
    new = law.advance(CASADI, s, split(m), arguments) if law.n_memory else ()
    column = ca.vertcat(*new) if new else ca.SX(0, 1)
    return (
        ca.Function("value", [s, m, q, h], [value], ["s", "m", "q", "h"], ["w"]),
        ca.Function("advance", [s, m, q, h], [column], ["s", "m", "q", "h"], ["m_next"]),
    )


def _from_space(space: StateSpace) -> Program:
    laws: list[LawCall] = []
    memory: list[str] = []
    virgin: list[float] = []
    for port in space.laws:
        value, advance = law_functions(port.law, len(port.parameters))
        at = len(memory)
        memory += [f"{port.element}_m{i}" for i in range(port.law.n_memory)]
        virgin += port.law.initial_memory(0.0)
        laws.append(
            LawCall(
                port.element,
                port.law,
                port.argument,
                sp.S.Zero,
                slice(at, len(memory)),
                port.parameters,
                value,
                advance,
            )
        )
    steps = _steps(space)
    names = {
        "x": [str(s.symbol) for s in space.states],
        "u": [str(u) for u in space.inputs],
        "p": list(space.parameters),
    }
    t, h = ca.SX.sym("t"), ca.SX.sym("h")
    x, u, p = (ca.SX.sym(k, len(v)) for k, v in names.items())
    z, m = ca.SX.sym("z", 0), ca.SX.sym("m", len(memory))
    table = {s.symbol: x[i] for i, s in enumerate(space.states)}
    table |= {s: u[i] for i, s in enumerate(space.inputs)}
    table |= {q.symbol: p[i] for i, q in enumerate(space.parameters.values())}
    position = {n: i for i, n in enumerate(space.parameters)}
    new_memory = []
    for step in steps:
        if step.law is None:
            table[symbol(step.target)] = to_casadi(step.expression, table)
            continue
        call = laws[step.law]
        q = ca.vertcat(*[p[position[n]] for n in call.parameters])
        s = to_casadi(call.argument, table)
        table[symbol(step.target)] = call.value(s, m[call.memory], q, h)
        new_memory.append((call.memory.start, call.advance(s, m[call.memory], q, h)))
    rates = tuple(s.rate for s in space.states)
    readings = tuple(y for _, y, _ in space.outputs)
    out = [ca.vertcat(*[to_casadi(e, table) for e in es]) for es in (rates, readings)]
    kept = ca.vertcat(*[v for _, v in sorted(new_memory, key=lambda item: item[0])])
    ins, labels = [t, x, z, u, p, m, h], ["t", "x", "z", "u", "p", "m", "h"]
    units = {str(s.symbol): s.unit for s in space.states}
    units |= {n: q.unit for n, q in space.parameters.items()}
    units |= {n: unit for n, _, unit in space.outputs}
    return Program(
        name=space.name,
        states=tuple(names["x"]),
        algebraic=(),
        inputs=tuple(names["u"]),
        parameters=tuple(names["p"]),
        memory=tuple(memory),
        outputs=space.output_names,
        input_rates=(),
        units=units,
        nominal=tuple(q.value for q in space.parameters.values()),
        start=(0.0,) * len(names["x"]),
        guess=(),
        virgin=tuple(virgin),
        steps=steps,
        laws=tuple(laws),
        rates=rates,
        readings=readings,
        residuals=(),
        rhs=ca.Function("rhs", ins, [ca.densify(v) for v in out], labels, ["dx", "y"]),
        residual=ca.Function("residual", ins, [ca.SX(0, 1)], labels, ["g"]),
        advance=ca.Function("advance", ins, [ca.densify(ca.SX(kept))], labels, ["m_next"]),
    )


def _steps(space: StateSpace) -> tuple[Step, ...]:
    pending: list[LawPort] = list(space.laws)
    steps: list[Step] = []
    known: set[sp.Symbol] = set()
    targets = {a.target for a in space.assignments} | {port.w for port in space.laws}

    def ready(expression: sp.Expr) -> bool:
        return not (expression.free_symbols & targets - known)

    def call_ready() -> None:
        for port in list(pending):
            if ready(port.argument):
                pending.remove(port)
                steps.append(
                    Step(str(port.w), None, space.laws.index(port), f"law of {port.element}")
                )
                known.add(port.w)

    call_ready()
    for a in space.assignments:
        steps.append(Step(str(a.target), a.expression, None, a.reason))
        known.add(a.target)
        call_ready()
    return tuple(steps)
