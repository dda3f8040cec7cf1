"""Simpler graphs of the same equations: merged and collapsed junctions, no idle parameters."""

from __future__ import annotations

from collections.abc import Iterable

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.renaming import (
    Renaming,
    apart,
    declared_parameters,
    mentioned_names,
    rebuilt,
)
from bondgraph.graph.elements import Element, One, Zero
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import GraphError


def merge_junctions(graph: BondGraph) -> BondGraph:
    """Return the graph with neighbouring junctions of one kind merged into the first declared.

    Common effort (or flow) and the sum at both are those of one junction, whichever way the bond
    between them points. Two junctions with a third neighbour in common are left: one element
    would be bonded twice. A junction that an expression calls by its other variable
    (the effort of a 1-junction) is left as well.

    Examples
    --------
    >>> from bondgraph import BondGraph, One, R, Se
    >>> with BondGraph("g") as g:
    ...     a, b = One("a"), One("b")
    ...     _ = Se("V") >> a >> b >> R("R_1", 1.0)
    >>> [bond.name for bond in merge_junctions(g).bonds]
    ['V>a', 'a>R_1']
    """
    into = _groups(graph)
    if not into:
        return graph.copy()
    values = {}
    for gone, kept in into.items():
        letter = "e" if isinstance(graph[gone], Zero) else "f"
        values[f"{letter}_{gone}"] = symbol(f"{letter}_{kept}")
    renaming = Renaming(into, values)
    with apart():
        elements = [renaming.element(e) for n, e in graph.elements.items() if n not in into]
        ends = [(into.get(b.tail, b.tail), into.get(b.head, b.head)) for b in graph.bonds]
        pairs = [(tail, head) for tail, head in ends if tail != head]
        return rebuilt(graph, elements, pairs, declared_parameters(graph))


def collapse_junctions(graph: BondGraph, among: Iterable[str] | None = None) -> BondGraph:
    """Return the graph without the junctions that only pass one bond on to the next.

    A junction with one bond in and one out, no sensor and no mention in an expression changes
    nothing. It stays where two one-ports, or elements that are bonded already, would meet.

    Parameters
    ----------
    among : iterable of str, optional
        Only these; all by default.
    """
    names = graph.elements if among is None else among
    for name in [n for n in graph.elements if n in set(names)]:
        if _passes_on(graph, name):
            graph = bridged(graph, name)
    return graph


def bridged(graph: BondGraph, name: str) -> BondGraph:
    """Return the graph without `name`, its neighbours joined.

    Raises
    ------
    GraphError
        It has not exactly one bond in and one out.
    """
    bonds = graph.bonds_of(name)
    tails = [b.tail for b in bonds if b.head == name]
    heads = [b.head for b in bonds if b.tail == name]
    if len(tails) != 1 or len(heads) != 1:
        raise GraphError(
            f"{graph.name}: {name} has {len(tails)} bonds in and {len(heads)} out; only an "
            "element with one in and one out can be bridged"
        )
    pairs = [(b.tail, b.head) for b in graph.bonds if b not in bonds]
    before = [b for b in graph.bonds[: graph.bonds.index(bonds[0])] if b not in bonds]
    pairs.insert(len(before), (tails[0], heads[0]))
    kept = [e for n, e in graph.elements.items() if n != name]
    return rebuilt(graph, kept, pairs, declared_parameters(graph))


def unused_parameters(graph: BondGraph) -> tuple[Parameter, ...]:
    """Return the declared parameters that no element mentions."""
    used = {n for e in graph.elements.values() for n in mentioned_names(e)}
    return tuple(p for p in declared_parameters(graph) if p.name not in used)


def mentions(e: Element, name: str, own: Iterable[str] = ()) -> bool:
    """Whether the expressions of `e` need a signal of the element `name`, or one of `own`."""
    needed = {*own, *(f"{letter}_{name}" for letter in "efqp")}
    for n in mentioned_names(e):
        ends = n[2:].split(">") if ">" in n else ()
        port = n[1:2] == "_" and n[-1:].isdigit() and n[2:].rstrip("0123456789") == name
        if n in needed or name in ends or port:
            return True
    return False


def _groups(graph: BondGraph) -> dict[str, str]:
    """Return for every junction that goes the one that stays."""
    asked = {n for e in graph.elements.values() for n in mentioned_names(e)}
    around = {n: _around(graph, n) for n in graph.elements}
    members = {n: [n] for n in graph.elements}
    root = {n: n for n in graph.elements}
    order = {n: i for i, n in enumerate(graph.elements)}
    for b in graph.bonds:
        tail, head = root[b.tail], root[b.head]
        if tail == head or not _alike(graph, b.tail, b.head, asked):
            continue
        if around[tail] & around[head]:
            continue
        kept, gone = sorted((tail, head), key=order.__getitem__)
        around[kept] = (around[kept] | around[gone]) - {kept, gone}
        for n in around[gone] - {kept}:
            around[n] = (around[n] - {gone}) | {kept}
        for n in members[gone]:
            root[n] = kept
        members[kept] += members.pop(gone)
    return {n: r for n, r in root.items() if n != r}


def _alike(graph: BondGraph, first: str, second: str, asked: set[str]) -> bool:
    kinds = type(graph[first]), type(graph[second])
    if kinds[0] is not kinds[1] or kinds[0] not in (Zero, One):
        return False
    other = "f" if kinds[0] is Zero else "e"
    return not ({f"{other}_{first}", f"{other}_{second}"} & asked)


def _around(graph: BondGraph, name: str) -> set[str]:
    return {b.head if b.tail == name else b.tail for b in graph.bonds_of(name)}


def _passes_on(graph: BondGraph, name: str) -> bool:
    if not isinstance(graph[name], Zero | One):
        return False
    bonds = graph.bonds_of(name)
    if len(bonds) != 2 or (bonds[0].head == name) == (bonds[1].head == name):
        return False
    ends = [graph[b.head if b.tail == name else b.tail] for b in bonds]
    if any(isinstance(e, Sensor) for e in ends) or all(e.n_ports == 1 for e in ends):
        return False
    if ends[1].name in _around(graph, ends[0].name):
        return False
    return not any(mentions(e, name) for e in graph.elements.values())
