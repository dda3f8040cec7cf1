"""Which graph a ``with BondGraph(...)`` block is building; per thread and task, never global."""

from __future__ import annotations

from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import GraphError

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.graph.elements import Element

_current: ContextVar[tuple[BondGraph, ...]] = ContextVar("bondgraph_building", default=())


def enter(graph: BondGraph) -> Any:
    """Make `graph` the one that new elements join; returns the token for `leave`."""
    return _current.set((*_current.get(), graph))


def leave(token: Any) -> None:
    """Undo the matching `enter`."""
    _current.reset(token)


def current() -> tuple[BondGraph, ...]:
    """Return the graphs being built, outermost first."""
    return _current.get()


def join(element: Element) -> None:
    """Add `element` to the graph being built, if there is one."""
    if stack := _current.get():
        stack[-1].add(element)


def bond(tail: Element, head: Element) -> None:
    """Bond two elements in the graph being built."""
    stack = _current.get()
    if not stack:
        raise GraphError(
            f"{tail.name} >> {head.name} outside of a graph: write it inside "
            "'with BondGraph(\"name\") as graph:' or call graph.bond(a, b)"
        )
    stack[-1].bond(tail, head)
