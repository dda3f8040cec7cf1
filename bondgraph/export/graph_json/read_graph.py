"""A bond graph from JSON; safe to use on files of strangers.

The format is written by `bondgraph.export.graph_json.write_graph.to_json` and described by the JSON
Schema ``graph.schema.json`` beside it. Nothing in a file is executed, parsed as an expression or
looked up outside of fixed tables; sizes are bounded before anything is built.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bondgraph.export.graph_json.element_forms import ElementForms, checked_kind, read_parameter
from bondgraph.export.graph_json.expression_table import Symbols
from bondgraph.export.graph_json.json_fields import (
    NAME,
    TEXT,
    bad,
    hint,
    require_known,
    require_list,
    require_object,
    shown,
)
from bondgraph.export.graph_json.json_text import plain_data
from bondgraph.export.graph_json.law_forms import LawForm, built
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, TwoPort, Valued
from bondgraph.support.errors import UnusableInput

__all__ = ["MAX_BONDS", "MAX_ELEMENTS", "SCHEMA", "from_json"]

SCHEMA = "bondsight-graph/1"
"""Name and version of the format."""
MAX_ELEMENTS = 200_000
MAX_BONDS = 400_000
MAX_PARAMETERS = 100_000
_KEYS = ("schema", "name", "parameters", "elements", "bonds")


def from_json(text_or_path: str | Path, *, laws: Iterable[LawForm] = ()) -> BondGraph:
    """Read a bond graph.

    The graph is not checked for physics: see `BondGraph.check`.

    Parameters
    ----------
    text_or_path : str or Path
        JSON text that begins with ``{``, or the path of a file.
    laws : iterable of LawForm, optional
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
    _check_schema(data, where)
    require_known(data, _KEYS, where, "key of a graph")
    for key in ("name", "elements"):
        if key not in data:
            raise UnusableInput(f"{where}: the graph needs its {key!r}")
    forms = ElementForms(laws)
    entries = _entries(data, "elements", where, MAX_ELEMENTS)
    classes = _classes(entries, where)
    symbols = Symbols(_parameters(data, where), _values(entries, classes))
    with BondGraph(TEXT.read(data["name"], f"{where}: name", None)) as graph:
        for p in symbols.parameters.values():
            graph.parameter(
                p.name,
                p.value,
                p.unit,
                positive=p.positive,
                lower=p.lower,
                upper=p.upper,
                scale=p.scale,
                fixed=p.fixed,
                source=p.source,
                spread=p.spread,
            )
        for i, entry in enumerate(entries):
            forms.read(entry, f"{where}: elements[{i}] {entry['name']}", symbols)
        _draw(graph, _entries(data, "bonds", where, MAX_BONDS), where)
    return graph


def _check_schema(data: Mapping[str, Any], where: str) -> None:
    if data.get("schema") != SCHEMA:
        raise UnusableInput(
            f"{where}: schema {shown(data.get('schema'))} cannot be read; this version of "
            f"Bondsight reads {SCHEMA!r}"
        )


def _entries(data: Mapping[str, Any], key: str, where: str, most: int) -> Sequence[Any]:
    return require_list(data.get(key, []), f"{where}: {key}", key, most)


def _parameters(data: Mapping[str, Any], where: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for i, entry in enumerate(_entries(data, "parameters", where, MAX_PARAMETERS)):
        place = f"{where}: parameters[{i}]"
        parameter = read_parameter(entry, place)
        if parameter.name in found:
            raise UnusableInput(f"{place}: {shown(parameter.name)} is declared twice; rename one")
        found[parameter.name] = parameter
    return found


def _classes(entries: Sequence[Any], where: str) -> dict[str, Any]:
    """Names and classes of all elements, before any is built: expressions may name later ones."""
    found: dict[str, Any] = {}
    for i, entry in enumerate(entries):
        place = f"{where}: elements[{i}]"
        cls = checked_kind(require_object(entry, place, "an element with kind and name"), place)
        name = NAME.read(entry.get("name"), f"{place}.name", None)
        if name in found:
            raise UnusableInput(f"{place}: two elements are called {shown(name)}; rename one")
        found[name] = cls
    return found


def _values(entries: Sequence[Any], classes: Mapping[str, Any]) -> dict[str, float | None]:
    """Elements with a coefficient of their own, and their numbers where the data give one."""
    found: dict[str, float | None] = {}
    for entry in entries:
        cls = classes[entry["name"]]
        if issubclass(cls, Valued | TwoPort):
            key = "ratio" if issubclass(cls, TwoPort) else "value"
            key = "stiffness" if issubclass(cls, C) and "stiffness" in entry else key
            value = entry.get(key)
            plain = isinstance(value, int | float) and not isinstance(value, bool)
            found[entry["name"]] = float(value) if plain else None
    return found


def _draw(graph: BondGraph, bonds: Sequence[Any], where: str) -> None:
    for i, entry in enumerate(bonds):
        place = f"{where}: bonds[{i}]"
        if not isinstance(entry, list) or len(entry) != 2:
            raise bad(place, entry, "a pair [tail, head] of element names")
        for end in entry:
            if not isinstance(end, str) or end not in graph.elements:
                raise UnusableInput(
                    f"{place}: no element {shown(end)}{hint(end, tuple(graph.elements))}"
                )
        tail, head = (graph.elements[end] for end in entry)
        built(lambda tail=tail, head=head: graph.bond(tail, head), place)
