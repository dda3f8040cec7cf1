"""Components by name: factories of sub-graphs with their documentation."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.binding import Binding
from bondgraph.graph.composing.hierarchy import Instance, use
from bondgraph.support.errors import GraphError, require_known

Factory = Callable[..., BondGraph]
_making: ContextVar[tuple[str, ...]] = ContextVar("bondgraph_library_making", default=())


@dataclass(frozen=True)
class ComponentLibrary:
    """A named collection of component factories.

    Attributes
    ----------
    name : str
    factories : mapping of str to callable
        Each returns a graph with ports; its docstring is the documentation.

    Examples
    --------
    >>> from bondgraph.graph.composing.components import COMPONENTS
    >>> COMPONENTS.make("rc_section", resistance=2.0).parameters["R"].value
    2.0
    """

    name: str
    factories: Mapping[str, Factory] = field(default_factory=dict)

    def __iter__(self) -> Iterator[str]:
        """Names of the components, in order."""
        return iter(self.factories)

    def __len__(self) -> int:
        """Return the number of components."""
        return len(self.factories)

    def __getitem__(self, name: str) -> Factory:
        """Return a factory by name; a typo is answered with the nearest names."""
        require_known("component", self.name, self.factories, name)
        return self.factories[name]

    def with_component(self, factory: Factory, name: str | None = None) -> ComponentLibrary:
        """Return the library with one more component, called like its function if not named.

        Raises
        ------
        GraphError
            The name is taken, or the factory has no docstring.
        """
        key = factory.__name__ if name is None else name
        if key in self.factories:
            raise GraphError(
                f"{self.name}: there is a component {key!r} already; name it otherwise"
            )
        if not inspect.getdoc(factory):
            raise GraphError(f"{self.name}: component {key!r} has no docstring; say what it is")
        return ComponentLibrary(self.name, {**self.factories, key: factory})

    def documentation(self, name: str) -> str:
        """Return what a component is: its docstring."""
        return inspect.getdoc(self[name]) or ""

    def make(self, name: str, /, **arguments: Any) -> BondGraph:
        """Make the graph of a component.

        Raises
        ------
        GraphError
            The component is made of itself, directly or through others; the line names the cycle.
        """
        factory = self[name]
        key, path = f"{self.name}.{name}", _making.get()
        if key in path:
            cycle = " -> ".join(k.split(".", 1)[1] for k in (*path[path.index(key) :], key))
            raise GraphError(f"{self.name}: component {name} is made of itself: {cycle}")
        token = _making.set((*path, key))
        try:
            return factory(**arguments)
        finally:
            _making.reset(token)

    def use(self, name: str, instance: str, /, **bindings: Binding) -> Instance:
        """Make a component and put it into the graph being built, as `hierarchy.use` does."""
        return use(self.make(name), instance, **bindings)

    def __str__(self) -> str:
        """Every component with the first line of its documentation."""
        width = max((len(n) for n in self.factories), default=0)
        lines = [f"{n:{width}}  {self.documentation(n).splitlines()[0]}" for n in self.factories]
        return "\n".join([self.name, *lines])
