"""Proof, element by element, that the derived equations of junctions and two-ports keep power."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from bondgraph.causality.assignment import Causality, assign_causality
from bondgraph.energy.bond_values import power_bonds
from bondgraph.energy.definiteness import vanishes
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.equations.relation import Relations
from bondgraph.equations.relations import collect
from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import GY, RE, RS, TF, Element, Junction, TwoPort, Zero
from bondgraph.graph.parameter import symbol
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.support.errors import unknown_name


@dataclass(frozen=True, slots=True)
class PowerProof:
    """Sum of the powers into one element, for any signals.

    Attributes
    ----------
    element, kind : str
    power : sympy.Expr
        Sum of ``e f`` over all ports, positive inwards, before the element's equations are used.
    remainder : sympy.Expr
        The same after they are used: zero if the element keeps power.
    claim : str
        ``conserves``, ``dissipates`` (a reaction) or ``signal`` (heat that no bond carries).
    """

    element: str
    kind: str
    power: sp.Expr
    remainder: sp.Expr
    claim: str = "conserves"

    @property
    def holds(self) -> bool:
        """Whether the remainder is what the claim says: zero, if power is conserved."""
        return self.claim != "conserves" or vanishes(self.remainder)


@dataclass(frozen=True)
class PowerBalance:
    """One proof for every junction and two-port."""

    name: str
    proofs: tuple[PowerProof, ...]

    @property
    def holds(self) -> bool:
        """Whether all of them hold."""
        return all(p.holds for p in self.proofs)

    def __getitem__(self, element: str) -> PowerProof:
        """Proof by element."""
        for p in self.proofs:
            if p.element == element:
                return p
        known = [p.element for p in self.proofs]
        raise unknown_name("junction or two-port", element, self.name, known)

    def __str__(self) -> str:
        """One line an element."""
        return "\n".join(
            f"{p.element} ({p.kind}): {p.power} = {p.remainder}"
            + ("" if p.claim == "conserves" else f"    ({p.claim})")
            for p in self.proofs
        )


def power_balance(graph: BondGraph) -> PowerBalance:
    """Prove that no junction and no two-port makes or loses power, whatever the signals.

    The equations put in are those that the model is derived from, of that element alone; they
    hold for any ratio, modulated or not. A reaction (RE) loses power by its nature; the power an
    RS takes leaves as heat, and ``e f`` of its thermal bond is power only with ``heat="entropy"``.

    Examples
    --------
    >>> from bondgraph import TF, BondGraph, I, One, R, Se
    >>> with BondGraph("gear") as g:
    ...     motor = One("motor")
    ...     _ = Se("tau") >> motor >> TF("n", ratio=3.0) >> One("load") >> I("J", 1.0)
    ...     _ = motor >> R("b", 0.1)
    ...     _ = g["load"] >> R("d", 0.1)
    >>> print(power_balance(g)["n"])  # doctest: +ELLIPSIS
    PowerProof(element='n', kind='TF', power=e_motor_n*f_motor - e_n_load*f_load, remainder=0, ...
    """
    graph = in_mode(graph)
    causality = assign_causality(graph)
    made = collect(graph, causality)
    names = SignalNames(graph)
    proofs = []
    for e in graph.elements.values():
        if isinstance(e, Junction | TwoPort):
            proofs.append(_proof(graph, made, names, causality, e))
    return PowerBalance(graph.name, tuple(proofs))


def _proof(
    graph: BondGraph, made: Relations, names: SignalNames, causality: Causality, e: Element
) -> PowerProof:
    here = [b for b in power_bonds(graph) if e.name in (b.tail, b.head)]
    power = sp.Add(
        *(
            (1 if b.head == e.name else -1) * symbol(names.effort(b)) * symbol(names.flow(b))
            for b in here
        )
    )
    remainder = power
    for target in _targets(names, causality, e, here):
        r = made.found.get(target)
        if r is not None:
            value = sp.Add(*(sp.Mul(c, symbol(s)) for c, s in r.terms), r.expression or 0)
            remainder = remainder.xreplace({symbol(target): value})
    remainder = sp.expand(remainder)
    claim = "conserves"
    if isinstance(e, RE):
        claim = "dissipates"
    elif isinstance(e, RS) and e.heat == "energy":
        claim = "signal"
    if claim == "conserves" and vanishes(remainder):
        remainder = sp.S.Zero
    return PowerProof(e.name, e.kind, power, remainder, claim)


def _targets(names: SignalNames, causality: Causality, e: Element, here: list[Bond]) -> list[str]:
    """Return the signals that the equations of this element determine."""

    def effort_in(b: Bond) -> bool:
        return causality.strokes[b].effort_to == e.name

    if isinstance(e, Junction):
        zero = isinstance(e, Zero)
        (strong,) = (b for b in here if effort_in(b) == zero)
        return [names.flow(strong) if zero else names.effort(strong)]
    into, out = sorted(here, key=lambda b: b.tail == e.name)
    e1, f1, e2, f2 = names.effort(into), names.flow(into), names.effort(out), names.flow(out)
    if isinstance(e, TF):
        return [e2, f1] if effort_in(into) else [e1, f2]
    if isinstance(e, GY):
        return [f2, f1] if effort_in(into) else [e1, e2]
    # what leaves first: its equation may contain the other flow
    return [f2, f1 if effort_in(into) else e1]
