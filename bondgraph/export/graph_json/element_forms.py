"""Elements and laws as plain data: a fixed table of classes, whose fields are the form.

Only classes of the tables are ever built; every field is checked before.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass
from typing import Any

import sympy as sp

from bondgraph import laws
from bondgraph.export.graph_json.expression_table import Symbols
from bondgraph.export.graph_json.expression_tree import read_expression, write_expression
from bondgraph.graph import elements, sensors
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Element
from bondgraph.hysteresis import Operator
from bondgraph.hysteresis.catalogue import read_operator
from bondgraph.laws import Law
from bondgraph.support.errors import UnusableInput
from bondgraph.support.typed_reader import (
    Rules,
    chosen,
    make,
    off_default,
    read_fields,
    record,
    require_object,
)

NAMED: tuple[type, ...] = (Law, Drive, Operator)
"""Classes that annotations of elements name without importing them."""

ELEMENTS: Mapping[str, type[Element]] = {
    cls.kind: cls
    for cls in (*vars(elements).values(), *vars(sensors).values())
    if isinstance(cls, type) and issubclass(cls, Element) and cls.kind
}
"""Every element of the language by its kind."""

LAWS: tuple[type[Law], ...] = tuple(
    law
    for law in (getattr(laws, name) for name in dir(laws))
    if isinstance(law, type) and issubclass(law, Law) and law is not Law
)
"""The laws of `bondgraph.laws`; a law of your own is given beside them."""


def laws_by_name(more: Iterable[type[Law]] = ()) -> dict[str, type[Law]]:
    """Return the laws that files may hold by their names.

    Raises
    ------
    UnusableInput
        If two laws have one name.
    """
    found: dict[str, type[Law]] = {}
    for law in (*LAWS, *more):
        if found.setdefault(law.name, law) is not law:
            raise UnusableInput(f"two laws are called {law.name!r} in files; rename one")
    return found


class ElementForms:
    """How elements are read and written.

    Parameters
    ----------
    symbols : Symbols
        What names in expressions mean.
    more : iterable of type of Law
        Laws beside those of `bondgraph.laws`.
    """

    def __init__(self, symbols: Symbols, more: Iterable[type[Law]] = ()) -> None:
        self._symbols = symbols
        self._laws = laws_by_name(more)
        readers = {
            Any: lambda _, value, place: read_expression(value, place, symbols),
            Law: self._read_law,
            Operator: read_operator,
        }
        self._rules = Rules(readers, NAMED)

    def read(self, data: Mapping[str, Any], place: str) -> Element:
        """Return an element from plain data.

        Raises
        ------
        UnusableInput
            If its kind or a field is unknown or a value is refused.
        """
        cls = chosen(ELEMENTS, data.get("kind"), place, "element kind")
        fields = {k: v for k, v in data.items() if k != "kind"}
        return record(cls, fields, place, self._rules, cls.kind)

    def write(self, element: Element, place: str) -> dict[str, Any]:
        """Return an element as plain data: its fields that are not at their defaults.

        Raises
        ------
        UnusableInput
            If its class, a law or a value has no place in a file.
        """
        if ELEMENTS.get(element.kind) is not type(element):
            raise UnusableInput(
                f"{place}: {type(element).__name__} has no place in a file; "
                f"known: {', '.join(ELEMENTS)}"
            )
        fields = self._fields(element, place)
        # what is written can be read
        read_fields(type(element), fields, place, self._rules, element.kind)
        return {"kind": element.kind, **fields}

    def _fields(self, value: Any, place: str) -> dict[str, Any]:
        return {k: self._plain(v, f"{place}.{k}") for k, v in off_default(value)}

    def _plain(self, value: Any, place: str) -> Any:
        if isinstance(value, sp.Basic):
            return write_expression(value, place, self._symbols)
        if isinstance(value, tuple):
            return [self._plain(v, f"{place}[{i}]") for i, v in enumerate(value)]
        if isinstance(value, Operator):
            return make(value.to_dict, place)
        if isinstance(value, Law):
            if self._laws.get(value.name) is not type(value):
                raise UnusableInput(
                    f"{place}: {type(value).__name__} has no place in a file; "
                    f"known: {', '.join(self._laws)}; give further laws as laws=..."
                )
            return {"law": value.name, **self._fields(value, place)}
        return self._fields(value, place) if is_dataclass(value) else value

    def _read_law(self, wanted: Any, value: Any, place: str) -> Law:
        data = dict(require_object(value, place, "a law with its name and fields"))
        name = data.pop("law", None)
        cls = chosen(self._laws, name, place, "law")
        if not issubclass(cls, wanted):
            raise UnusableInput(f"{place}: law {name!r} is no {wanted.__name__}")
        return record(cls, data, place, self._rules, f"law {name!r}")
