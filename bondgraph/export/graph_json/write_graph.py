"""A bond graph as JSON, read back exactly by `bondgraph.export.graph_json.read_graph.from_json`."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from bondgraph.export.graph_json.element_forms import ElementForms, write_parameter
from bondgraph.export.graph_json.expression_table import Symbols
from bondgraph.export.graph_json.json_fields import TEXT
from bondgraph.export.graph_json.json_text import MAX_BYTES
from bondgraph.export.graph_json.law_forms import LawForm
from bondgraph.export.graph_json.read_graph import MAX_BONDS, MAX_ELEMENTS, SCHEMA
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Parameter, TwoPort, Valued
from bondgraph.support.errors import UnusableInput

__all__ = ["graph_schema", "to_json"]


def to_json(graph: BondGraph, *, laws: Iterable[LawForm] = ()) -> str:
    """Write a bond graph.

    Floats are written with the digits that read back to the same bits; fields at their defaults
    are left out. Memory of laws is the state of a simulation and not part of a graph.

    Parameters
    ----------
    graph : BondGraph
    laws : iterable of LawForm, optional
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
    forms = ElementForms(laws)
    declared = _declared(graph)
    values = {n: None for n, e in graph.elements.items() if isinstance(e, Valued | TwoPort)}
    symbols = Symbols(declared, values)
    parameters = [write_parameter(p, f"{where}: parameter {n}") for n, p in declared.items()]
    elements = [forms.write(e, f"{where}: {n}", symbols) for n, e in graph.elements.items()]
    bonds = [[b.tail, b.head] for b in graph.bonds]
    head = {"schema": SCHEMA, "name": TEXT.write(graph.name, f"{where}: name", None)}
    lines = [f"{_line(k)}: {_line(v)}" for k, v in head.items()]
    lists: dict[str, list[Any]] = {"parameters": parameters, "elements": elements, "bonds": bonds}
    lines += [f"{_line(k)}: {_lines(v)}" for k, v in lists.items()]
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    if len(text) > MAX_BYTES:
        raise UnusableInput(f"{where}: the file would have more than {MAX_BYTES // 2**20} MiB")
    return text


def graph_schema() -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of the format, for other programs.

    Examples
    --------
    >>> graph_schema()["properties"]["schema"]
    {'const': 'bondsight-graph/1'}
    """
    file = Path(__file__).with_name("graph.schema.json")
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


def _declared(graph: BondGraph) -> Mapping[str, Parameter]:
    return graph.declared_parameters


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
