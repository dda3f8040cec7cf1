"""Switched junctions resolved: a graph for each mode.

On, an X0 is a 0-junction and an X1 a 1-junction of the same name. Off, an X1 is a 1-junction whose
flow a source ``<name>_off`` holds at zero, an X0 a 0-junction whose effort it holds at zero: the
source takes whatever effort (flow) the neighbours leave, so none of them feels another. A
storage that thereby loses its freedom (an inertia in series with an open switch) shows in the
causality as a dependent one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.renaming import apart, declared_parameters, rebuilt
from bondgraph.graph.elements import X0, Element, MSe, MSf, One, Switched, Zero
from bondgraph.support.errors import GraphError, require_known

MOST_MODES = 2**10
"""So many modes are listed at most."""


def off_source(name: str) -> str:
    """Return the name of the source that stands for the junction `name` when it is off."""
    return f"{name}_off"


def mode_of(graph: BondGraph) -> dict[str, bool]:
    """Return for every switched junction whether it is on as declared."""
    return {e.name: e.on for e in graph.of_type(Switched)}


def in_mode(graph: BondGraph, mode: Mapping[str, bool] | None = None) -> BondGraph:
    """Return the graph of one mode, without switched junctions.

    Parameters
    ----------
    mode : mapping of str to bool, optional
        Which switched junctions are on; as declared where not given.

    Raises
    ------
    UnknownName
        `mode` names no switched junction; the nearest names are given.
    GraphError
        A name ``<name>_off`` is taken.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, R, Se
    >>> from bondgraph.graph.elements import X1
    >>> with BondGraph("g") as g:
    ...     switch = X1("switch")
    ...     _ = Se("V") >> switch >> R("R_1", 1.0)
    ...     _ = switch >> C("C_1", 1.0)
    >>> [e.name for e in in_mode(g, {"switch": False}).of_type(MSf)]
    ['switch_off']
    """
    if not mode and not graph.of_type(Switched):
        return graph
    state = _full(graph, mode or {})
    with apart():
        elements = [_resolved(e) if e.name in state else e for e in graph.elements.values()]
        zeros: list[Element] = []
        for name in (n for n, on in state.items() if not on):
            source = off_source(name)
            if source in graph.elements or source in graph.parameters:
                raise GraphError(
                    f"{graph.name}: {source!r} is the name of the zero source of {name} when it is "
                    "off, and is taken; rename the other"
                )
            zeros.append(MSe(source) if isinstance(graph[name], X0) else MSf(source))
        pairs = [(b.tail, b.head) for b in graph.bonds]
        pairs += [(off_source(n), n) for n, on in state.items() if not on]
        return rebuilt(graph, [*elements, *zeros], pairs, declared_parameters(graph))


def modes(graph: BondGraph) -> Iterator[tuple[dict[str, bool], BondGraph]]:
    """Yield every mode with its graph, the one with all junctions on first.

    Raises
    ------
    GraphError
        There are more than `MOST_MODES`.
    """
    names = [e.name for e in graph.of_type(Switched)]
    if 2 ** len(names) > MOST_MODES:
        raise GraphError(
            f"{graph.name}: {len(names)} switched junctions have 2^{len(names)} modes, more than "
            f"{MOST_MODES}; ask for the ones that occur with in_mode(graph, mode)"
        )
    return (
        (mode, in_mode(graph, mode))
        for values in product((True, False), repeat=len(names))
        for mode in [dict(zip(names, values, strict=True))]
    )


def _full(graph: BondGraph, mode: Mapping[str, bool]) -> dict[str, bool]:
    state = mode_of(graph)
    for name, on in mode.items():
        require_known("switched junction", graph.name, state, name)
        if not isinstance(on, bool):
            raise GraphError(f"{graph.name}: mode of {name} is {on!r}; give True (on) or False")
        state[name] = on
    return state


def _resolved(e: Element) -> Element:
    return Zero(e.name) if isinstance(e, X0) else One(e.name)
