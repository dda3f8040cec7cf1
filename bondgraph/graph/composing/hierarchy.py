"""A graph as an element of another: ports, instances, parameters bound or renamed.

A sub-graph ends in `Port` elements. ``use(sub, "left", k=5.0)`` inside ``with BondGraph(...)``
copies it, flat, into the graph being built: element ``R_1`` becomes ``left_R_1``, a parameter
``k`` becomes ``left_k``, signals in expressions follow. Each port becomes a junction
``left_<port>`` of the kind of its neighbour inside (a 1-junction beside anything but a junction),
so the half arrow inside says which way power is positive there, and a bond outside may have either
direction: the junction keeps the balance. (`simplification.merge_junctions` removes what is then
superfluous.) A port that stays open is a junction with one bond,
which `BondGraph.check` refuses by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar, cast

import sympy as sp

from bondgraph.graph import building
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.binding import Binding, bound, external_signals
from bondgraph.graph.composing.renaming import (
    Renaming,
    apart,
    called,
    declared_parameters,
    own_parameters,
    rebuilt,
    set_numbers,
)
from bondgraph.graph.elements import Element, Junction, One, Zero
from bondgraph.support.errors import GraphError, nearest, require_known, unknown_name

_COMMON = ("", "effort", "flow")


@dataclass(frozen=True)
class Port(Junction):
    """Where a sub-graph is joined to the graph that uses it; it has one bond inside.

    Parameters
    ----------
    unit : str
        SI unit of the effort, for the check of domains.
    common : {"", "effort", "flow"}
        The port becomes a 0-junction (common effort) or a 1-junction; by default the kind of the
        junction inside it is bonded to, else a 1-junction.

    Examples
    --------
    >>> from bondgraph.graph.composing.hierarchy import use
    >>> def joint():
    ...     with BondGraph("spring and damper") as g:
    ...         pair = One("pair")
    ...         Port("end", unit="N") >> pair >> C("k", stiffness=2e3, unit="N/m")
    ...         pair >> R("d", 4.0, unit="N*s/m")
    ...     return g
    >>> def carriage():
    ...     with BondGraph("carriage") as g:
    ...         body = One("body")
    ...         Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
    ...         body >> use(joint(), "foot").end
    ...     return g
    >>> carriage().check(), "foot_k" in carriage().elements
    ((), True)
    """

    unit: str = ""
    common: str = field(default="", kw_only=True)
    kind: ClassVar[str] = "port"

    def __post_init__(self) -> None:
        """Refuse a wrong `common`."""
        if self.common not in _COMMON:
            raise unknown_name("common variable", self.common, f"port {self.name}", _COMMON[1:])
        super().__post_init__()


@dataclass(frozen=True)
class Instance:
    """A sub-graph within a graph.

    ``instance.terminal`` or ``instance.port("terminal")`` is the junction to bond to;
    ``instance["R_1"]`` any other element.

    Attributes
    ----------
    name : str
        Prefix of all names.
    ports, elements : mapping of str to Element
        By the name inside the sub-graph.
    """

    name: str
    ports: Mapping[str, Element]
    elements: Mapping[str, Element]

    def port(self, name: str) -> Element:
        """Return a port; a typo is answered with the nearest names."""
        require_known("port", self.name, self.ports, name)
        return self.ports[name]

    def __getitem__(self, name: str) -> Element:
        """Element by its name inside the sub-graph."""
        require_known("element", self.name, self.elements, name)
        return self.elements[name]

    def __getattr__(self, name: str) -> Element:
        """Port by name."""
        ports = self.__dict__.get("ports", {})
        if name in ports:
            return cast(Element, ports[name])
        close = " or ".join(repr(n) for n in nearest(name, ports))
        hint = f"did you mean {close}?" if close else f"ports: {', '.join(ports) or 'none'}"
        raise AttributeError(f"{self.__dict__.get('name')} has no port {name!r}; {hint}")


def ports_of(graph: BondGraph) -> tuple[Port, ...]:
    """Return the open ports of a graph, in order."""
    return graph.of_type(Port)


def use(graph: BondGraph, name: str, /, **bindings: Binding) -> Instance:
    """Put a copy of `graph` into the graph that is being built.

    Parameters
    ----------
    graph : BondGraph
        The sub-graph, with ports.
    name : str
        Name of the instance; its elements become ``name_element``.
    **bindings : float, str or sympy.Expr
        By parameter of the sub-graph: a number replaces its value; the name or an expression of
        parameters outside makes it shared. A signal from outside, ``in_X``, may be bound to an
        expression of signals.

    Raises
    ------
    GraphError
        Nothing is being built, the graph uses itself, a name exists already, or a port has not
        exactly one bond inside.
    UnknownName
        A binding names no parameter; the nearest names are given.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, R, Se, Zero
    >>> with BondGraph("rc") as rc:
    ...     loop, node = One("loop"), Zero("node")
    ...     _ = Port("left") >> loop >> R("R_1", 1e3)
    ...     _ = loop >> node >> C("C_1", 1e-6)
    ...     _ = node >> Port("right")
    >>> with BondGraph("ladder") as ladder:
    ...     first, second = use(rc, "a"), use(rc, "b", R_1=2e3)
    ...     _ = Se("V") >> first.left
    ...     _ = first.right >> second.left
    ...     _ = second.right >> R("load", 1e4)
    >>> ladder.check(), ladder.parameters["b_R_1"].value
    ((), 2000.0)
    """
    stack = building.current()
    if not stack:
        raise GraphError(
            f"use({graph.name}, {name!r}) outside of a graph: write it inside "
            "'with BondGraph(\"name\") as g:' or call embedded(g, sub, name)"
        )
    _refuse_cycle(graph, stack)
    outer = stack[-1]
    with apart():
        part, ports = _instantiate(outer, graph, name, bindings)
    for e in part.elements.values():
        outer.add(e)
    for b in part.bonds:
        outer.bond(outer[b.tail], outer[b.head])
    for p in (*declared_parameters(part), *set_numbers(part)):
        outer.parameter(**{f.name: getattr(p, f.name) for f in fields(p)})
    elements = {n: part[f"{name}_{n}"] for n in graph.elements}
    return Instance(name, {n: elements[n] for n in ports}, elements)


def embedded(outer: BondGraph, graph: BondGraph, name: str, /, **bindings: Binding) -> BondGraph:
    """Return `outer` with a copy of `graph` in it, see `use`; `outer` stays as it is."""
    result = outer.copy()
    with result:
        use(graph, name, **bindings)
    return result


def _refuse_cycle(graph: BondGraph, stack: tuple[BondGraph, ...]) -> None:
    for i, open_graph in enumerate(stack):
        if open_graph is graph:
            path = " -> ".join([*(g.name for g in stack[i:]), graph.name])
            raise GraphError(
                f"{graph.name} uses itself: {path}; a hierarchy ends somewhere, build the inner "
                "graph before the one that uses it"
            )


def _instantiate(
    outer: BondGraph, sub: BondGraph, name: str, bindings: Mapping[str, Binding]
) -> tuple[BondGraph, tuple[str, ...]]:
    """Return the renamed copy with junctions for ports, and the names of the ports."""
    if not name.isidentifier() or name.startswith("_"):
        raise GraphError(
            f"instance name {name!r} of {sub.name} is not an identifier; use letters, digits and "
            "underscores, a letter first"
        )
    if not sub.elements:
        raise GraphError(f"{sub.name} has no elements yet: build it before it is used")
    ports = {p.name: _junction_of(sub, p) for p in ports_of(sub)}
    sub, values = bound(outer, sub, name, bindings)
    elements = {n: f"{name}_{n}" for n in sub.elements}
    declared = declared_parameters(sub)
    values |= {p.name: f"{name}_{p.name}" for p in declared if p.name not in values}
    for e in sub.elements.values():
        values = _own_names(e, elements[e.name]) | values
    values |= {n: f"in_{name}_{n[3:]}" for n in external_signals(sub) if n not in values}
    renaming = Renaming(elements, values)
    made = [renaming.element(e) for e in sub.elements.values() if e.name not in ports]
    # ports last: a junction inside gives its name to the variable it shares with its port
    made += [kind(elements[n]) for n, kind in ports.items()]
    kept = [replace(p, name=new) for p in declared if isinstance(new := values[p.name], str)]
    _refuse_collisions(outer, name, [*elements.values(), *(p.name for p in kept)])
    bonds = [(elements[b.tail], elements[b.head]) for b in sub.bonds]
    part = rebuilt(sub, made, bonds, kept, names=values)
    return part.copy(name), tuple(ports)


def _junction_of(sub: BondGraph, port: Port) -> type[Junction]:
    """Kind of junction a port becomes."""
    bonds = sub.bonds_of(port.name)
    if len(bonds) != 1:
        raise GraphError(
            f"{sub.name}: port {port.name} has {len(bonds)} bonds inside: a port has one; "
            + ("put a junction behind it" if bonds else "bond it with >> or remove it")
        )
    if port.common:
        return Zero if port.common == "effort" else One
    return Zero if isinstance(sub[sub.neighbour(port.name)], Zero) else One


def _own_names(e: Element, new: str) -> dict[str, str | sp.Expr]:
    """Old to new names of the parameters an element brings along."""
    pairs = zip(own_parameters(e), own_parameters(called(e, new)), strict=True)
    return {old.name: fresh.name for old, fresh in pairs}


def _refuse_collisions(outer: BondGraph, name: str, new: list[str]) -> None:
    seen: set[str] = set()
    taken = {*outer.elements, *outer.parameters}
    for n in new:
        if n in taken or n in seen:
            raise GraphError(
                f"{outer.name}: instance {name} would make a second {n!r}; choose another name "
                "for the instance"
            )
        seen.add(n)
