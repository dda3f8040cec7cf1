"""Elements as plain data: a fixed table of classes and a form for every field."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from bondgraph.export.graph_json.expression_table import Symbols
from bondgraph.export.graph_json.expression_tree import EXPRESSION
from bondgraph.export.graph_json.json_fields import (
    FLAG,
    NAME,
    NUMBER,
    POSITIVE,
    TEXT,
    Form,
    choice,
    hint,
    integer,
    listed,
    optional,
    require_object,
    shown,
)
from bondgraph.export.graph_json.law_forms import (
    LawForm,
    built,
    drive_form,
    law_form,
    laws_by_name,
    read_fields,
    write_fields,
)
from bondgraph.graph import elements
from bondgraph.graph.elements import Element, Field, Parameter
from bondgraph.support.errors import UnusableInput

__all__ = ["ELEMENTS", "PARAMETER_FIELDS", "ElementForms", "read_parameter", "write_parameter"]

MAX_PORTS = 1000

ELEMENTS: Mapping[str, type[Element]] = {
    cls.kind: cls
    for cls in (
        elements.Zero,
        elements.One,
        elements.X0,
        elements.X1,
        elements.Se,
        elements.Sf,
        elements.MSe,
        elements.MSf,
        elements.R,
        elements.C,
        elements.I,
        elements.TF,
        elements.GY,
        elements.MTF,
        elements.MGY,
        elements.RE,
        elements.RS,
        elements.CField,
        elements.IField,
        elements.RField,
        elements.De,
        elements.Df,
        elements.Dq,
    )
}
"""Every element of the language by its kind."""

PARAMETER_FIELDS: Mapping[str, Form] = {
    "name": NAME,
    "value": NUMBER,
    "unit": TEXT,
    "positive": FLAG,
    "lower": optional(NUMBER),
    "upper": optional(NUMBER),
    "scale": optional(NUMBER),
    "fixed": FLAG,
    "source": TEXT,
    "spread": optional(POSITIVE),
}


def write_parameter(parameter: Parameter, place: str) -> dict[str, Any]:
    """Return a declared parameter as plain data."""
    return write_fields(parameter, PARAMETER_FIELDS, place, None)


def read_parameter(value: Any, place: str) -> Parameter:
    """Return a declared parameter from plain data."""
    data = require_object(value, place, "a parameter with name and value")
    values = read_fields(data, Parameter, PARAMETER_FIELDS, place, None, "a parameter")
    values["value"] = float(values["value"])
    return Parameter(**values)


class ElementForms:
    """How elements are read and written, with the laws that files may hold.

    Parameters
    ----------
    more : iterable of LawForm
        Laws beside those of `bondgraph.laws`.
    """

    def __init__(self, more: Iterable[LawForm] = ()) -> None:
        laws = laws_by_name(more)
        law = optional(law_form(laws))
        values = listed(EXPRESSION, most=MAX_PORTS)
        common: dict[str, Form] = {
            "unit": TEXT,
            "units": listed(TEXT, most=MAX_PORTS),
            "drive": optional(drive_form(laws)),
            "offset": optional(NAME),
            "stiffness": optional(EXPRESSION),
            "ratio": EXPRESSION,
            "fixed": FLAG,
            "on": FLAG,
            "spread": optional(POSITIVE),
            "source": TEXT,
            "ports": integer(1, MAX_PORTS),
            "matrix": listed(values, most=MAX_PORTS),
            "energy": optional(EXPRESSION),
            "heat": choice("energy", "entropy"),
            "lag": optional(NAME),
            "delay": optional(NAME),
            "clock": optional(NAME),
            "drift": listed(NAME, most=MAX_PORTS),
            "value": optional(EXPRESSION),
            "law": law,
        }
        self._forms: dict[str, dict[str, Form]] = {}
        for kind, cls in ELEMENTS.items():
            own = {f.name: common[f.name] for f in fields(cls) if f.name in common}
            if issubclass(cls, Field):
                own["law"] = values
            self._forms[kind] = own

    def write(self, element: Element, place: str, symbols: Symbols) -> dict[str, Any]:
        """Return an element as plain data.

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
        head = {"kind": element.kind, "name": NAME.write(element.name, place, symbols)}
        return head | write_fields(element, self._forms[element.kind], place, symbols)

    def read(self, data: Mapping[str, Any], place: str, symbols: Symbols) -> Element:
        """Return an element from plain data whose kind and name have been checked.

        Raises
        ------
        UnusableInput
            If a field is unknown or its value is refused.
        """
        kind = data["kind"]
        rest = {k: v for k, v in data.items() if k not in ("kind", "name")}
        values = read_fields(rest, ELEMENTS[kind], self._forms[kind], place, symbols, kind)
        found: Element = built(lambda: ELEMENTS[kind](data["name"], **values), place)
        return found


def checked_kind(data: Mapping[str, Any], place: str) -> type[Element]:
    """Return the class of an element's data.

    Raises
    ------
    UnusableInput
        If the kind is missing or unknown.
    """
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in ELEMENTS:
        raise UnusableInput(f"{place}: no element kind {shown(kind)}{hint(kind, tuple(ELEMENTS))}")
    return ELEMENTS[kind]
