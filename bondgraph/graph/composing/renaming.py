"""Elements under new names: expressions, signals and the names of parameters follow."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, TypeAlias

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Element, Multiport
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.laws.law import Law
from bondgraph.support.errors import GraphError

Replacement: TypeAlias = str | sp.Expr
"""A new name, or the expression that takes the place of a parameter."""

_VALUES = (
    "value", "stiffness", "ratio", "energy", "law", "matrix", "gain", "offset", "lag",
    "natural_frequency", "damping_ratio", "resolution",
)  # fmt: skip
_REFERENCES = ("delay", "clock", "drift")
_NAMES = ("beside", "coefficient")
_SIGNAL = re.compile(r"([efqp])_(.+)")
_PORT = re.compile(r"(.+?)(\d+)")


class _Apart(BondGraph):
    """Takes the elements that must not join the graph being built."""

    def add(self, element: Element) -> Element:
        """Forget the element."""
        return element


def apart() -> BondGraph:
    """Return a context in which new elements join no graph."""
    return _Apart("apart")


def assemble(
    name: str,
    elements: Iterable[Element],
    bonds: Iterable[tuple[str, str]],
    parameters: Iterable[Parameter] = (),
) -> BondGraph:
    """Return the graph of these elements, bonds (tail, head) and declared parameters."""
    graph = BondGraph(name)
    for e in elements:
        graph.add(e)
    for tail, head in bonds:
        graph.bond(graph[tail], graph[head])
    return graph.with_parameters(parameters)


def rebuilt(
    graph: BondGraph,
    elements: Iterable[Element],
    bonds: Iterable[tuple[str, str]],
    parameters: Iterable[Parameter],
    *,
    without: Container[str] = (),
    names: Mapping[str, Replacement] = MappingProxyType({}),
) -> BondGraph:
    """Return what `assemble` does, with the numbers of laws as they were set in `graph`.

    Parameters
    ----------
    without : container of str
        Parameters whose numbers are those of the new elements.
    names : mapping
        Old to new names of parameters.
    """
    made = assemble(graph.name, elements, bonds, parameters)
    known = made.parameters
    kept = [
        replace(p, name=new) for p in set_numbers(graph)
        if p.name not in without and isinstance(new := names.get(p.name, p.name), str)
    ]  # fmt: skip
    return made.with_parameters(p for p in kept if p.name in known)


def own_parameters(element: Element) -> tuple[Parameter, ...]:
    """Return the parameters an element brings along: its value, its laws."""
    alone = BondGraph("alone")
    alone.add(element)
    return tuple(alone.parameters.values())


def called(element: Element, new: str) -> Element:
    """Return an element under another name, which what it says of itself follows."""
    return Renaming({element.name: new}, {element.name: new}).element(element)


def declared_parameters(graph: BondGraph) -> tuple[Parameter, ...]:
    """Return the parameters of `graph` that no element brings along."""
    found = {p.name: e for e in graph.elements.values() for p in own_parameters(e)}
    # the coefficient of a law may be a parameter that is declared
    shared = graph.declared_parameters
    own = {n for n, e in found.items() if n not in shared or n not in mentioned_names(e)}
    return tuple(p for n, p in graph.parameters.items() if n not in own)


def set_numbers(graph: BondGraph) -> tuple[Parameter, ...]:
    """Return the numbers of laws that `with_values` changed: kept beside the elements."""
    declared = {p.name for p in declared_parameters(graph)}
    return tuple(p for n, p in graph.declared_parameters.items() if n not in declared)


def mentioned_names(element: Element) -> frozenset[str]:
    """Return every name an element's expressions and references hold, signals as ``e_name``.

    The port variables of a field are its own and not among them.
    """
    found: set[str] = set()
    for label, value in _parts(element):
        for item in _flat(value):
            if isinstance(item, str):
                found.add(item)
            elif isinstance(item, sp.Basic):
                names = {str(s) for s in item.free_symbols}
                found |= {n for n in names if label in _REFERENCES or not _is_port(element, n)}
    return frozenset(found)


@dataclass(frozen=True)
class Renaming:
    """New names for elements, and what takes the place of parameters.

    Attributes
    ----------
    elements : mapping of str to str
        New names of elements; signals such as ``e_name`` follow.
    values : mapping of str to str or sympy.Expr
        New names (str) or replacements (expression) of parameters and of signals from outside.
    """

    elements: Mapping[str, str]
    values: Mapping[str, Replacement]

    def element(self, e: Element) -> Element:
        """Return `e` under its new name, with everything it mentions renamed.

        Raises
        ------
        GraphError
            A delay, a clock, a drift, the lag of a drive or the coefficient that a law shares would
            have to be an expression.
        """
        changes: dict[str, Any] = {"name": self.elements.get(e.name, e.name)}
        for label, value in _parts(e):
            if label == "drive":
                changes[label] = self._drive(e, value)
            elif label in _REFERENCES:
                changes[label] = self._references(e, label, value)
            else:
                changes[label] = self._value(e, value)
        with apart():
            return replace(e, **changes)

    def signal(self, name: str) -> str:
        """Return the new name of a signal such as ``e_body``, ``f_a>b`` or ``q_field1``."""
        match = _SIGNAL.fullmatch(name)
        if not match:
            return name
        letter, body = match.groups()
        if ">" in body:
            tail, head = body.split(">", 1)
            names = self.elements
            return f"{letter}_{names.get(tail, tail)}>{names.get(head, head)}"
        return f"{letter}_{self._body(body)}"

    def _body(self, body: str) -> str:
        if body in self.elements:
            return self.elements[body]
        port = _PORT.fullmatch(body)
        if port and port[1] in self.elements:
            return f"{self.elements[port[1]]}{port[2]}"
        return body

    def _value(self, e: Element, value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(self._value(e, v) for v in value)
        if isinstance(value, Law):
            return _with_names(value, lambda label, name: self._named(e, label, name))
        if isinstance(value, str):
            return self.values.get(value, value)
        if not isinstance(value, sp.Basic):
            return value
        table = {s: self._symbol(s) for s in value.free_symbols if not _is_port(e, str(s))}
        return value.xreplace(table)

    def _named(self, e: Element, label: str, name: str) -> str:
        """Return the new name of what a law reads beside its argument or shares."""
        if label == "beside" and not name.startswith("in_"):
            return self.signal(name)
        return str(self._references(e, label, name))

    def _symbol(self, s: sp.Symbol) -> sp.Expr:
        name = str(s)
        new = self.values.get(name, name)
        if not isinstance(new, str):
            return new
        if new == name and name not in self.values:
            new = self.signal(name)
        return s if new == name else symbol(new, positive=bool(s.is_positive))

    def _references(self, e: Element, label: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(self._references(e, label, v) for v in value)
        new = self.values.get(value, value)
        if new is None or isinstance(new, str):
            return new
        if isinstance(new, sp.Symbol):
            return str(new)
        raise GraphError(
            f"{e.name} ({e.kind}): its {label} {value!r} cannot be the expression {new}; "
            "declare a parameter for it"
        )

    def _drive(self, e: Element, drive: Drive) -> Drive:
        return replace(
            drive,
            lag=self._references(e, "lag", drive.lag),
            delay=self._references(e, "delay", drive.delay),
            law=self._value(e, drive.law),
        )


def reading_other_bond(e: Element, old: str, new: str) -> Element:
    """Return an element whose expressions and laws read the signals of another bond.

    Parameters
    ----------
    old, new : str
        Names such as ``a>b``.
    """
    signals = {symbol(f"{letter}_{old}"): symbol(f"{letter}_{new}") for letter in "ef"}
    texts = {str(s): str(new) for s, new in signals.items()}

    def turned(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(turned, value))
        if isinstance(value, Law):
            return _with_names(value, lambda label, n: texts.get(n, n) if label == "beside" else n)
        return value.xreplace(signals) if isinstance(value, sp.Basic) else value

    changed = {n: turned(v) for n, v in _parts(e) if n in _VALUES}
    changed = {n: v for n, v in changed.items() if v != getattr(e, n)}
    if not changed:
        return e
    with apart():
        return replace(e, **changed)


def _parts(e: Element) -> Iterator[tuple[str, Any]]:
    """Fields that may mention names."""
    for f in fields(e):
        value = getattr(e, f.name)
        if value is not None and f.name in (*_VALUES, *_REFERENCES, "drive"):
            yield f.name, value


def _with_names(law: Law, new: Callable[[str, str], str]) -> Law:
    """Return a law with other names for the signal it reads and the coefficient it shares."""
    changes: dict[str, Any] = {}
    for f in fields(law):
        value = getattr(law, f.name)
        if isinstance(value, Law):
            changes[f.name] = _with_names(value, new)
        elif isinstance(value, tuple):
            changes[f.name] = tuple(_with_names(v, new) if isinstance(v, Law) else v for v in value)
        elif value and isinstance(value, str) and f.name in _NAMES:
            changes[f.name] = new(f.name, value)
    changes = {n: v for n, v in changes.items() if v != getattr(law, n)}
    return replace(law, **changes) if changes else law


def _names_in(law: Law) -> Iterator[str]:
    """Names of the signal a law reads and of the coefficient it shares, of the laws in it too."""
    for f in fields(law):
        value = getattr(law, f.name)
        for v in value if isinstance(value, tuple) else (value,):
            if isinstance(v, Law):
                yield from _names_in(v)
            elif v and isinstance(v, str) and f.name in _NAMES:
                yield v


def _flat(value: Any) -> Iterator[Any]:
    if isinstance(value, Drive):
        yield from (v for v in (value.lag, value.delay) if v is not None)
        yield from _flat(value.law)
    elif isinstance(value, Law):
        yield from _names_in(value)
    elif isinstance(value, tuple):
        for v in value:
            yield from _flat(v)
    else:
        yield value


def _is_port(e: Element, name: str) -> bool:
    """Whether `name` is a port variable of the field `e`, such as ``q2``."""
    letter = getattr(e, "letter", "")
    return isinstance(e, Multiport) and bool(re.fullmatch(rf"{letter}\d+", name))
