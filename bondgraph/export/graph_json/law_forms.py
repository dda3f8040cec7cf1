"""Laws, operators and drives as plain data: a fixed table of classes and of their fields.

Only classes of the table are ever built; every field is checked before.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any

import numpy as np

from bondgraph.export.graph_json.effect_law_forms import EFFECT_LAWS
from bondgraph.export.graph_json.json_fields import (
    FLAG,
    NAME,
    NON_NEGATIVE,
    NUMBER,
    POSITIVE,
    TEXT,
    Form,
    bad,
    choice,
    hint,
    integer,
    listed,
    optional,
    require_known,
    require_list,
    require_object,
    rising,
    shown,
)
from bondgraph.graph.drives import Drive
from bondgraph.hysteresis import Operator
from bondgraph.hysteresis.catalogue import OPERATORS, operator_from_dict
from bondgraph.laws import (
    Coulomb,
    DeadZone,
    Hysteretic,
    Law,
    LuGre,
    Parametrised,
    PiecewiseLinear,
    Polynomial,
    QuadraticDrag,
    Rectifier,
    Rounding,
    Saturation,
    SlewLimit,
    Sliding,
    StopSum,
    Stribeck,
    TableLaw,
    Viscous,
)
from bondgraph.support.errors import BondsightError, UnusableInput

__all__ = ["LAWS", "OPERATOR", "LawForm", "drive_form", "law_form", "laws_by_name"]

MAX_NESTING = 16
MAX_COUNT = 10_000
"""Bound on whole numbers that say how many hysterons an operator makes."""
_BUILD_ERRORS = (
    BondsightError,
    ArithmeticError,
    AttributeError,
    LookupError,
    TypeError,
    ValueError,
    RuntimeWarning,
)


@dataclass(frozen=True, slots=True)
class LawForm:
    """A law that files may hold.

    Attributes
    ----------
    law : type of Law
        Its `name` stands in files.
    fields : mapping of str to Form
        One form for each field of the dataclass.
    """

    law: type[Law]
    fields: Mapping[str, Form]


def built(make: Any, place: str) -> Any:
    """Return ``make()``; what it raises becomes one line with the place."""
    try:
        with np.errstate(all="ignore"):
            return make()
    except _BUILD_ERRORS as error:
        text = str(error) if isinstance(error, BondsightError) else type(error).__name__
        raise UnusableInput(f"{place}: {text}") from None


def _read_operator(value: Any, place: str, _: Any) -> Operator:
    _check_operator(value, place, 0)
    found: Operator = built(lambda: operator_from_dict(value), place)
    return found


def _write_operator(value: Any, place: str, _: Any) -> dict[str, Any]:
    if not isinstance(value, Operator):
        raise bad(place, str(value), "an operator")
    data: dict[str, Any] = built(value.to_dict, place)
    _check_operator(data, place, 0)
    return data


def _check_operator(value: Any, place: str, depth: int) -> None:
    found = require_object(value, place, "an operator with its kind and parameters")
    if depth > MAX_NESTING:
        raise UnusableInput(f"{place}: operators are nested deeper than {MAX_NESTING} levels")
    kind = found.get("kind")
    if not isinstance(kind, str) or kind not in OPERATORS:
        raise UnusableInput(
            f"{place}: no operator kind {shown(kind)}{hint(kind, tuple(OPERATORS))}"
        )
    names = tuple(f.name for f in fields(OPERATORS[kind]))  # type: ignore[arg-type]
    given = [k for k in found if k != "kind"]
    require_known(given, names, place, f"parameter of {kind}")
    for name in names:
        if name not in found:
            raise UnusableInput(f"{place}: {kind} needs its parameter {name!r}")
        _check_entry(name, found[name], f"{place}.{name}", depth)


def _check_entry(name: str, value: Any, place: str, depth: int) -> None:
    if isinstance(value, dict):
        _check_operator(value, place, depth + 1)
    elif isinstance(value, list):
        for i, entry in enumerate(require_list(value, place, "numbers")):
            NUMBER.read(entry, f"{place}[{i}]", None)
    elif name == "count":
        integer(0, MAX_COUNT).read(value, place, None)
    else:
        NUMBER.read(value, place, None)


OPERATOR = Form(_read_operator, _write_operator)
_UNITS = {"unit": TEXT}
_FRICTION = {"force": NON_NEGATIVE, "drop": NON_NEGATIVE, "speed": POSITIVE, "flow_unit": TEXT}


def _apart(value: Any, place: str) -> Any:
    found = NUMBER.read(value, place, None)
    if found == 0:
        raise bad(place, value, "a number other than 0")
    return found


_NONZERO = Form(lambda v, place, _: _apart(v, place), lambda v, place, _: _apart(v, place))


def _inner() -> dict[str, LawForm]:
    """Laws that another one may lift: itself excepted, so that files cannot nest without end."""
    return {n: form for n, form in laws_by_name().items() if form.law is not Parametrised}


_LIFTED_LAW = Form(
    lambda v, place, symbols: law_form(_inner()).read(v, place, symbols),
    lambda v, place, symbols: law_form(_inner()).write(v, place, symbols),
)

LAWS: tuple[LawForm, ...] = (
    LawForm(Coulomb, {"force": NON_NEGATIVE} | _UNITS),
    LawForm(Stribeck, _FRICTION | _UNITS),
    LawForm(Viscous, {"coefficient": NON_NEGATIVE} | _UNITS),
    LawForm(QuadraticDrag, {"coefficient": NON_NEGATIVE} | _UNITS),
    LawForm(LuGre, _FRICTION | {"bristle": POSITIVE, "damping": NON_NEGATIVE} | _UNITS),
    LawForm(Saturation, {"low": NUMBER, "high": NUMBER, "knee": NON_NEGATIVE} | _UNITS),
    LawForm(DeadZone, {"centre": NUMBER, "width": NON_NEGATIVE, "size": NUMBER} | _UNITS),
    LawForm(PiecewiseLinear, {"knots": rising(2), "size": NUMBER} | _UNITS),
    LawForm(Hysteretic, {"operator": OPERATOR, "free": listed(TEXT)}),
    LawForm(
        Polynomial,
        {"centre": NUMBER, "half": _NONZERO, "size": NUMBER, "orders": listed(integer(0, 64))}
        | _UNITS,
    ),
    LawForm(Rectifier, {"amount": NUMBER}),
    LawForm(Rounding, {"step": POSITIVE, "origin": NUMBER, "amount": NUMBER} | _UNITS),
    LawForm(SlewLimit, {"slowness": NON_NEGATIVE, "size": POSITIVE} | _UNITS),
    LawForm(Sliding, {"operator": OPERATOR}),
    LawForm(
        StopSum,
        {"thresholds": listed(NON_NEGATIVE), "height": NUMBER, "scale": NUMBER, "sign": NUMBER}
        | _UNITS,
    ),
    LawForm(
        TableLaw,
        {
            "knots": rising(2),
            "values": listed(NUMBER, 2),
            "join": choice("linear", "pchip"),
            "flat": FLAG,
            "free": FLAG,
            "reference": NUMBER,
        }
        | _UNITS,
    ),
    *(LawForm(law, forms) for law, forms in EFFECT_LAWS),
    LawForm(Parametrised, {"inner": _LIFTED_LAW, "lifted": listed(NAME, 1)}),
)
"""The laws of `bondgraph.laws`; a law of your own is given beside them."""


def laws_by_name(more: Iterable[LawForm] = ()) -> dict[str, LawForm]:
    """Return the laws that files may hold by their names.

    Raises
    ------
    UnusableInput
        If two laws have one name.
    """
    found: dict[str, LawForm] = {}
    for form in (*LAWS, *more):
        if form.law.name in found:
            raise UnusableInput(f"two laws are called {form.law.name!r} in files; rename one")
        found[form.law.name] = form
    return found


def write_fields(value: Any, forms: Mapping[str, Form], place: str, symbols: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that differ from their defaults, as plain data."""
    data: dict[str, Any] = {}
    for f in fields(value):
        held = getattr(value, f.name)
        if f.name not in forms or (f.default is not MISSING and _same(held, f.default)):
            continue
        data[f.name] = forms[f.name].write(held, f"{place}.{f.name}", symbols)
    return data


def _same(held: Any, default: Any) -> bool:
    return held is default or (type(held) is type(default) and held == default)


def read_fields(
    data: Mapping[str, Any],
    cls: type[Any],
    forms: Mapping[str, Form],
    place: str,
    symbols: Any,
    what: str,
) -> dict[str, Any]:
    """Return checked fields of a dataclass from plain data.

    Raises
    ------
    UnusableInput
        For an unknown or missing field, and for a value that its form refuses.
    """
    require_known(data, forms, place, f"field of {what}")
    for f in fields(cls):
        needed = f.default is MISSING and f.default_factory is MISSING and f.name in forms
        if needed and f.name not in data:
            raise UnusableInput(f"{place}: {what} needs its field {f.name!r}")
    return {k: forms[k].read(v, f"{place}.{k}", symbols) for k, v in data.items()}


def law_form(laws: Mapping[str, LawForm]) -> Form:
    """Return the form of a law of the given table: an object with ``law`` and its fields."""

    def read(value: Any, place: str, symbols: Any) -> Law:
        data = dict(require_object(value, place, "a law with its name and fields"))
        name = data.pop("law", None)
        if not isinstance(name, str) or name not in laws:
            raise UnusableInput(f"{place}: no law {shown(name)}{hint(name, tuple(laws))}")
        form = laws[name]
        values = read_fields(data, form.law, form.fields, place, symbols, f"law {name!r}")
        found: Law = built(lambda: form.law(**values), place)
        return found

    def write(value: Any, place: str, symbols: Any) -> dict[str, Any]:
        form = laws.get(getattr(value, "name", ""))
        if form is None or form.law is not type(value):
            raise UnusableInput(
                f"{place}: {type(value).__name__} has no place in a file; "
                f"known: {', '.join(laws)}; give further laws as LawForm"
            )
        return {"law": form.law.name, **write_fields(value, form.fields, place, symbols)}

    return Form(read, write)


def drive_form(laws: Mapping[str, LawForm]) -> Form:
    """Return the form of a drive: an object with ``law``, ``lag`` and ``delay``."""
    forms = {"law": optional(law_form(laws)), "lag": optional(NAME), "delay": optional(NAME)}

    def read(value: Any, place: str, symbols: Any) -> Drive:
        data = require_object(value, place, "a drive with law, lag and delay")
        return Drive(**read_fields(data, Drive, forms, place, symbols, "drive"))

    def write(value: Any, place: str, symbols: Any) -> dict[str, Any]:
        if not isinstance(value, Drive):
            raise bad(place, str(value), "a drive")
        return write_fields(value, forms, place, symbols)

    return Form(read, write)
