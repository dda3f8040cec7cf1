"""The bond graph: named elements, bonds, parameters; the ``with`` language; `check`; rewriting."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from operator import itemgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import sympy as sp

from bondgraph.graph import building
from bondgraph.graph.elements import (
    C,
    Element,
    I,
    Junction,
    One,
    Source,
    TwoPort,
    Value,
    Valued,
    Zero,
)
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.graph.sensors import De, Df, Dq, Sensor
from bondgraph.graph.views import Elements, ReadOnly
from bondgraph.signals.units import read_unit
from bondgraph.support.errors import GraphError, UnknownName, require_known, unknown_name

if TYPE_CHECKING:
    import networkx as nx

    from bondgraph.drawing.panels import Panels
    from bondgraph.laws.law import Law

_Made = TypeVar("_Made")


@dataclass(frozen=True, slots=True)
class Bond:
    """A power bond; the half arrow points at `head`.

    Examples
    --------
    >>> graph.bonds_of("m")
    (Bond(tail='body', head='m'),)
    """

    tail: str
    head: str

    @property
    def name(self) -> str:
        """Text such as ``loop>R_e``."""
        return f"{self.tail}>{self.head}"


class BondGraph:
    """A physical system as named elements joined by power bonds.

    Inside ``with BondGraph("name") as g:`` elements join by being created and bonds are drawn by
    ``a >> b``. Afterwards the graph is a value: `with_element`, `with_branch`, `with_parameters`
    return new graphs. Elements and bonds are stored in a networkx graph, see `network`.

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
        import networkx as nx  # a tenth of a second: for who builds a graph only

        self.name = name
        self._network: nx.DiGraph = nx.DiGraph(name=name)
        self._bonds: list[Bond] = []
        self._read: tuple[Bond, ...] | None = None
        self._at: dict[str, tuple[Bond, ...]] = {}
        self._gathered: dict[str, Parameter] | None = None
        self._kept: dict[Callable[[BondGraph], Any], Any] = {}
        self._parameters: dict[str, Parameter] = {}
        self._token: Any = None

    # -- building -------------------------------------------------------------------------
    def __enter__(self) -> BondGraph:
        """Start building: new elements join this graph."""
        if self._token is not None:
            raise GraphError(
                f"{self.name}: the graph is being built already; leave out the inner 'with'"
            )
        self._token = building.enter(self)
        return self

    def __exit__(self, *_: object) -> None:
        """Stop building."""
        token, self._token = self._token, None
        building.leave(token)

    def add(self, element: Element) -> Element:
        """Add `element`; its name must be new."""
        if element.name in self._network:
            raise GraphError(
                f"{self.name}: two elements are called {element.name!r}; names are addresses, "
                "rename one"
            )
        self._network.add_node(element.name, element=element)
        self._changed()
        return element

    def bond(self, tail: Element, head: Element) -> None:
        """Draw a bond from `tail` to `head`."""
        for e in (tail, head):
            if e.name not in self._network:
                self.add(e)
        if tail.name == head.name:
            raise GraphError(f"{self.name}: {tail.name} is bonded to itself; bond two elements")
        ends = tail.name, head.name
        if self._network.has_edge(*ends) or self._network.has_edge(*reversed(ends)):
            raise GraphError(
                f"{self.name}: {tail.name} and {head.name} are bonded twice; one bond carries "
                "all power between two elements, remove one"
            )
        self._draw(Bond(*ends))

    def _draw(self, bond: Bond) -> None:
        self._network.add_edge(bond.tail, bond.head, number=len(self._bonds), bond=bond)
        self._bonds.append(bond)
        self._read = None
        self._kept.clear()
        for end in (bond.tail, bond.head):  # what is known of all other elements stays true
            self._at.pop(end, None)

    def parameter(self, name: str, value: float, unit: str = "1", **more: Any) -> sp.Symbol:
        """Declare a parameter that ratios and values may use; returns its symbol.

        Its numbers (`value`, `lower`, `upper`, `scale`) are in `unit`, and kept in SI.
        """
        known = read_unit(unit)
        if known is not None and not known.is_si:
            unit, value = known.si, value * known.scale
            for n in ("lower", "upper", "scale"):
                if more.get(n) is not None:
                    more[n] *= known.scale
        p = Parameter(name, float(value), unit, **more)
        if name in self._parameters:
            raise GraphError(f"{self.name}: parameter {name!r} is declared twice; rename one")
        self._parameters[name] = p
        self._changed()
        return p.symbol

    def _changed(self) -> None:
        self._gathered = None
        self._kept.clear()

    # -- reading --------------------------------------------------------------------------
    @property
    def network(self) -> nx.DiGraph:
        """The stored graph, read-only: nodes carry ``element``, edges ``bond`` and ``number``.

        Nodes are in the order of declaration. The number of an edge is that of its bond in the
        order of declaration; port i of a multiport is the i-th of its edges by number (one bond
        carries all power between two elements, so no two edges are parallel). A view, made in
        constant time: adding or removing raises `networkx.NetworkXError`, setting an attribute
        `TypeError`; `with_element` changes elements. ``nx.Graph(g.network)`` is a copy to work
        on.

        Examples
        --------
        >>> from bondgraph import BondGraph, One, R, Se
        >>> with BondGraph("g") as g:
        ...     _ = Se("V") >> One("loop") >> R("R_1", 1.0)
        >>> list(g.network.edges(data="number"))
        [('V', 'loop', 0), ('loop', 'R_1', 1)]
        """
        view = self._network.copy(as_view=True)
        view.graph = dict(self._network.graph)
        view._node = ReadOnly(self._network._node, 2)
        view._succ = ReadOnly(self._network._succ, 3)
        view._pred = ReadOnly(self._network._pred, 3)
        return view

    @property
    def elements(self) -> Mapping[str, Element]:
        """Elements by name, in the order of their declaration; read-only."""
        return Elements(self._network._node)

    @property
    def bonds(self) -> tuple[Bond, ...]:
        """Bonds in the order of their declaration."""
        if self._read is None:
            self._read = tuple(self._bonds)
        return self._read

    def __getitem__(self, name: str) -> Element:
        """Element by name; a typo is answered with the nearest names."""
        require_known("element", self.name, self._network, name)
        element: Element = self._network.nodes[name]["element"]
        return element

    def bonds_of(self, name: str) -> tuple[Bond, ...]:
        """Bonds at an element."""
        if name not in self._at:
            if name not in self._network:
                return ()
            at = (*self._network.pred[name].values(), *self._network.succ[name].values())
            self._at[name] = tuple(e["bond"] for e in sorted(at, key=itemgetter("number")))
        return self._at[name]

    def neighbour(self, name: str) -> str:
        """Return the one element a one-port is bonded to."""
        bonds = self.bonds_of(self[name].name)
        if len(bonds) != 1:
            raise GraphError(
                f"{self.name}: {name} has {len(bonds)} bonds, so it has no one neighbour; "
                "read bonds_of"
            )
        (b,) = bonds
        return b.head if b.tail == name else b.tail

    def of_type(self, *types: type[Element]) -> tuple[Any, ...]:
        """Elements of the given types, in order."""
        stored = [node["element"] for node in self._network._node.values()]
        return tuple([e for e in stored if isinstance(e, types)])

    @property
    def parameters(self) -> dict[str, Parameter]:
        """All parameters by name: declared ones, element values, laws, drives, sensors."""
        if self._gathered is None:
            self._gathered = self._gather()
        return dict(self._gathered)

    def _gather(self) -> dict[str, Parameter]:
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
            # a whole law has its own, whatever the value says
            slope = sp.Float(element.law.slope)
            return 1 / slope if isinstance(element, I) else slope
        if isinstance(element, C) and element.stiffness is not None:
            return self._expression(element, element.stiffness)
        if element.value is None:
            raise GraphError(
                f"{self.name}: {element.name} has neither a value nor a law with a slope; give one"
            )
        value = self._expression(element, element.value)
        return 1 / value if isinstance(element, C) else value

    def slope(self, element: Valued) -> sp.Expr:
        """Linear part of an element's output over its argument.

        ``R``, ``1/C`` or ``k``, ``1/I``; of a whole law its own slope.
        """
        if element.law is not None and element.law.slope is not None:
            return sp.Float(element.law.slope)
        value = self.coefficient(element)
        return 1 / value if isinstance(element, I) else value

    def channel_value(self, element: Element, field: str) -> sp.Expr | None:
        """Return `gain`, `offset`, `lag`, .. of a channel as an expression of parameters, or None.

        Raises
        ------
        UnknownName
            It names a parameter that is not declared.
        """
        held = getattr(element, field)
        if isinstance(held, int | float):
            assert isinstance(element, Source | Sensor)
            return channel_parameter(element, field).symbol
        return None if held is None else self._expression(element, held)

    def _expression(self, element: Element, value: Value) -> sp.Expr:
        if isinstance(value, str):
            if value not in self._parameters:
                raise self._unknown(value, element.name)
            return self._parameters[value].symbol
        if isinstance(value, sp.Expr):
            for s in value.free_symbols:
                if not self._knows(s, element.name):
                    raise self._unknown(str(s), element.name)
            return value
        return symbol(element.name, positive=True)

    def _knows(self, s: sp.Symbol, element: str) -> bool:
        """Whether `s` is a declared parameter or the value of an element other than `element`."""
        name = str(s)
        declared = self._parameters.get(name)
        if declared is not None and declared.symbol == s:
            return True
        other = self.elements.get(name)
        valued = isinstance(other, Valued | TwoPort) and name != element
        own = [getattr(other, k, None) for k in ("value", "stiffness", "ratio")]
        # only a number makes the element a parameter; an expression would have to be followed
        valued = valued and any(isinstance(v, int | float) for v in own)
        return valued and bool(s == symbol(name, positive=True))

    def declared(self, name: str, element: str) -> sp.Symbol:
        """Symbol of a declared parameter (or of an element's value) that `element` uses."""
        if name in self._parameters:
            return self._parameters[name].symbol
        other = self.elements.get(name)
        if isinstance(other, Valued | TwoPort) and name != element:
            return symbol(name, positive=True)
        raise self._unknown(name, element)

    def _unknown(self, name: str, element: str) -> UnknownName:
        if _is_number(name):
            return UnknownName(
                f"{element} in {self.name}: {name!r} is text, which names a parameter; "
                f"give the number {name.strip()} without quotes"
            )
        return unknown_name("parameter", name, f"{self.name}.{element}", self._parameters)

    # -- checking -------------------------------------------------------------------------
    def check(self) -> tuple[str, ...]:
        """Everything wrong with the graph; each line names the element and what to do."""
        from bondgraph.graph.checking import problems

        return self.kept(problems)

    def require_sound(self) -> None:
        """Raise one error with all lines of `check`."""
        if lines := self.check():
            raise GraphError(f"{self.name}: " + "; ".join(lines))

    def kept(self, make: Callable[[BondGraph], _Made]) -> _Made:
        """Return ``make(self)``; made once, and anew when the graph has been changed.

        For values that whoever gets them does not write to. What `make` raises is not kept.
        """
        if make not in self._kept:
            self._kept[make] = make(self)
        made: _Made = self._kept[make]
        return made

    # -- rewriting ------------------------------------------------------------------------
    def copy(self, name: str | None = None) -> BondGraph:
        """Return an independent copy."""
        g = BondGraph(name or self.name)
        g._network = self._network.copy()
        g._network.graph["name"] = g.name
        g._bonds = list(self._bonds)
        g._parameters = dict(self._parameters)
        return g

    def __copy__(self) -> BondGraph:
        """Return an independent copy; a shallow one would share what is stored."""
        return self.copy()

    def with_element(self, name: str, **changes: Any) -> BondGraph:
        """Return the graph with fields of one element changed.

        A law with a slope of its own takes the place of the element's value.
        """
        g, e = self.copy(), self[name]
        if isinstance(e, Valued) and getattr(changes.get("law"), "slope", None) is not None:
            without: dict[str, Any] = {"value": None}
            if isinstance(e, C):
                without["stiffness"] = None
            changes = without | changes
        g._network.nodes[name]["element"] = _changed(e, **changes)
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
        if bond not in self.bonds:
            raise GraphError(f"{self.name}: there is no bond {bond.name}")
        from bondgraph.graph.composing.renaming import reading_other_bond

        i = self.bonds.index(bond)
        halves = Bond(bond.tail, junction.name), Bond(junction.name, bond.head)
        g = BondGraph(self.name)
        g._parameters = dict(self._parameters)
        for e in (*self.elements.values(), junction):
            # what was read off the bond is read where its tail is
            g.add(reading_other_bond(e, bond.name, halves[0].name))
        for b in (*self.bonds[:i], *halves, *self.bonds[i + 1 :]):
            g._draw(b)
        return g

    def with_values(self, values: Mapping[str, float]) -> BondGraph:
        """Return the graph with new nominal values for parameters (by name)."""
        g = self.copy()
        for n, v in values.items():
            if n in g._parameters:
                g._parameters[n] = replace(g._parameters[n], value=float(v))
            elif n in g._network:
                held = g._network.nodes[n]
                held["element"] = _with_value(held["element"], float(v))
            elif place := _channel_place(g, n):
                g = g.with_element(place[0], **{place[1]: float(v)})
            elif n in self.parameters:
                g._parameters[n] = replace(self.parameters[n], value=float(v))
            else:
                raise unknown_name("parameter", n, self.name, [*g._parameters, *self.elements])
        return g

    def __getstate__(self) -> dict[str, Any]:
        """Everything but what can be derived again; no copy is being built."""
        derived: dict[str, Any] = {"_read": None, "_at": {}, "_gathered": None, "_kept": {}}
        return {**self.__dict__, **derived, "_token": None}

    # -- showing --------------------------------------------------------------------------
    def __repr__(self) -> str:
        """Short text."""
        elements, bonds = len(self._network), len(self._bonds)
        return f"BondGraph({self.name!r}, {elements} elements, {bonds} bonds)"

    def _repr_html_(self) -> str:
        """Drawing for notebooks."""
        from bondgraph.drawing.svg import svg

        return svg(self)

    def plot(self) -> Panels:
        """Draw the graph with its causal strokes; returns matplotlib axes, shape (1,)."""
        from bondgraph.drawing.pictured import pictured
        from bondgraph.drawing.svg import svg

        return pictured(svg(self))

    def to_pandas(self) -> Any:
        """Return one row an element: kind, value, unit, law, neighbours (needs pandas)."""
        from bondgraph.drawing.labels import table
        from bondgraph.signals.files.checks import optional

        pandas = optional("pandas", "to_pandas", "tables")
        return pandas.DataFrame(table(self)).set_index("name")


def _changed(e: Element, **changes: Any) -> Element:
    """Return an element with other fields, which joins no graph that is being built."""
    from bondgraph.graph.composing.renaming import apart

    with apart():
        return replace(e, **changes)


def _with_value(e: Element, v: float) -> Element:
    if isinstance(e, TwoPort):
        return _changed(e, ratio=v)
    if isinstance(e, C) and e.stiffness is not None:
        return _changed(e, stiffness=v)
    if isinstance(e, Valued):
        return _changed(e, value=v)
    raise GraphError(f"{e.name} ({e.kind}) has no value to change")


def _channel_place(graph: BondGraph, name: str) -> tuple[str, str] | None:
    """Return the element and the field whose number is the parameter `name`."""
    for e in graph.of_type(Source, Sensor):
        for f in e.channel:
            if name == f"{f}_{e.name}" and isinstance(getattr(e, f), int | float):
                return e.name, f
    return None


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
            found.extend(_law_parameters(e, e.law))
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
    elif isinstance(e, Source | Sensor):
        numbers = (f for f in e.channel if isinstance(getattr(e, f), int | float))
        found.extend(channel_parameter(e, f) for f in numbers)
        drive = e.drive if isinstance(e, Source) else e
        if drive is not None and drive.law is not None:
            found.extend(drive.law.parameters(e.name))
    return tuple(found)


def _law_parameters(e: Valued, law: Law) -> tuple[Parameter, ...]:
    own = law.parameters(e.name)
    if not own or not e.unit:
        return own
    from bondgraph.graph.law_units import placed

    return placed(own, e)


_CHANNEL_UNITS = {"lag": "s", "natural_frequency": "rad/s", "damping_ratio": "1", "gain": ""}
"""That of a gain is not said: a tachometer's is V s/rad, and a sensor knows its own unit only."""


def channel_parameter(e: Source | Sensor, field: str) -> Parameter:
    """Return the parameter that a number in a channel's field stands for: known, not fitted."""
    unit = _CHANNEL_UNITS.get(field, e.unit or "1")
    positive = field not in ("gain", "offset")
    name = f"{field}_{e.name}"
    return Parameter(name, float(getattr(e, field)), unit, positive=positive, fixed=True)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text.strip()[-1:] in (*"0123456789", ".")  # 'nan' and 'inf' may be names


__all__ = ["Bond", "BondGraph", "De", "Df", "Dq", "One", "Zero"]
