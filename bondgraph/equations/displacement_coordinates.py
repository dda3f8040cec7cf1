"""Systems in coordinates that need no derivative of a law: for dependent stores with memory.

A law with memory cannot be differentiated, so a dependent store that has one is solved at the level
of displacements, as `derive` does for simulation. Its states are ``z_q = q - c q_D`` and what is
left to be solved is one implicit equation a store.
"""

from __future__ import annotations

import sympy as sp

from bondgraph.equations.relation import LawUse, Relation, Relations, StoredState
from bondgraph.equations.state_space import StateSpace
from bondgraph.graph.elements import symbol


def relations_of(space: StateSpace, made: Relations) -> Relations:
    """Return the relations of a derived state space, for `derivation` to order.

    Parameters
    ----------
    space : StateSpace
        As `derive` returns it.
    made : Relations
        What it was collected from: inputs, outputs and second names are taken over.
    """
    known = {p.symbol for p in space.parameters.values()}
    found: dict[str, Relation] = {}

    def put(target: str, expression: sp.Expr, reason: str) -> None:
        signals = sorted(expression.free_symbols - known, key=str)
        terms = []
        for s in signals:
            slope = expression.diff(s)
            terms.append((slope, str(s)))
            expression = expression.xreplace({s: sp.S.Zero})
        rest = expression if expression != 0 else None
        found[target] = Relation(target, tuple(terms), reason, expression=rest)

    laws = []
    for port in space.laws:
        argument = f"s_{port.element}"
        put(argument, port.argument, f"argument of the law of {port.element}")
        laws.append(LawUse(port.element, port.role, port.law, argument, sp.S.Zero, port.parameters))
        found[str(port.w)] = Relation(
            str(port.w), (), f"law of {port.element}", law=len(laws) - 1, reads=(argument,)
        )
    for a in space.assignments:
        put(str(a.target), a.expression, a.reason)
    states = []
    for s in space.states:
        rate = f"rate_{s.symbol}"
        put(rate, s.rate, f"rate of {s.symbol}")
        states.append(StoredState(str(s.symbol), rate, s.element, s.unit))
    outputs = [(n, f"y_{n}", unit) for n, _, unit in space.outputs]
    for (_, target, _), (_, value, _) in zip(outputs, space.outputs, strict=True):
        if value != symbol(target):
            put(target, value, "reading")
    return Relations(
        made.graph,
        space.causality,
        found=found,
        states=states,
        inputs=[str(u) for u in space.inputs if str(u) not in space.recorded],
        outputs=outputs,
        laws=laws,
        aliases=dict(made.aliases),
        recorded=list(space.recorded),
    )
