"""What a graph stores, to read: views, so making one copies nothing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from bondgraph.graph.elements import Element


class Elements(Mapping[str, Element]):
    """The elements of a network by name, as they are stored; a view, so reading copies nothing."""

    __slots__ = ("_nodes",)

    def __init__(self, nodes: Mapping[str, Mapping[str, Any]]) -> None:
        self._nodes = nodes

    def __getitem__(self, name: str) -> Element:
        """Return what stands under a name."""
        element: Element = self._nodes[name]["element"]
        return element

    def __iter__(self) -> Iterator[str]:
        """Names, in their order."""
        return iter(self._nodes)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._nodes)

    def __contains__(self, name: object) -> bool:
        """Whether the name is there."""
        return name in self._nodes

    def __repr__(self) -> str:
        """Return the text of a dict."""
        return repr(dict(self))


class ReadOnly(Mapping[str, Any]):
    """Dicts nested `depth` deep, to read; a view, so making it copies nothing."""

    __slots__ = ("_depth", "_stored")

    def __init__(self, stored: Mapping[str, Any], depth: int) -> None:
        self._stored = stored
        self._depth = depth

    def __getitem__(self, key: str) -> Any:
        """Return what stands under a name."""
        value = self._stored[key]
        return ReadOnly(value, self._depth - 1) if self._depth > 1 else value

    def __iter__(self) -> Iterator[str]:
        """Names, in their order."""
        return iter(self._stored)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._stored)

    def __contains__(self, key: object) -> bool:
        """Whether the name is there."""
        return key in self._stored

    def __repr__(self) -> str:
        """Return the text of a dict."""
        return repr(self._stored)

    def copy(self) -> dict[str, Any]:
        """Return a dict to write to, as networkx asks for when it copies a graph."""
        return dict(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        """Return a dict to write to."""
        return deepcopy(self._stored, memo)
