"""Storages in derivative causality without a derivative: coordinates that their flows do not move.

The flow ``f_D`` of a dependent storage drives some stores; ``z = q - c q_D`` of those no longer
contains ``f_D``. What is left is ``law_D(q_D) = a - beta q_D``, one scalar equation a storage: for
an operator with memory ``q_D = (I + C H)^-1 [C a]``. Inputs need no rate and laws no derivative:
the form for laws with memory, and for the exact step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import sympy as sp

from bondgraph.equations.ordering import components, reached
from bondgraph.equations.refusals import DerivativeCausality, NotLinearUpToLaws
from bondgraph.equations.relation import Dependent, Relation, Relations, StoredState, readers_in
from bondgraph.graph.elements import C, I
from bondgraph.graph.parameter import symbol

ONE = symbol("one")
MOST_DEPENDENT = 3  # the closed forms of more grow beyond use

Forms = Mapping[sp.Symbol, sp.Expr]


def displaced(made: Relations) -> Relations:
    """Return relations in coordinates in which no storage is dependent.

    Parameters
    ----------
    made : Relations
        With its displacements placed, see `stored_displacements.place_displacements`.

    Raises
    ------
    DerivativeCausality
        More than one scalar equation a storage would be needed, or a signal that is read needs the
        flow of one.
    NotLinearUpToLaws
        A relation multiplies or transforms signals.
    """
    if len(made.dependents) > MOST_DEPENDENT:
        names = ", ".join(made.causality.derivative)
        raise DerivativeCausality(
            f"{made.graph.name}: {names} have derivative causality, and more than {MOST_DEPENDENT} "
            "are not solved at once; put resistances in series with them (or merge them)"
        )
    new = _Displacing(made)
    for d in made.dependents:
        new.eliminate(d)
    new.drop_flows()
    return replace(
        made, found=new.found, states=new.states, laws=list(made.laws), dependents=[],
        inputs=list(made.inputs), displacements=[],
    )  # fmt: skip


class _Displacing:
    """Relations while their dependent storages are eliminated one by one."""

    def __init__(self, made: Relations) -> None:
        self.made, self.name = made, made.graph.name
        self.parameters = {p.symbol for p in made.graph.parameters.values()}
        dependent = {d.stored for d in made.dependents}
        self.found = {t: r for t, r in made.found.items() if t not in dependent}
        self.states = list(made.states)
        self.still: set[str] = set()

    def eliminate(self, d: Dependent) -> None:
        e = self.made.graph[d.element]

        def refuse(why: str) -> DerivativeCausality:
            return DerivativeCausality(
                f"{self.name}: {e.kind} {e.name} has derivative causality ({why}); put a "
                f"resistance in series (or a compliance in parallel) with {e.name} so that it can "
                "store freely"
            )

        if not isinstance(e, C | I):
            raise refuse("it is one port of a field")
        relation = self.made.found[d.stored]
        q, flow, effort = symbol(d.stored), symbol(d.rate), relation.terms[-1][1]
        inertia = isinstance(e, I)
        slope = self.made.graph.slope(e)
        closed, lost = self._closed(), self._needing(d.rate)
        moved_by = {f"w_{u.element}" for u in self.made.laws if u.argument in lost} | {d.rate}
        imposed = closed.get(symbol(effort))
        if imposed is None or moved_by & {str(s) for s in imposed.free_symbols}:
            raise refuse(f"its {'flow' if inertia else 'effort'} is not a function of the states")
        shift: dict[str, sp.Expr] = {}
        for i, s in enumerate(self.states):
            rate = sp.expand(closed.get(symbol(s.rate), symbol(s.rate)))
            c = rate.coeff(flow)
            if flow in (rate - c * flow).free_symbols or c.free_symbols - self.parameters:
                raise refuse("its flow enters the rates nonlinearly")
            if c != 0:
                shift[s.name] = c
                self._state(i, f"z_{s.name}", sp.expand(rate - c * flow))
            elif s.rate in lost and symbol(s.rate) in closed:  # it cancels in what it drives
                self._state(i, s.name, rate)
        if not shift:
            if e.law is not None:
                raise refuse("a source imposes its effort, and its law would have to be inverted")
            given = "flow" if inertia else "effort"
            why = f"{e.kind} {e.name} in derivative causality: its {given} is imposed"
            self._put(d.stored, imposed / slope, why)
            if imposed.free_symbols <= self.parameters | {ONE}:  # what stands still has no flow
                self._put(d.rate, sp.S.Zero, f"{why}, a constant")
                self.still.add(d.element)
            return
        moved = {s: symbol(f"z_{s}") + c * q for s, c in shift.items()}
        inserted = sp.expand(imposed.xreplace({symbol(s): v for s, v in moved.items()}))
        beta = -inserted.coeff(q)
        a = sp.expand(inserted + beta * q)
        if q in a.free_symbols or beta == 0:
            raise refuse("its constraint is not a scalar law")
        if laws := [str(v) for v in a.free_symbols if str(v).startswith("w_")]:
            raise refuse(f"a nonlinear law ({laws[0]}) takes part in the constraint")
        first = self._first_integrals(closed, {f"z_{s}" for s in shift})
        level = "momenta" if inertia else "displacements"
        why = f"{e.kind} {e.name} in derivative causality, solved at the level of {level}"
        free = f"a_{e.name}"
        self._put(free, a.xreplace(first), f"{why}: effort at zero displacement")
        if relation.law is None:
            self._put(d.stored, symbol(free) / (beta + slope), why)
        else:
            terms = ((beta + slope, d.stored), (-1, free))
            self.found[d.stored] = replace(relation, terms=terms, reason=why)
        self._put(effort, symbol(free) - beta * q, why)
        for store, value in moved.items():
            self._put(store, value.xreplace(first), why)

    def drop_flows(self) -> None:
        """Leave out the signals that need the flow of a storage that moves: nothing does."""
        for d in self.made.dependents:
            if d.element in self.still:
                continue
            lost = self._needing(d.rate)
            read = [(n, y) for n, y, _ in self.made.outputs]
            read += [(r.element, r.stored) for r in self.made.rates]
            for reader, reading in read:
                if reading in lost:
                    e = self.made.graph[reader]
                    raise DerivativeCausality(
                        f"{self.name}: {e.kind} {reader} reads a signal that needs the flow of "
                        f"{d.element}, which has derivative causality, so the reading would be a "
                        f"derivative; put a resistance in series with {d.element} or remove "
                        f"{reader}"
                    )
            for state in self.states:
                if state.rate in lost:
                    raise DerivativeCausality(
                        f"{self.name}: state {state.name} of {state.element} needs the flow of "
                        f"{d.element}, which has derivative causality; put a resistance in series"
                    )
            self.found = {t: r for t, r in self.found.items() if t not in lost}

    def _state(self, i: int, name: str, rate: sp.Expr) -> None:
        """Replace a state by one whose rate is given in closed form."""
        s = self.states[i]
        self.states[i] = StoredState(name, f"rate_{name}", s.element, s.unit)
        self._put(f"rate_{name}", rate, f"rate of {name}")

    def _put(self, target: str, value: sp.Expr, reason: str) -> None:
        """Take a closed form over as a relation; deviations in it become signals of their own."""
        value = sp.expand(value)
        signals = sorted(value.free_symbols - self.parameters - {ONE}, key=str)
        terms = []
        for s in signals:
            terms.append((value.coeff(s), str(s)))
            if str(s).startswith("w_") and str(s) not in self.found:
                self._name_deviation(str(s))
        rest = value.xreplace({**dict.fromkeys(signals, sp.S.Zero), ONE: sp.S.One})
        self.found[target] = Relation(target, tuple(terms), reason, rest if rest != 0 else None)

    def _name_deviation(self, name: str) -> None:
        for r in list(self.found.values()):
            if r.law is not None and name == f"w_{self.made.laws[r.law].element}":
                use = self.made.laws[r.law]
                why = f"law of {use.element}"
                self.found[name] = Relation(name, (), why, law=r.law, reads=(use.argument,))
                self.found[r.target] = replace(r, terms=(*r.terms, (1, name)), law=None)

    def _needing(self, flow: str) -> set[str]:
        """Return `flow` and what is met on the way from it through the relations."""
        return reached([flow], readers_in(self.found.values()))

    def _closed(self) -> dict[sp.Symbol, sp.Expr]:
        """Return the signals, in closed form, that can be had without solving a loop."""
        closed: dict[sp.Symbol, sp.Expr] = {}
        open_: set[str] = set()

        def reads(name: str) -> list[str]:
            r = self.found[name]
            return [s for s in r.sources if s in self.found and not (r.implicit and s == name)]

        for part in components(self.found, reads):
            name = part[0]
            if len(part) > 1 or name in reads(name) or any(s in open_ for s in reads(name)):
                open_.update(part)
                continue
            closed[symbol(name)] = sp.expand(self._value(self.found[name]).xreplace(closed))
        return closed

    def _value(self, r: Relation) -> sp.Expr:
        """Return what a relation gives, linear in signals and deviations."""
        use = None if r.law is None else self.made.laws[r.law]
        if any(s != (use and use.argument) for s in r.reads) or (r.implicit and use is None):
            raise NotLinearUpToLaws(f"{self.name}: {r.reason} multiplies or transforms signals")
        value = sp.Add(*(c * symbol(s) for c, s in r.terms))
        if r.expression is not None:
            value += r.expression * ONE
        if use is not None:
            value += symbol(f"w_{use.element}")
        if r.implicit:
            value = symbol(r.target) - value / value.coeff(symbol(r.target))
        return value

    def _first_integrals(self, closed: Forms, zs: set[str]) -> dict[sp.Symbol, sp.Expr]:
        """``z = c x`` where the rates are proportional: the charge that only the motion moves."""
        found: dict[sp.Symbol, sp.Expr] = {}
        for s in [s for s in self.states if s.name in zs]:
            own = self._value(self.found[s.rate])
            for other in self.states:
                if other.name in zs:
                    continue
                rate = sp.expand(closed.get(symbol(other.rate), symbol(other.rate)))
                ratio = _ratio(own, rate, self.parameters)
                if ratio is not None:
                    found[symbol(s.name)] = ratio * symbol(other.name)
                    self.states.remove(s)
                    del self.found[s.rate]
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
