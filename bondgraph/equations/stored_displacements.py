"""Positions that stores already know: which stored displacements integrate a given flow."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp

from bondgraph.equations.bond_signals import SignalNames
from bondgraph.equations.relation import Relation, Relations, StoredState

MOST_DISPLACEMENTS = 12


def place_displacements(made: Relations) -> None:
    """Read stored displacements that already integrate the flow of a sensor, or add a state."""
    names = SignalNames(made.graph)
    for e in made.displacements:
        flow, target = names.at("f", made.graph.neighbour(e.name)), f"x_{e.name}"
        terms = stored_displacements(made, flow)
        if terms is None:
            state = f"q_{e.name}"
            made.states.append(StoredState(state, flow, e.name, e.unit))
            terms = ((1, state),)
        made.found[target] = Relation(target, terms, f"displacement at {e.name}")


def stored_displacements(made: Relations, flow: str) -> tuple[tuple[Any, str], ...] | None:
    """Return stored displacements whose rates sum to `flow` identically, if there are any.

    Works in the linear relations with constant coefficients near the sensor only; the unknown
    combination follows from a small exact linear solve.
    """
    stores = {s.rate: s.name for s in reversed(made.states) if s.name.startswith("q_")}
    stores |= {d.rate: d.stored for d in made.dependents if d.stored.startswith("q_")}
    if flow in stores:
        return ((1, stores[flow]),)
    near = list(_near(made, flow, stores))
    if not 0 < len(near) <= MOST_DISPLACEMENTS:
        return None
    leaves: dict[str, dict[str, sp.Expr]] = {}

    def form(name: str, depth: int = 0) -> dict[str, sp.Expr]:
        if name in leaves:
            return leaves[name]
        r = made.found.get(name)
        plain = (
            r is not None
            and not r.implicit
            and r.law is None
            and r.expression is None
            and not r.reads
            and depth < 40
        )
        if not plain or r is None:
            leaves[name] = {name: sp.S.One}
            return leaves[name]
        leaves[name] = {name: sp.S.One}  # a loop reads itself: a leaf then
        total: dict[str, sp.Expr] = {}
        for c, s in r.terms:
            for leaf, k in form(s, depth + 1).items():
                total[leaf] = total.get(leaf, sp.S.Zero) + c * k
        leaves[name] = total
        return total

    columns = [form(n) for n in near]
    wanted = form(flow)
    rows = sorted({leaf for f in (*columns, wanted) for leaf in f})
    unknown = [sp.Dummy() for _ in near]
    equations = []
    for leaf in rows:
        balance = wanted.get(leaf, sp.S.Zero)
        for c, f in zip(unknown, columns, strict=True):
            balance -= c * f.get(leaf, sp.S.Zero)
        equations.append(balance)
    solution = sp.linsolve(equations, unknown)
    if not solution or solution is sp.S.EmptySet:
        return None
    (values,) = solution
    if any(v.free_symbols & set(unknown) for v in values):
        return None
    found = [
        (sp.cancel(v), stores[n]) for n, v in zip(near, values, strict=True) if sp.cancel(v) != 0
    ]
    return tuple(found) or None


def _near(made: Relations, flow: str, stores: Mapping[str, str]) -> Iterable[str]:
    """Rates of displacements connected to `flow` by flow relations alone."""
    neighbours: dict[str, set[str]] = {}
    for r in made.found.values():
        if not r.target.startswith("f_"):
            continue
        for _, s in r.terms:
            if s.startswith("f_"):
                neighbours.setdefault(r.target, set()).add(s)
                neighbours.setdefault(s, set()).add(r.target)
    seen, ahead = {flow: None}, deque([flow])
    near: list[str] = []
    while ahead and len(near) < MOST_DISPLACEMENTS:
        for n in sorted(neighbours.get(ahead.popleft(), ())):
            if n not in seen:
                seen[n] = None
                ahead.append(n)
                if n in stores:
                    near.append(n)
    return near
