"""The bond graph: named elements, bonds, parameters; the ``with`` language; `check`; rewriting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import sympy as sp

from bondgraph.graph import building
from bondgraph.graph.elements import (
    C,
    De,
    Df,
    Dq,
    Element,
    Junction,
    One,
    Parameter,
    Sensor,
    Source,
    TwoPort,
    Value,
    Valued,
    Zero,
    symbol,
)
from bondgraph.support.errors import GraphError, unknown_name

if TYPE_CHECKING:
    import networkx as nx


@dataclass(frozen=True, slots=True)
class Bond:
    """A power bond; the half arrow points at `head`."""

    tail: str
    head: str

    @property
    def name(self) -> str:
        """Text such as ``loop>R_e``."""
        return f"{self.tail}>{self.head}"


class BondGraph:
    """A physical system as named elements joined by power bonds.

    Inside ``with BondGraph("name") as g:`` elements join by being created and bonds are drawn by
    ``a >> b``. Afterwards the graph is a value: `with_element`, `without`, `with_parameter`
    return new graphs.

    Examples
    --------
    >>> from bondgraph import BondGraph, Se, R, C, One
    >>> with BondGraph("rc") as rc:
    ...     loop = One("loop")
    ...     _ = Se("V", unit="V") >> loop >> R("R_1", 1e3, unit="ohm")
    ...     _ = loop >> C("C_1", 1e-6, unit="F")
    >>> rc.check()
    ()
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._elements: dict[str, Element] = {}
        self._bonds: list[Bond] = []
        self._at: dict[str, list[Bond]] = {}
        self._parameters: dict[str, Parameter] = {}
        self._token: Any = None

    # -- building -------------------------------------------------------------------------
    def __enter__(self) -> BondGraph:
        """Start building: new elements join this graph."""
        self._token = building.enter(self)
        return self

    def __exit__(self, *_: object) -> None:
        """Stop building."""
        building.leave(self._token)
        self._token = None

    def add(self, element: Element) -> Element:
        """Add `element`; its name must be new."""
        if element.name in self._elements:
            raise GraphError(
                f"{self.name}: two elements are called {element.name!r}; names are addresses, "
                "rename one"
            )
        self._elements[element.name] = element
        return element

    def bond(self, tail: Element, head: Element) -> None:
        """Draw a bond from `tail` to `head`."""
        for e in (tail, head):
            if e.name not in self._elements:
                self.add(e)
        if tail.name == head.name:
            raise GraphError(f"{self.name}: {tail.name} is bonded to itself; bond two elements")
        few = min((tail.name, head.name), key=lambda n: len(self._at.get(n, ())))
        other = head.name if few == tail.name else tail.name
        if any(other in (b.tail, b.head) for b in self._at.get(few, ())):
            raise GraphError(
                f"{self.name}: {tail.name} and {head.name} are bonded twice; one bond carries "
                "all power between two elements, remove one"
            )
        self._append(Bond(tail.name, head.name))

    def _append(self, bond: Bond) -> None:
        self._bonds.append(bond)
        for end in (bond.tail, bond.head):
            self._at.setdefault(end, []).append(bond)

    def parameter(self, name: str, value: float, unit: str = "1", **more: Any) -> sp.Symbol:
        """Declare a parameter that ratios and values may use; returns its symbol."""
        p = Parameter(name, float(value), unit, **more)
        if name in self._parameters:
            raise GraphError(f"{self.name}: parameter {name!r} is declared twice; rename one")
        self._parameters[name] = p
        return p.symbol

    # -- reading --------------------------------------------------------------------------
    @property
    def elements(self) -> Mapping[str, Element]:
        """Elements by name, in the order of their declaration; a view."""
        return MappingProxyType(self._elements)

    @property
    def bonds(self) -> tuple[Bond, ...]:
        """Bonds in the order of their declaration."""
        return tuple(self._bonds)

    def __getitem__(self, name: str) -> Element:
        """Element by name; a typo is answered with the nearest names."""
        if name not in self._elements:
            raise unknown_name("element", name, self.name, self._elements)
        return self._elements[name]

    def bonds_of(self, name: str) -> tuple[Bond, ...]:
        """Bonds at an element."""
        return tuple(self._at.get(name, ()))

    def neighbour(self, name: str) -> str:
        """Return the one element a one-port is bonded to."""
        (b,) = self.bonds_of(name)
        return b.head if b.tail == name else b.tail

    def of_type(self, *types: type[Element]) -> tuple[Any, ...]:
        """Elements of the given types, in order."""
        # few classes, many elements: asking an abstract class about each of them takes long
        kinds = {t for t in {type(e) for e in self._elements.values()} if issubclass(t, types)}
        return tuple(e for e in self._elements.values() if type(e) in kinds)

    def network(self) -> nx.DiGraph:
        """Return the graph for networkx: nodes carry ``element``, edges carry ``bond``."""
        import networkx as nx

        g = nx.DiGraph(name=self.name)
        for n, e in self._elements.items():
            g.add_node(n, element=e)
        for b in self._bonds:
            g.add_edge(b.tail, b.head, bond=b)
        return g

    @property
    def parameters(self) -> dict[str, Parameter]:
        """All parameters by name: declared ones, element values, laws, drives, sensors."""
        found: dict[str, Parameter] = dict(self._parameters)
        owner: dict[str, str] = {}
        for e in self.of_type(Valued, TwoPort, Source, Sensor):
            for p in _own_parameters(e):
                if owner.setdefault(p.name, e.name) != e.name:
                    raise GraphError(
                        f"{self.name}: {p.name!r} is a parameter of {owner[p.name]} and of "
                        f"{e.name}; rename one of the elements"
                    )
                if p.name in found and p.name in self._parameters and e.name == p.name:
                    raise GraphError(
                        f"{self.name}: {p.name!r} is both a declared parameter and an element with "
                        f"a value of its own; give the element value={p.name!r} under another name"
                    )
                found.setdefault(p.name, p)
        return found

    @property
    def declared_parameters(self) -> Mapping[str, Parameter]:
        """Parameters declared with `parameter`, without those that elements carry; a view."""
        return MappingProxyType(self._parameters)

    def coefficient(self, element: Element) -> sp.Expr:
        """Linear coefficient of an element as an expression of parameters.

        ``R`` for resistors, the slope ``1/C`` or ``k`` for C, the inertia for I, the ratio of
        two-ports.
        """
        if isinstance(element, TwoPort):
            return self._expression(element, element.ratio)
        if not isinstance(element, Valued):
            raise GraphError(f"{self.name}: {element.name} ({element.kind}) has no coefficient")
        if element.law is not None and element.law.slope is not None:
            return sp.Float(element.law.slope)  # a whole law has its own, whatever the value says
        if isinstance(element, C) and element.stiffness is not None:
            return self._expression(element, element.stiffness)
        if element.value is None:
            raise GraphError(
                f"{self.name}: {element.name} has neither a value nor a law with a slope; give one"
            )
        value = self._expression(element, element.value)
        return 1 / value if isinstance(element, C) else value

    def _expression(self, element: Element, value: Value) -> sp.Expr:
        if isinstance(value, str):
            if value not in self._parameters:
                raise unknown_name(
                    "parameter", value, f"{self.name}.{element.name}", self._parameters
                )
            return self._parameters[value].symbol
        if isinstance(value, sp.Expr):
            for s in value.free_symbols:
                if not self._knows(s, element.name):
                    raise unknown_name(
                        "parameter", str(s), f"{self.name}.{element.name}", self._parameters
                    )
            return value
        return symbol(element.name, positive=True)

    def _knows(self, s: sp.Symbol, element: str) -> bool:
        """Whether `s` is a declared parameter or the value of an element other than `element`."""
        name = str(s)
        declared = self._parameters.get(name)
        if declared is not None and declared.symbol == s:
            return True
        other = self._elements.get(name)
        valued = isinstance(other, Valued | TwoPort) and name != element
        own = [getattr(other, k, None) for k in ("value", "stiffness", "ratio")]
        # only a number makes the element a parameter; an expression would have to be followed
        valued = valued and any(isinstance(v, int | float) for v in own)
        return valued and bool(s == symbol(name, positive=True))

    def declared(self, name: str, element: str) -> sp.Symbol:
        """Symbol of a declared parameter (or of an element's value) that `element` uses."""
        if name in self._parameters:
            return self._parameters[name].symbol
        other = self._elements.get(name)
        if isinstance(other, Valued | TwoPort) and name != element:
            return symbol(name, positive=True)
        raise unknown_name("parameter", name, f"{self.name}.{element}", self._parameters)

    # -- checking -------------------------------------------------------------------------
    def check(self) -> tuple[str, ...]:
        """Everything wrong with the graph; each line names the element and what to do."""
        from bondgraph.graph.checking import problems

        return problems(self)

    def require_sound(self) -> None:
        """Raise one error with all lines of `check`."""
        if lines := self.check():
            raise GraphError(f"{self.name}: " + "; ".join(lines))

    # -- rewriting ------------------------------------------------------------------------
    def copy(self, name: str | None = None) -> BondGraph:
        """Return an independent copy."""
        g = BondGraph(name or self.name)
        g._elements = dict(self._elements)
        g._bonds = list(self._bonds)
        g._at = {n: list(bonds) for n, bonds in self._at.items()}
        g._parameters = dict(self._parameters)
        return g

    def with_element(self, name: str, **changes: Any) -> BondGraph:
        """Return the graph with fields of one element changed."""
        g = self.copy()
        g._elements[name] = replace(self[name], **changes)
        return g

    def with_parameters(self, parameters: Iterable[Parameter]) -> BondGraph:
        """Return the graph with further (or replaced) declared parameters."""
        g = self.copy()
        g._parameters.update({p.name: p for p in parameters})
        return g

    def with_branch(self, at: str, chain: Iterable[Element]) -> BondGraph:
        """Return the graph with a new chain of elements bonded to element `at`."""
        g = self.copy()
        tail = self[at]
        for e in chain:
            g.add(e)
            g.bond(tail, e)
            tail = e
        return g

    def replace(self, name: str, element: Element) -> BondGraph:
        """Return the graph with `element` in place of another, bonds and half arrows kept."""
        from bondgraph.graph.composing.rewriting import replace as replaced

        return replaced(self, name, element)

    def insert(self, place: Any, chain: Element | Iterable[Element]) -> BondGraph:
        """Return the graph with elements put into a bond or branched off a junction."""
        from bondgraph.graph.composing.rewriting import insert

        return insert(self, place, chain)

    def remove(self, name: str, **options: bool) -> BondGraph:
        """Return the graph without an element and its bonds, see `composing.rewriting`."""
        from bondgraph.graph.composing.rewriting import remove

        return remove(self, name, **options)

    def with_inserted(self, bond: Bond, junction: Junction) -> BondGraph:
        """Return the graph with `junction` put into the middle of a bond."""
        g = self.copy()
        if bond not in g._bonds:
            raise GraphError(f"{self.name}: there is no bond {bond.name}")
        i = g._bonds.index(bond)
        g.add(junction)
        bonds = list(g._bonds)
        bonds[i : i + 1] = [Bond(bond.tail, junction.name), Bond(junction.name, bond.head)]
        g._bonds, g._at = [], {}
        for b in bonds:
            g._append(b)
        return g

    def with_values(self, values: Mapping[str, float]) -> BondGraph:
        """Return the graph with new nominal values for parameters (by name)."""
        g = self.copy()
        for n, v in values.items():
            if n in g._parameters:
                g._parameters[n] = replace(g._parameters[n], value=float(v))
            elif n in g._elements:
                g._elements[n] = _with_value(g._elements[n], float(v))
            elif n in self.parameters:
                g._parameters[n] = replace(self.parameters[n], value=float(v))
            else:
                raise unknown_name("parameter", n, self.name, [*g._parameters, *g._elements])
        return g

    # -- showing --------------------------------------------------------------------------
    def __repr__(self) -> str:
        """Short text."""
        return f"BondGraph({self.name!r}, {len(self._elements)} elements, {len(self._bonds)} bonds)"

    def _repr_html_(self) -> str:
        """Drawing for notebooks."""
        from bondgraph.drawing.svg import svg

        return svg(self)


def _with_value(e: Element, v: float) -> Element:
    if isinstance(e, TwoPort):
        return replace(e, ratio=v)
    if isinstance(e, C) and e.stiffness is not None:
        return replace(e, stiffness=v)
    if isinstance(e, Valued):
        return replace(e, value=v)
    raise GraphError(f"{e.name} ({e.kind}) has no value to change")


def _own_parameters(e: Element) -> tuple[Parameter, ...]:
    found: list[Parameter] = []
    if isinstance(e, Valued):
        value = e.stiffness if isinstance(e, C) and e.stiffness is not None else e.value
        if isinstance(value, int | float):
            found.append(
                Parameter(
                    e.name,
                    float(value),
                    e.unit or "1",
                    fixed=e.fixed,
                    source=e.source,
                    spread=e.spread,
                )
            )
        if e.law is not None:
            found.extend(e.law.parameters(e.name))
    elif isinstance(e, TwoPort):
        if isinstance(e.ratio, int | float):
            found.append(
                Parameter(
                    e.name,
                    float(e.ratio),
                    e.unit or "1",
                    fixed=e.fixed,
                    source=e.source,
                    spread=e.spread,
                )
            )
    elif isinstance(e, Source):
        if e.drive is not None and e.drive.law is not None:
            found.extend(e.drive.law.parameters(e.name))
    elif isinstance(e, Sensor) and e.law is not None:
        found.extend(e.law.parameters(e.name))
    return tuple(found)


__all__ = ["Bond", "BondGraph", "De", "Df", "Dq", "One", "Zero"]
