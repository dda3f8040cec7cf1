"""A bond graph as JSON, read back exactly by `bondgraph.export.graph_json.read_graph.from_json`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from bondgraph.export.graph_json.element_forms import ElementForms
from bondgraph.export.graph_json.expression_table import Symbols
from bondgraph.export.graph_json.read_graph import MAX_BONDS, MAX_ELEMENTS, SCHEMA
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import TwoPort, Valued
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Law
from bondgraph.support.errors import UnusableInput
from bondgraph.support.json_text import MAX_BYTES
from bondgraph.support.typed_reader import off_default, read, record


def to_json(graph: BondGraph, *, laws: Iterable[type[Law]] = ()) -> str:
    """Write a bond graph.

    Floats are written with the digits that read back to the same bits; fields at their defaults
    are left out. Memory of laws is the state of a simulation and not part of a graph.

    Parameters
    ----------
    graph : BondGraph
    laws : iterable of type of Law, optional
        Laws beside those of `bondgraph.laws` that the graph holds.

    Returns
    -------
    str
        One element, bond and parameter a line.

    Raises
    ------
    UnusableInput
        If something has no place in a file: a class that is not of the language, an expression
        with another function, a value that is not finite, a graph beyond the bounds of the reader.

    Examples
    --------
    >>> from bondgraph import BondGraph, R, Se
    >>> with BondGraph("heater") as g:
    ...     _ = Se("V", unit="V") >> R("R_1", 1e3, unit="ohm")
    >>> print(to_json(g), end="")
    {
    "schema": "bondsight-graph/1",
    "name": "heater",
    "parameters": [],
    "elements": [
     {"kind": "Se", "name": "V", "unit": "V"},
     {"kind": "R", "name": "R_1", "value": 1000.0, "unit": "ohm"}],
    "bonds": [
     ["V", "R_1"]]
    }
    """
    where = ascii(graph.name)[1:-1]
    _check_sizes(graph, where)
    values = {n: None for n, e in graph.elements.items() if isinstance(e, Valued | TwoPort)}
    forms = ElementForms(Symbols(graph.declared_parameters, values), laws)
    parameters = [_parameter(p, f"{where}: {n}") for n, p in graph.declared_parameters.items()]
    elements = [forms.write(e, f"{where}: {n}") for n, e in graph.elements.items()]
    bonds = [[b.tail, b.head] for b in graph.bonds]
    head = {"schema": SCHEMA, "name": read(str, graph.name, f"{where}: name")}
    lines = [f"{_line(k)}: {_line(v)}" for k, v in head.items()]
    lists: dict[str, list[Any]] = {"parameters": parameters, "elements": elements, "bonds": bonds}
    lines += [f"{_line(k)}: {_lines(v)}" for k, v in lists.items()]
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    if len(text) > MAX_BYTES:
        raise UnusableInput(f"{where}: the file would have more than {MAX_BYTES // 2**20} MiB")
    return text


def _parameter(parameter: Parameter, place: str) -> dict[str, Any]:
    fields = dict(off_default(parameter))
    record(Parameter, fields, place)  # what is written can be read
    return fields


def _check_sizes(graph: BondGraph, where: str) -> None:
    for what, count, most in (
        ("elements", len(graph.elements), MAX_ELEMENTS),
        ("bonds", len(graph.bonds), MAX_BONDS),
    ):
        if count > most:
            raise UnusableInput(f"{where}: {count} {what} are more than the {most} of a file")


def _lines(entries: list[Any]) -> str:
    return "[\n " + ",\n ".join(map(_line, entries)) + "]" if entries else "[]"


def _line(entry: Any) -> str:
    return json.dumps(entry, allow_nan=False)
