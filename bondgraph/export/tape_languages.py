"""Python as a notation of a tape."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace

from bondgraph.export.tape import (
    ATOM,
    COMPARE,
    LOOSE,
    OPERATIONS,
    PLUS,
    TIMES,
    UNARY,
    Notation,
    Rule,
)


def call(name: str, n: int = 1) -> Rule:
    """Return the rule of a function of `n` arguments."""
    return Rule(f"{name}({', '.join('{' + str(i) + '}' for i in range(n))})", ATOM, (LOOSE,) * n)


def arithmetic() -> dict[str, Rule]:
    """Return rules that languages share; a right operand of equal level keeps its parentheses."""
    return {
        "assign": Rule("{0}", LOOSE, (ATOM,)),
        "add": Rule("{0} + {1}", PLUS, (PLUS, TIMES)),
        "sub": Rule("{0} - {1}", PLUS, (PLUS, TIMES)),
        "mul": Rule("{0} * {1}", TIMES, (TIMES, UNARY)),
        "div": Rule("{0} / {1}", TIMES, (TIMES, UNARY)),
        "neg": Rule("-{0}", UNARY, (ATOM,)),
        "sq": Rule("{0} * {0}", TIMES, (UNARY,)),
        "twice": Rule("2.0 * {0}", TIMES, (UNARY,)),
        "inv": Rule("1.0 / {0}", TIMES, (UNARY,)),
        "sign": Rule("(({0} > 0.0) - ({0} < 0.0))", ATOM, (PLUS,)),
        "lt": Rule("{0} < {1}", COMPARE, (PLUS, PLUS)),
        "le": Rule("{0} <= {1}", COMPARE, (PLUS, PLUS)),
        "eq": Rule("{0} == {1}", COMPARE, (PLUS, PLUS)),
        "ne": Rule("{0} != {1}", COMPARE, (PLUS, PLUS)),
    }


_IN_MATH = (
    "exp log sqrt sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh floor ceil fabs erf "
    "log1p expm1 fmod copysign fmin fmax atan2 hypot remainder"
).split()


def _python_number(value: float) -> str:
    if math.isfinite(value):
        return repr(value)
    return "math.nan" if math.isnan(value) else "math.inf" if value > 0 else "-math.inf"


_GUARDED = (
    "exp log sqrt sin cos tan asin acos atanh sinh cosh acosh log1p expm1 fmod remainder".split()
)

PYTHON = Notation(
    rules=arithmetic()
    | {op: call(f"math.{op}", OPERATIONS[op]) for op in _IN_MATH}
    | {op: call(f"safe_{op}", OPERATIONS[op]) for op in _GUARDED}
    | {
        "div": call("safe_div", 2),
        "inv": Rule("safe_div(1.0, {0})", ATOM, (LOOSE,)),
        "pow": call("safe_pow", 2),
        "constpow": call("safe_pow", 2),
        "fabs": call("abs", 1),
        "fmin": call("min", 2),
        "fmax": call("max", 2),
        "floor": call("safe_floor", 1),
        "ceil": call("safe_ceil", 1),
        "not": Rule("(not {0})", ATOM, (COMPARE,)),
        "and": Rule("bool({0} and {1})", ATOM, (COMPARE, COMPARE)),
        "or": Rule("bool({0} or {1})", ATOM, (COMPARE, COMPARE)),
        "if_else_zero": Rule("({1} if {0} else 0.0)", ATOM, (COMPARE, PLUS)),
    },
    number=_python_number,
)
"""Python on floats, with ``import math`` and the `PYTHON_HELPERS` that the text uses."""

READABLE = replace(
    PYTHON, rules={**PYTHON.rules, **{op: arithmetic()[op] for op in ("div", "inv")}}
)
"""The same with plain division, for equations that are to be read."""

_ERRORS = "(ArithmeticError, ValueError)"


def _guard(op: str) -> str:
    parameters = "a" if OPERATIONS[op] == 1 else "a, b"
    # overflow of exp, sinh and the like; what is undefined is not a number, as in C
    other = {"exp": "math.inf", "expm1": "math.inf", "cosh": "math.inf"}.get(op, "math.nan")
    other = {
        "sinh": "math.copysign(math.inf, a)",
        "log": "-math.inf if a == 0.0 else math.nan",
        "log1p": "-math.inf if a == -1.0 else math.nan",
        "atanh": "math.copysign(math.inf, a) if abs(a) == 1.0 else math.nan",
    }.get(op, other)
    return (
        f"def safe_{op}({parameters}):\n    try:\n        return math.{op}({parameters})\n"
        f"    except {_ERRORS}:\n        return {other}\n"
    )


_FLOOR = """def safe_{op}(a):
    return float(math.{op}(a)) if math.isfinite(a) else a
"""

_DIV = """def safe_div(a, b):
    if b != 0.0:
        return a / b
    if a == 0.0 or a != a or b != b:
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)
"""

_POW = """def safe_pow(a, b):
    try:
        return math.pow(a, b)
    except OverflowError:
        return math.copysign(math.inf, a if b % 2.0 == 1.0 else 1.0)
    except ValueError:
        return math.inf if a == 0.0 else math.nan
"""

PYTHON_HELPERS: Mapping[str, str] = {f"safe_{op}": _guard(op) for op in _GUARDED} | {
    "safe_floor": _FLOOR.format(op="floor"),
    "safe_ceil": _FLOOR.format(op="ceil"),
    "safe_div": _DIV,
    "safe_pow": _POW,
}
"""Source of the functions that printed Python may call: C's answers where `math` would raise."""


def used_helpers(text: str) -> tuple[str, ...]:
    """Return the names of `PYTHON_HELPERS` that `text` calls, in a fixed order."""
    called = set(re.findall(r"\b([a-z_0-9]+)\(", text))
    return tuple(name for name in PYTHON_HELPERS if name in called)
