"""Words, numbers, units and operations of Modelica (Language Specification 3.6)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from bondgraph.export.tape import ATOM, LOOSE, PLUS, TIMES, UNARY, Notation, Rule
from bondgraph.export.tape_languages import arithmetic, call
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import BondsightError, UnusableInput

MAX_NAME = 200
RESERVED = frozenset(
    # keywords
    "algorithm and annotation block break class connect connector constant constrainedby der "
    "discrete each else elseif elsewhen encapsulated end enumeration equation expandable extends "
    "external false final flow for function if import impure in initial inner input loop model "
    "not operator or outer output package parameter partial protected public pure record redeclare "
    "replaceable return stream then true type when while within "
    # built-in types, functions, operators and variables
    "Boolean Clock Connections ExternalObject Integer Real StateSelect AssertionLevel String abs "
    "acos actualStream activeState array asin assert atan atan2 backSample cardinality cat ceil "
    "change cos cosh cross delay diagonal div edge exp fill firstTick floor getInstanceName hold "
    "homotopy identity inStream initialState integer interval linspace log log10 matrix max min "
    "mod ndims noClock noEvent ones outerProduct pre previous product promote reinit rem "
    "rooted sample scalar semiLinear shiftSample sign sin sinh size skew smooth "
    "spatialDistribution sqrt subSample sum superSample symmetric tan tanh terminal terminate "
    "ticksInState time timeInState transition transpose vector zeros".split()
)
"""Names that a model may not declare."""


class Identifiers:
    """Names of a model, each an identifier that is neither reserved nor used twice.

    A sign that is no ASCII letter, digit or underscore becomes ``u`` and its code in hexadecimal
    digits; a reserved or used name gets underscores at its end.
    """

    def __init__(self) -> None:
        self._used = set(RESERVED)

    def new(self, name: str) -> str:
        """Return a new identifier like `name`.

        Raises
        ------
        UnusableInput
            If the name is empty or too long.

        Examples
        --------
        >>> names = Identifiers()
        >>> names.new("der"), names.new("x"), names.new("x"), names.new("V_\u00e9")
        ('der_', 'x', 'x_', 'V_u00e9')
        """
        if not name or len(name) > MAX_NAME:
            raise UnusableInput(
                f"a name of {len(name)} signs cannot stand in a Modelica model; use 1 to {MAX_NAME}"
            )
        found = re.sub(r"[^A-Za-z0-9_]", lambda c: f"u{ord(c[0]):04x}", name)
        if found[0].isdigit():
            found = "_" + found
        while found in self._used:
            found += "_"
        self._used.add(found)
        return found


def quoted(*parts: str) -> str:
    r"""Return texts as one Modelica string of printable ASCII that nothing can end early.

    It needs no escapes, on which readers differ: a quotation mark becomes an apostrophe, a
    backslash a slash.

    Examples
    --------
    >>> print(quoted('a "b"', "c\n"))
    "a 'b'; c"
    """
    joined = "; ".join(" ".join(p.split()) for p in parts if p)
    plain = joined.encode("ascii", "backslashreplace").decode()
    clean = "".join(c if c.isprintable() else "?" for c in plain)[:500]
    return '"' + clean.replace("\\", "/").replace('"', "'") + '"'


def unit_text(unit: str) -> str:
    """Return an SI unit in Modelica's notation, empty if it has none there.

    Examples
    --------
    >>> unit_text("N*s/m"), unit_text("C*m/(V/m)"), unit_text("ohm"), unit_text("furlong")
    ('N.s/m', 'C.m2/V', 'Ohm', '')
    """
    if not unit or unit == "1":
        return unit
    try:
        found = parse_unit(unit)
    except BondsightError:
        return ""
    if found.scale != 1.0 or not all(re.fullmatch(r"[A-Za-z]+", s) for s, _ in found.factors):
        return ""
    powers: dict[str, int] = {}
    for symbol, power in found.factors:
        name = "Ohm" if symbol == "ohm" else symbol
        powers[name] = powers.get(name, 0) + power
    over = _factors((s, n) for s, n in powers.items() if n > 0)
    under = _factors((s, -n) for s, n in powers.items() if n < 0)
    if not under:
        return over or "1"
    return f"{over or '1'}/{f'({under})' if '.' in under else under}"


def _factors(powers: Iterable[tuple[str, int]]) -> str:
    return ".".join(s + (str(n) if n != 1 else "") for s, n in powers)


def number(value: float) -> str:
    """Return a finite number; a negative one in parentheses, as signs may not follow operators."""
    if not math.isfinite(value):
        raise BondsightError(f"the number {value} cannot be written in Modelica; use a finite one")
    return repr(value) if math.copysign(1.0, value) > 0 else f"({value!r})"


def _truth(condition: str, *needs: int) -> Rule:
    return Rule(f"(if {condition} then 1.0 else 0.0)", ATOM, needs)


MODELICA = Notation(
    rules=arithmetic()
    | {op: call(op) for op in "exp log sqrt sin cos tan asin acos atan".split()}
    | {op: call(op) for op in "sinh cosh tanh floor ceil sign".split()}
    | {
        "neg": Rule("-{0}", PLUS, (UNARY,)),
        "sq": Rule("{0} ^ 2", UNARY, (ATOM,)),
        "pow": Rule("{0} ^ {1}", UNARY, (ATOM, ATOM)),
        "constpow": Rule("{0} ^ {1}", UNARY, (ATOM, ATOM)),
        "fabs": call("abs"),
        "fmin": call("min", 2),
        "fmax": call("max", 2),
        "fmod": call("rem", 2),
        "atan2": call("atan2", 2),
        "asinh": Rule("log({0} + sqrt({0} ^ 2 + 1.0))", ATOM, (ATOM,)),
        "acosh": Rule("log({0} + sqrt({0} ^ 2 - 1.0))", ATOM, (ATOM,)),
        "atanh": Rule("(0.5 * log((1.0 + {0}) / (1.0 - {0})))", ATOM, (ATOM,)),
        "hypot": Rule("sqrt({0} ^ 2 + {1} ^ 2)", ATOM, (ATOM, ATOM)),
        "log1p": Rule("log(1.0 + {0})", ATOM, (TIMES,)),
        # by the half-argument tangent where the exponential would lose digits
        "expm1": Rule(
            "(if abs({0}) < 1.0 then 2.0 * tanh(0.5 * {0}) / (1.0 - tanh(0.5 * {0})) "
            "else exp({0}) - 1.0)",
            ATOM,
            (ATOM,),
        ),
        "copysign": Rule("(if {1} < 0.0 then -abs({0}) else abs({0}))", ATOM, (LOOSE, PLUS)),
        # Real numbers may be compared for order only; 1 and 0 stand for true and false
        "lt": _truth("{0} < {1}", PLUS, PLUS),
        "le": _truth("{0} <= {1}", PLUS, PLUS),
        "eq": _truth("abs({0} - {1}) <= 0.0", PLUS, TIMES),
        "ne": _truth("abs({0} - {1}) > 0.0", PLUS, TIMES),
        "not": _truth("abs({0}) <= 0.0", LOOSE),
        "and": _truth("abs({0}) > 0.0 and abs({1}) > 0.0", LOOSE, LOOSE),
        "or": _truth("abs({0}) > 0.0 or abs({1}) > 0.0", LOOSE, LOOSE),
        "if_else_zero": Rule("(if abs({0}) > 0.0 then {1} else 0.0)", ATOM, (LOOSE, PLUS)),
    },
    number=number,
)
"""Operations of a tape in Modelica; ``erf`` and ``remainder`` have no counterpart."""
