"""A bond graph from JSON; safe to use on files of strangers.

The format is written by `bondgraph.export.graph_json.write_graph.to_json` and described by the JSON
Schema of `bondgraph.export.graph_json.schema`. Nothing in a file is executed, parsed as an
expression or looked up outside of fixed tables; sizes are bounded before anything is built.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from bondgraph.export.graph_json.element_forms import ELEMENTS, ElementForms
from bondgraph.export.graph_json.expression_table import Symbols
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, TwoPort, Valued
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Law
from bondgraph.support.bounds import MAX_NAME
from bondgraph.support.errors import UnusableInput
from bondgraph.support.json_text import plain_data
from bondgraph.support.typed_reader import (
    bad,
    chosen,
    make,
    read,
    record,
    require_list,
    require_object,
    shown,
)

SCHEMA = "bondsight-graph/1"
"""Name and version of the format."""
MAX_ELEMENTS = 200_000
MAX_BONDS = 400_000
MAX_PARAMETERS = 100_000
_KEYS = {"schema": True, "name": True, "parameters": False, "elements": True, "bonds": False}
"""Keys of a graph and whether they are needed."""


def from_json(text_or_path: str | Path, *, laws: Iterable[type[Law]] = ()) -> BondGraph:
    """Read a bond graph.

    The graph is not checked for physics: see `BondGraph.check`.

    Parameters
    ----------
    text_or_path : str or Path
        JSON text that begins with ``{``, or the path of a file.
    laws : iterable of type of Law, optional
        Laws beside those of `bondgraph.laws` that the file may hold.

    Returns
    -------
    BondGraph
        With the elements, bonds and declared parameters in the order of the file.

    Raises
    ------
    UnusableInput
        One line: where in the file, what is wrong, what to write.

    Examples
    --------
    >>> g = from_json('{"schema": "bondsight-graph/1", "name": "rc", "elements": ['
    ...     '{"kind": "Se", "name": "V"}, {"kind": "1", "name": "loop"},'
    ...     '{"kind": "R", "name": "R_1", "value": 1e3}],'
    ...     '"bonds": [["V", "loop"], ["loop", "R_1"]]}')
    >>> g
    BondGraph('rc', 3 elements, 2 bonds)
    """
    value, where = plain_data(text_or_path)
    data = require_object(value, where, "a graph")
    _check_head(data, where)
    entries = require_list(data["elements"], f"{where}: elements", MAX_ELEMENTS)
    with BondGraph(read(str, data["name"], f"{where}: name")) as graph:
        _declare(graph, data.get("parameters", []), f"{where}: parameters")
        forms = ElementForms(Symbols(graph.declared_parameters, _values(entries)), laws)
        for i, entry in enumerate(entries):
            place = f"{where}: elements[{i}]"
            name = require_object(entry, place, "an element with kind and name").get("name")
            if isinstance(name, str) and name.isidentifier() and name.isascii():
                place += f" {name[:MAX_NAME]}"
            forms.read(entry, place)
        _draw(graph, data.get("bonds", []), f"{where}: bonds")
    return graph


def _check_head(data: Mapping[str, Any], where: str) -> None:
    if data.get("schema") != SCHEMA:
        raise UnusableInput(
            f"{where}: schema {shown(data.get('schema'))} cannot be read; this version of "
            f"Bondsight reads {SCHEMA!r}"
        )
    for key in data:
        chosen(_KEYS, key, where, "key of a graph")
    for key, needed in _KEYS.items():
        if needed and key not in data:
            raise UnusableInput(f"{where}: the graph needs its {key!r}")


def _declare(graph: BondGraph, entries: Any, where: str) -> None:
    for i, entry in enumerate(require_list(entries, where, MAX_PARAMETERS)):
        place = f"{where}[{i}]"
        make(partial(graph.parameter, **asdict(record(Parameter, entry, place))), place)


def _values(entries: Sequence[Any]) -> dict[str, float | None]:
    """Elements with a coefficient, before any is built: expressions may name later ones.

    The value is the number where the data give one. What is malformed is refused later.
    """
    found: dict[str, float | None] = {}
    for entry in entries:
        data = entry if isinstance(entry, dict) else {}
        name, kind = data.get("name"), data.get("kind")
        cls = ELEMENTS.get(kind) if isinstance(kind, str) else None
        if isinstance(name, str) and cls is not None and issubclass(cls, Valued | TwoPort):
            key = "ratio" if issubclass(cls, TwoPort) else "value"
            key = "stiffness" if issubclass(cls, C) and "stiffness" in data else key
            value: Any = data.get(key)
            found[name] = float(value) if type(value) in (int, float) else None
    return found


def _draw(graph: BondGraph, bonds: Any, where: str) -> None:
    for i, entry in enumerate(require_list(bonds, where, MAX_BONDS)):
        place = f"{where}[{i}]"
        if not isinstance(entry, list) or len(entry) != 2:
            raise bad(place, entry, "a pair [tail, head] of element names")
        tail, head = (chosen(graph.elements, end, place, "element") for end in entry)
        make(partial(graph.bond, tail, head), place)
