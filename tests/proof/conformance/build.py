"""Case -> bond graph in the language of Bondsight."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import (
    GY,
    RE,
    TF,
    C,
    CField,
    Element,
    Field,
    I,
    MSe,
    MSf,
    One,
    R,
    RField,
    Se,
    Sf,
    Value,
    Zero,
)
from bondgraph.graph.modulation import effort, port_variables
from bondgraph.support.errors import UnusableInput
from tests.proof.conformance.case import SOURCES, Case, Part

_PLAIN: dict[str, type[Element]] = {"Se": Se, "Sf": Sf, "0": Zero, "1": One}
_VALUED = {"R": R, "C": C, "I": I}
_TWO_PORT = {"TF": TF, "GY": GY, "RE": RE}


@dataclass(frozen=True)
class Built:
    """A case as a graph, with the way back to the names of the case.

    Attributes
    ----------
    graph : BondGraph
    elements : dict
        Name in the case -> name in the graph; ``1a`` becomes ``j1a``.
    states : dict
        Name of a state of the graph -> name in the case.
    constants : dict
        Parameter of the graph that is a plain number in the case -> that number, exactly.
    """

    graph: BondGraph
    elements: dict[str, str]
    states: dict[str, str]
    constants: dict[str, sp.Expr]


def build(case: Case) -> Built:
    """Build the bond graph of a case.

    Sources with a constant become modulated sources of that constant, so that they are no inputs.
    A law of one port becomes a field of one port. Half arrows stay as they are, but those of a
    field all point into it: one that the source draws outwards is turned by a 0-junction.
    """
    return _Builder(case).run()


def identifiers(names: tuple[str, ...]) -> dict[str, str]:
    """Return identifiers for the names: ``1a`` -> ``j1a``, with ``_`` appended until it is new.

    Examples
    --------
    >>> identifiers(("1a", "r"))
    {'1a': 'j1a', 'r': 'r'}
    """
    found: dict[str, str] = {}
    for n in names:
        new = n if n.isidentifier() else f"j{n}"
        if not new.isidentifier():
            raise UnusableInput(f"element name {n!r} cannot be made an identifier; rename it")
        while new in found.values() or (new != n and new in names):
            new += "_"
        found[n] = new
    return found


class _Builder:
    def __init__(self, case: Case) -> None:
        self.case = case
        self.graph = BondGraph(case.identity)
        self.names = identifiers(tuple(p.name for p in case.parts))
        self.states: dict[str, str] = {}
        self.constants: dict[str, sp.Expr] = {}

    def run(self) -> Built:
        inputs = {self.names[n] for n in self.case.inputs}
        for p in self.case.parameters:
            if p in inputs:
                raise UnusableInput(f"{self.case.identity}: {p!r} is a source and a parameter")
            self.graph.parameter(p, self.case.values.get(p, 1.0))
        for part in self.case.parts:
            self.graph.add(self._element(part))
        for tail, head in self.case.bonds:
            a, b = self.graph[self.names[tail]], self.graph[self.names[head]]
            if isinstance(a, Field):
                turn = Zero(identifiers((f"{a.name}_turn", *self.graph.elements))[f"{a.name}_turn"])
                self.graph.bond(turn, a)
                a = turn
            self.graph.bond(a, b)
        for state, (element, port) in self.case.stores.items():
            part = self.case.part(element)
            ported = part.type == "CF" or part.law is not None
            letter, name = state[0], self.names[element]
            self.states[f"{letter}_{name}{port + 1}" if ported else f"{letter}_{name}"] = state
        return Built(self.graph, self.names, self.states, self.constants)

    def _element(self, p: Part) -> Element:
        name = self.names[p.name]
        if p.type in SOURCES and p.value is not None:
            return self._constant_source(name, p)
        if p.type in _PLAIN:
            return _PLAIN[p.type](name)
        if p.type == "MSe":
            tail, head = self.case.bonds[self.case.bond_between(p.of)]
            signal = effort(f"{self.names[tail]}>{self.names[head]}")
            return MSe(name, value=self._symbolic(p.value) * signal)
        if p.law is not None:
            return self._law_field(name, p)
        if p.type == "CF":
            n = self.case.ports(p.name)
            return CField(name, ports=n, energy=self._symbolic(p.energy))
        if p.type in _TWO_PORT:
            return _TWO_PORT[p.type](name, ratio=self._value(name, p.value))
        made: Element = _VALUED[p.type](name, self._value(name, p.value))
        return made

    def _law_field(self, name: str, p: Part) -> Element:
        letter, kind = ("q", CField) if p.type == "C" else ("f", RField)
        (port,) = port_variables(letter, 1)
        law = self._symbolic(p.law).xreplace({sp.Symbol(letter): port})
        return kind(name, ports=1, law=(law,))

    def _constant_source(self, name: str, p: Part) -> Element:
        kind = MSe if p.type == "Se" else MSf
        if p.value == 0:
            return kind(name, value=0.0)
        own = f"{name}_value"
        number = self._symbolic(p.value)
        self.constants[own] = number
        return kind(name, value=self.graph.parameter(own, float(number), positive=False))

    def _value(self, name: str, value: sp.Expr | None) -> Value:
        if value is None:
            raise UnusableInput(f"{self.case.identity}.{name} has no value; give one")
        if value.is_number:
            self.constants[name] = value
            return float(value)
        return self._symbolic(value)

    def _symbolic(self, e: sp.Expr) -> sp.Expr:
        """Put the symbols of the graph for the plain names; ports stay for the fields."""
        known = {sp.Symbol(n): self.graph.parameters[n].symbol for n in self.case.parameters}
        for letter in ("q", "f"):
            known |= {sp.Symbol(str(v)): v for v in port_variables(letter, 9)}
        return e.xreplace(known)
