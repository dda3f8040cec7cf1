"""Graphs from graphs: replace, insert, remove, rename; the original stays as it is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace as changed
from itertools import pairwise
from types import MappingProxyType
from typing import TypeAlias

from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.composing.renaming import (
    Renaming,
    Replacement,
    apart,
    called,
    declared_parameters,
    mentioned_names,
    own_parameters,
    reading_other_bond,
    rebuilt,
)
from bondgraph.graph.composing.simplification import (
    bridged,
    collapse_junctions,
    mentions,
    unused_parameters,
)
from bondgraph.graph.elements import C, Element, I, One, Source, Zero
from bondgraph.support.errors import GraphError, unknown_name

Place: TypeAlias = Bond | str | tuple[str, str]
"""A bond, its name ``tail>head``, its two ends, or the name of one element."""

_SIGNALS: Mapping[type[Element], str] = MappingProxyType({C: "efq", I: "efp", Zero: "e", One: "f"})


def replace(graph: BondGraph, name: str, element: Element) -> BondGraph:
    """Return the graph with another element in the place of `name`; its type may change.

    Bonds, half arrows and the order of everything are kept. If `element` has another name, signals
    and parameters in expressions follow.

    Raises
    ------
    GraphError
        The result has a problem that `graph` has not.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, R, Se
    >>> with BondGraph("rc") as rc:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("Z", 1e3)
    ...     _ = loop >> C("C_1", 1e-6)
    >>> replace(rc, "Z", C("Z", 1e-9)).of_type(R)
    ()
    """
    old = graph[name]
    new = element.name
    if new != name:
        _refuse_taken(graph, new)
    with apart():
        values = _follow(old, element) if new != name else {}
        renaming = Renaming({name: new}, values)
        elements = [
            element if e.name == name else renaming.element(e) for e in graph.elements.values()
        ]
        bonds = [(_put(b.tail, name, new), _put(b.head, name, new)) for b in graph.bonds]
        own = {p.name for p in own_parameters(old)}
        result = rebuilt(graph, elements, bonds, declared_parameters(graph), without=own)
    _refuse_lost_signals(result, element)
    return _no_worse(graph, result, f"{name} ({old.kind}) cannot become a {element.kind}")


def insert(graph: BondGraph, place: Place, chain: Element | Iterable[Element]) -> BondGraph:
    """Return the graph with elements in the middle of a bond, or with a branch.

    Parameters
    ----------
    place : Bond, str or tuple of str
        A bond, its name ``a>b``, or its two ends, in the order in which the chain is to be read;
        the half arrows of the chain are those of the bond. Or one element: the chain becomes a
        branch, half arrows away from it (towards it if the chain ends in a source).
    chain : Element or iterable of Element

    Raises
    ------
    GraphError
        There is no such bond, or the result has a problem that `graph` has not.
    """
    items = (chain,) if isinstance(chain, Element) else tuple(chain)
    if not items:
        raise GraphError(f"{graph.name}: nothing to insert; give at least one element")
    for e in items:
        _refuse_taken(graph, e.name)
    names = [e.name for e in items]
    single = isinstance(place, str) and ">" not in place
    pairs = [(b.tail, b.head) for b in graph.bonds]
    if single:
        assert isinstance(place, str)
        graph[place]
        path = [place, *names]
        if isinstance(items[-1], Source):
            path.reverse()
        pairs += list(pairwise(path))
        where = place
    else:
        bond, forward = _find(graph, place)
        path = [bond.tail, *(names if forward else names[::-1]), bond.head]
        at = graph.bonds.index(bond)
        pairs[at : at + 1] = list(pairwise(path))
        where = bond.name
    old = [*graph.elements.values()]
    if not single:
        # what was read off the bond is read where its tail is
        first = names[0] if forward else names[-1]
        old = [reading_other_bond(e, bond.name, f"{bond.tail}>{first}") for e in old]
    elements = [*old, *items]
    result = rebuilt(graph, elements, pairs, declared_parameters(graph))
    return _no_worse(graph, result, f"{', '.join(names)} cannot be inserted at {where}")


def remove(
    graph: BondGraph,
    name: str,
    *,
    bridge: bool = False,
    collapse: bool = False,
    drop_parameters: bool = False,
) -> BondGraph:
    """Return the graph without an element and its bonds.

    What is left may need more work: `BondGraph.check` of the result tells.

    Parameters
    ----------
    bridge : bool
        Join the two neighbours of an element between an incoming and an outgoing bond.
    collapse : bool
        Remove the junctions beside it that are left with two bonds, one in and one out.
    drop_parameters : bool
        Drop declared parameters that only this element used.

    Raises
    ------
    GraphError
        Another element's expression needs this one, or there is nothing to bridge.
    """
    old = graph[name]
    bonds = graph.bonds_of(name)
    _refuse_needed(graph, old)
    if bridge:
        result = bridged(graph, name)
    else:
        kept = [e for e in graph.elements.values() if e.name != name]
        pairs = [(b.tail, b.head) for b in graph.bonds if b not in bonds]
        result = rebuilt(graph, kept, pairs, declared_parameters(graph))
    if drop_parameters:
        before = {p.name for p in unused_parameters(graph)}
        gone = {p.name for p in unused_parameters(result)} - before
        result = _only(result, {p.name for p in declared_parameters(result)} - gone)
    if collapse:
        beside = {b.tail for b in bonds} | {b.head for b in bonds}
        result = collapse_junctions(result, beside - {name})
    return result


def rename(graph: BondGraph, name: str, new: str) -> BondGraph:
    """Return the graph with an element or a declared parameter renamed everywhere.

    Raises
    ------
    GraphError
        The new name is taken.
    UnknownName
        Nothing is called `name`.
    """
    declared = declared_parameters(graph)
    names = {p.name for p in declared}
    if name not in graph.elements and name not in names:
        raise unknown_name("element or parameter", name, graph.name, [*graph.elements, *names])
    _refuse_taken(graph, new)
    with apart():
        if name in graph.elements:
            old = graph[name]
            values: Mapping[str, Replacement] = _follow(old, called(old, new))
            elements = {name: new}
        else:
            values, elements = {name: new}, {}
        renaming = Renaming(elements, values)
        made = [renaming.element(e) for e in graph.elements.values()]
        parameters = [changed(p, name=new) if p.name == name else p for p in declared]
        pairs = [(elements.get(b.tail, b.tail), elements.get(b.head, b.head)) for b in graph.bonds]
        return rebuilt(graph, made, pairs, parameters, names=values)


# -- pieces -----------------------------------------------------------------------------------
def _only(graph: BondGraph, names: set[str]) -> BondGraph:
    kept = [p for p in declared_parameters(graph) if p.name in names]
    pairs = [(b.tail, b.head) for b in graph.bonds]
    return rebuilt(graph, graph.elements.values(), pairs, kept)


def _put(end: str, name: str, new: str) -> str:
    return new if end == name else end


def _follow(old: Element, new: Element) -> dict[str, Replacement]:
    """Old to new names of the parameters that both elements bring along."""
    olds, news = own_parameters(old), own_parameters(new)
    if len(olds) == len(news):
        return {o.name: n.name for o, n in zip(olds, news, strict=True)}
    fresh = {n.name for n in news}
    return {old.name: new.name} if new.name in fresh else {}


def _refuse_taken(graph: BondGraph, name: str) -> None:
    if name in graph.elements or name in graph.parameters:
        raise GraphError(f"{graph.name}: there is a {name!r} already; choose another name")


def _no_worse(before: BondGraph, after: BondGraph, what: str) -> BondGraph:
    from bondgraph.graph.unit_notes import unit_notes

    known = {*before.check(), *unit_notes(after)}  # a ratio waits for its new unit
    fresh = [line for line in after.check() if line not in known]
    if fresh:
        raise GraphError(f"{before.name}: {what}: {'; '.join(fresh)}")
    return after


def _find(graph: BondGraph, place: Place) -> tuple[Bond, bool]:
    """Return the bond and whether the ends were given from tail to head."""
    if isinstance(place, Bond):
        first, second = place.tail, place.head
    elif isinstance(place, str):
        first, second = place.split(">", 1)
    else:
        first, second = place
    for end in (first, second):
        graph[end]
    for b in graph.bonds_of(first):
        if (b.tail, b.head) == (first, second):
            return b, True
        if (b.tail, b.head) == (second, first):
            return b, False
    there = ", ".join(b.name for b in graph.bonds_of(first)) or "none"
    raise GraphError(f"{graph.name}: no bond joins {first} and {second}; bonds at {first}: {there}")


def _refuse_lost_signals(graph: BondGraph, new: Element) -> None:
    """Refuse an element without a signal that some expression reads."""
    letters = _SIGNALS.get(type(new), "ef")
    for e in graph.elements.values():
        for n in mentioned_names(e):
            if n[2:] == new.name and n[1] == "_" and n[0] in "efqp" and n[0] not in letters:
                raise GraphError(
                    f"{graph.name}: {new.name} as {new.kind} has no signal {n}, which {e.name} "
                    "reads; change that first"
                )


def _refuse_needed(graph: BondGraph, old: Element) -> None:
    own = {p.name for p in own_parameters(old)}
    users = [
        e.name for e in graph.elements.values() if e.name != old.name and mentions(e, old.name, own)
    ]
    if users:
        raise GraphError(
            f"{graph.name}: {old.name} is needed by the expression of {', '.join(users)}; "
            "change that first"
        )
