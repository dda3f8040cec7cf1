"""Storages in derivative causality, solved where their constraint is one scalar law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from bondgraph.equations.relation import LawUse
from bondgraph.graph.elements import C, I, symbol

if TYPE_CHECKING:
    from bondgraph.equations.relation import Dependent
    from bondgraph.equations.state_space import _Derivation


def eliminate(d: _Derivation, dependent: Dependent) -> None:
    """Eliminate a dependent storage from the assignments collected in `d`.

    Raises
    ------
    DerivativeCausality
        More than one scalar equation would be needed.
    """
    from bondgraph.equations.state_space import DerivativeCausality, State

    e = d.graph[dependent.element]

    def refuse(why: str) -> DerivativeCausality:
        return DerivativeCausality(
            f"{d.graph.name}: {e.kind} {e.name} has derivative causality ({why}); put a resistance "
            f"in series (or a compliance in parallel) with {e.name} so that it can store freely"
        )

    if not isinstance(e, C | I):
        raise refuse("it is one port of a field")
    relation = d.made.found[dependent.stored]
    effort, flow = symbol(relation.terms[-1][1]), symbol(dependent.rate)
    inertia = isinstance(e, I)
    stiffness = 1 / d.graph.coefficient(e) if inertia else d.graph.coefficient(e)
    closed = _closed(d)
    imposed = closed.get(effort)
    if imposed is None or flow in imposed.free_symbols:
        raise refuse(f"its {'flow' if inertia else 'effort'} is not a function of the states")
    # which stores does its flow drive, and how strongly
    shift: dict[sp.Symbol, sp.Expr] = {}
    for i, s in enumerate(d.states):
        rate = sp.expand(s.rate.xreplace(closed))
        c = rate.coeff(flow)
        if flow in (rate - c * flow).free_symbols or c.free_symbols - _parameters(d):
            raise refuse("its flow enters the rates nonlinearly")
        if c == 0:
            d.states[i] = State(s.symbol, _without(d, s.rate, rate, flow), s.element, s.unit)
        else:
            rest = sp.expand(rate - c * flow)
            z = symbol(f"z_{s.symbol}")
            shift[s.symbol] = c
            d.states[i] = State(z, rest, s.element, s.unit)
    q = symbol(dependent.stored)
    d.derivatives[flow] = dependent.stored
    if not shift:
        if e.law is not None:
            raise refuse("a source imposes its effort, and its law would have to be inverted")
        given = "flow" if inertia else "effort"
        why = f"{e.kind} {e.name} in derivative causality: its {given} is imposed"
        d.assign(q, imposed / stiffness, why)
        return
    moved = {s: symbol(f"z_{s}") + c * q for s, c in shift.items()}
    effort_of_z = sp.expand(imposed.xreplace(moved))
    beta = -effort_of_z.coeff(q)
    a = sp.expand(effort_of_z + beta * q)
    if q in a.free_symbols or beta == 0:
        raise refuse("its constraint is not a scalar law")
    for x in [v for v in a.free_symbols if str(v).startswith("w_")]:
        raise refuse(f"a nonlinear law ({x}) takes part in the constraint")
    first = _first_integrals(d, closed, {symbol(f"z_{s}") for s in shift})
    a, moved = a.xreplace(first), {s: v.xreplace(first) for s, v in moved.items()}
    slope = stiffness
    level = "momenta" if inertia else "displacements"
    why = f"{e.kind} {e.name} in derivative causality, solved at the level of {level}"
    free = symbol(f"a_{e.name}")
    d.assign(free, a, f"{why}: effort at zero displacement")
    if e.law is None:
        d.assign(q, free / (beta + slope), why)
    else:
        # the implicit step solves s = q(w), w = law(s): the operator (I + C H)^-1 with C = 1/beta
        names = tuple(p.name for p in e.law.parameters(e.name))
        w = d.law_port(LawUse(e.name, "storage", e.law, str(q), slope, names))
        shown = sp.Function(f"{e.name}_loop_inverse")(sp.expand(a / beta))
        d.assign(q, (free - w) / (beta + slope), why, shown)
    d.assign(effort, free - beta * q, why)
    for s, v in moved.items():
        d.assign(s, v, why)


def _without(d: _Derivation, rate: sp.Expr, closed_rate: sp.Expr, flow: sp.Symbol) -> sp.Expr:
    """Return the rate as it is, or closed where `flow` only cancels in it."""
    return closed_rate if depends(d, rate, flow) else rate


def depends(d: _Derivation, expression: sp.Expr, flow: sp.Symbol) -> bool:
    """Whether `flow` is met on the way from `expression` through the assignments."""
    seen: set[sp.Symbol] = set()
    ahead = set(expression.free_symbols)
    while ahead:
        s = ahead.pop()
        if s == flow:
            return True
        seen.add(s)
        if s in d.found:
            ahead |= d.found[s].expression.free_symbols - seen
    return False


def displacement_of_dependents(d: _Derivation, flow: sp.Symbol) -> sp.Expr | None:
    """Return the displacements of dependent stores whose rate is `flow` identically, if any."""
    rest = sp.expand(_closed(d).get(flow, flow))
    total: sp.Expr = sp.Integer(0)
    for dependent, name in d.derivatives.items():
        c = rest.coeff(dependent)
        if c.free_symbols - _parameters(d):
            return None
        if c != 0 and not name.startswith("q_"):
            return None
        total, rest = total + c * symbol(name), sp.expand(rest - c * dependent)
    return total if rest == 0 and total != 0 else None


def drop_derivatives(d: _Derivation) -> None:
    """Leave out the signals that need the flow of a dependent storage: nothing needs them.

    Raises
    ------
    DerivativeCausality
        A sensor reads such a signal.
    """
    from bondgraph.equations.state_space import DerivativeCausality

    for flow, name in d.derivatives.items():
        for reader, reading, _ in d.outputs:
            if depends(d, reading, flow):
                e = d.graph[reader]
                raise DerivativeCausality(
                    f"{d.graph.name}: {e.kind} {reader} reads a signal that needs the flow of "
                    f"{name[2:]}, which has derivative causality, so the reading would be a "
                    f"derivative; put a resistance in series with {name[2:]} or remove {reader}"
                )
        for state in d.states:
            if any(depends(d, s, flow) for s in state.rate.free_symbols):
                raise DerivativeCausality(
                    f"{d.graph.name}: state {state.symbol} of {state.element} needs the flow of "
                    f"{name[2:]}, which has derivative causality; put a resistance in series"
                )
        d.found = {t: a for t, a in d.found.items() if not depends(d, t, flow)}


def _parameters(d: _Derivation) -> set[sp.Symbol]:
    return {p.symbol for p in d.graph.parameters.values()}


def _closed(d: _Derivation) -> dict[sp.Symbol, sp.Expr]:
    """Return the signals, in closed form, that can be had without the dependent storage."""
    closed: dict[sp.Symbol, sp.Expr] = {}
    progress = True
    while progress:
        progress = False
        for t, a in d.found.items():
            if t not in closed and not any(
                s in d.found and s not in closed for s in a.expression.free_symbols
            ):
                closed[t] = sp.expand(a.expression.xreplace(closed))
                progress = True
    return closed


def _first_integrals(
    d: _Derivation, closed: dict[sp.Symbol, sp.Expr], zs: set[sp.Symbol]
) -> dict[sp.Symbol, sp.Expr]:
    """``z = c x`` where the rates are proportional: the charge that only the motion moves."""
    found: dict[sp.Symbol, sp.Expr] = {}
    for s in list(d.states):
        if s.symbol not in zs:
            continue
        for other in d.states:
            if other.symbol in zs:
                continue
            rate = sp.expand(other.rate.xreplace(closed))
            ratio = _ratio(s.rate, rate, _parameters(d))
            if ratio is not None:
                found[s.symbol] = ratio * other.symbol
                d.states.remove(s)
                break
    return found


def _ratio(a: sp.Expr, b: sp.Expr, parameters: set[sp.Symbol]) -> sp.Expr | None:
    """Return ``a / b`` of two rates linear in the signals, if only parameters are left in it.

    Numbers decide first: cancelling long quotients that are not constant takes minutes.
    """
    signals = sorted(b.free_symbols - parameters, key=str)
    if not signals or a.free_symbols - parameters != set(signals):
        return None
    fixed = sorted((a.free_symbols | b.free_symbols) & parameters, key=str)
    values = {s: sp.Float(0.6 + 0.7 * i / (1 + len(fixed)), 30) for i, s in enumerate(fixed)}
    u, v = a.xreplace(values), b.xreplace(values)
    first = sp.expand(u).coeff(signals[0]), sp.expand(v).coeff(signals[0])
    for s in signals[1:]:
        other = sp.expand(u).coeff(s), sp.expand(v).coeff(s)
        products = first[0] * other[1], first[1] * other[0]
        if abs(products[0] - products[1]) > 1e-15 * abs(products[0]):
            return None
    return sp.cancel(a.coeff(signals[0]) / b.coeff(signals[0]))
