"""The JSON Schema of a graph's JSON, from the classes of elements, laws and operators."""

from __future__ import annotations

from collections.abc import Mapping
from types import NoneType
from typing import Annotated, Any, get_args, get_origin

from bondgraph.export.graph_json.element_forms import ELEMENTS, NAMED, laws_by_name
from bondgraph.export.graph_json.expression_table import CONSTANTS, OPERATIONS
from bondgraph.export.graph_json.read_graph import SCHEMA
from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import Parameter
from bondgraph.hysteresis import Operator
from bondgraph.hysteresis.catalogue import OPERATORS
from bondgraph.laws import Law
from bondgraph.support.bounds import Name, Signal
from bondgraph.support.typed_reader import MAX_TEXT, Rules, hints_of, needed

Schema = dict[str, Any]
_RULES = Rules(names=NAMED)
_BASES = {Law: "law", Operator: "operator", Drive: "drive"}
_SCALARS: Mapping[Any, Schema] = {
    float: {"type": "number"},
    int: {"type": "integer"},
    bool: {"type": "boolean"},
    str: {"type": "string", "maxLength": MAX_TEXT},
    NoneType: {"type": "null"},
}


def graph_schema() -> Schema:
    """Return the JSON Schema (2020-12) of the format, for other programs.

    Examples
    --------
    >>> graph_schema()["properties"]["schema"]
    {'const': 'bondsight-graph/1'}
    """
    laws = laws_by_name()
    name = _of(Name, "value")
    unknown = {"allOf": [name, {"not": {"enum": list(laws)}}]}
    own = {"type": "object", "properties": {"law": unknown}, "required": ["law"]}
    elements = {
        "parameters": {"$ref": "#/$defs/parameter"},
        "elements": {"$ref": "#/$defs/element"},
        "bonds": {
            "description": "Tail and head; the half arrow points at the head. The order of the "
            "bonds numbers the ports of fields.",
            **_tuple([name, name]),
        },
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Bond graph of Bondsight",
        "description": "Elements joined by power bonds. Fields left out have the default of the "
        "element's class. Units are SI.",
        "type": "object",
        "properties": {
            "schema": {"const": SCHEMA},
            "name": _of(str, "value"),
            **{k: {"type": "array", "items": v} for k, v in elements.items()},
        },
        "required": ["schema", "name", "elements"],
        "additionalProperties": False,
        "$defs": {
            "value": {
                "description": "A number, the name of a declared parameter, or an expression.",
                "anyOf": [_SCALARS[float], name, {"$ref": "#/$defs/operation"}],
            },
            "operation": _operation(name),
            "parameter": _record(Parameter),
            "drive": _record(Drive),
            "law": {
                "description": "A constitutive law and its fields. A program may know more laws "
                "than these.",
                "oneOf": [*(_record(law, "value", law=n) for n, law in laws.items()), own],
            },
            "operator": {
                "description": "An operator with memory and all its parameters.",
                "oneOf": [_record(cls, "number", kind=k) for k, cls in OPERATORS.items()],
            },
            "number": _SCALARS[float],
            "element": {"oneOf": [_record(cls, "value", kind=k) for k, cls in ELEMENTS.items()]},
        },
    }


def _record(cls: Any, other: str = "value", **tag: str) -> Schema:
    """Return the schema of a dataclass with a tag; `other` stands for the annotation `Any`."""
    fields = {k: _of(v, other) for k, v in hints_of(cls, _RULES).items()}
    return {
        "description": (cls.__doc__ or "").strip().split("\n")[0],
        "type": "object",
        "properties": {**{k: {"const": v} for k, v in tag.items()}, **fields},
        "required": [*tag, *(fields if other == "number" else needed(cls))],
        "additionalProperties": False,
    }


def _of(kind: Any, other: str) -> Schema:
    """Return the schema of an annotation."""
    if kind in _SCALARS:
        return dict(_SCALARS[kind])
    if isinstance(kind, type) and (base := next((b for b in _BASES if issubclass(kind, b)), None)):
        return {"$ref": f"#/$defs/{_BASES[base]}"}
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        found = _of(inner[0], other)
        for bound in kind.__metadata__:
            found |= bound.schema
        return found
    if kind is Any or (Any in inner and NoneType not in inner and origin is not tuple):
        return {"$ref": f"#/$defs/{other}"}
    if origin is tuple:
        each = _of(inner[0], other)
        return {"type": "array", "items": each}
    kinds = [Any, NoneType] if Any in inner else inner
    return {"anyOf": [_of(k, other) for k in kinds]}


def _tuple(entries: list[Any]) -> Schema:
    return {"type": "array", "prefixItems": entries, "items": False, "minItems": len(entries)}


def _operation(name: Schema) -> Schema:
    operand = {"$ref": "#/$defs/value"}
    return {
        "description": 'An operation and its operands, such as ["+", "a", ["*", 2, "b"]]. Names '
        "are declared parameters, elements with a value, or signals such as e_R_1, f_R_1, q_C_1, "
        'p_I_1, in_command, time. ["symbol", name, "positive" or "real"] names a symbol with its '
        "assumption.",
        "type": "array",
        "minItems": 1,
        "oneOf": [
            {"prefixItems": [{"enum": list(OPERATIONS)}], "items": operand, "minItems": 2},
            _tuple([{"enum": list(CONSTANTS)}]),
            _tuple([{"const": "symbol"}, _of(Signal, "value"), {"enum": ["positive", "real"]}]),
        ],
    }
