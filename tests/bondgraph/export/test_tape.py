"""Tapes: printed Python computes what CasADi computes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest

from bondgraph.equations.codegen import law_functions
from bondgraph.export.tape import OPERATIONS, AssignmentTape, Notation, tape, written
from bondgraph.export.tape_languages import PYTHON, PYTHON_HELPERS, used_helpers
from bondgraph.laws import (
    Coulomb,
    GrowingDamping,
    Hysteretic,
    LuGre,
    QuadraticDrag,
    Sliding,
    Stribeck,
    TableLaw,
)
from bondgraph.laws.law import Law
from bondgraph.support.errors import BondsightError
from tests.bondgraph.hysteresis.examples import EXAMPLES

SAMPLES = 25
LAWS: dict[str, Law] = {name: Hysteretic(operator) for name, operator in EXAMPLES.items()} | {
    "sliding": Sliding(EXAMPLES["prandtl_ishlinskii spring"]),
    "coulomb": Coulomb(),
    "stribeck": Stribeck(),
    "drag": QuadraticDrag(),
    "lugre": LuGre(damping=3.0),
    "growing damping": GrowingDamping(0.2, 0.9),
    "pchip": TableLaw((0.0, 1.0, 2.0, 4.0), (0.0, 0.4, 0.5, 3.0), join="pchip", free=True),
}


def functions(law: Law) -> tuple[tuple[Any, Any], tuple[float, ...]]:
    parameters = law.parameters("e")
    return law_functions(law, len(parameters)), tuple(p.value for p in parameters)


def arguments(law: Law, q: Sequence[float], seed: int) -> list[tuple[float, Any, Any, float]]:
    """Random walk of the argument, with the memory that CasADi's own advance carries."""
    random = np.random.default_rng(seed)
    _, advance = law_functions(law, len(q))
    memory = list(law.initial_memory(0.0))
    found = []
    for s in np.cumsum(random.normal(0.0, 1.2, SAMPLES)):
        h = float(random.uniform(1e-3, 0.05))
        parameters = [v * random.uniform(0.8, 1.2) for v in q]
        found.append((float(s), list(memory), parameters, h))
        memory = advance(s, memory, parameters, h).full().ravel().tolist()
    return found


def python_function(function: Any, width: int = 72) -> Callable[..., list[list[float]]]:
    """Printed text, run as a reader would run it."""
    arguments = [str(function.name_in(i)) for i in range(function.n_in())]
    program = tape(function, [_subscripts(function, i) for i in range(function.n_in())])
    text = written(program, PYTHON, width=width)
    body = [f"    {target} = {expression}" for target, expression in text.lines]
    outputs = ", ".join("[" + ", ".join(entries) + "]" for entries in text.outputs)
    source = "\n".join([f"def run({', '.join(arguments)}):", *body, f"    return [{outputs}]"])
    helpers = "\n".join(PYTHON_HELPERS[name] for name in used_helpers(source))
    scope: dict[str, Any] = {}
    exec(f"import math\n{helpers}\n{source}", scope)
    found: Callable[..., list[list[float]]] = scope["run"]
    return found


def _subscripts(function: Any, i: int) -> list[str]:
    name, size = function.name_in(i), function.numel_in(i)
    # h and s are scalars, m and q columns, whatever their length
    return [name] if name in "shab" else [f"{name}[{j}]" for j in range(size)]


def same(found: Any, expected: Any) -> None:
    np.testing.assert_array_equal(
        np.asarray(found, float), np.asarray(expected.full().ravel(order="F"), float)
    )


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", LAWS)
def test_printed_python_is_casadi_to_the_last_bit(name: str) -> None:
    law = LAWS[name]
    pair, q = functions(law)
    for function in pair:
        for width in (0, 72):
            run = python_function(function, width)
            for given in arguments(law, q, 3):
                same(run(*given)[0], function(*given))


_UNARY: dict[str, Any] = {
    "assign": lambda a: a, "neg": lambda a: -a, "exp": ca.exp, "log": ca.log, "sqrt": ca.sqrt,
    "sq": lambda a: a * a, "twice": lambda a: a + a, "sin": ca.sin, "cos": ca.cos, "tan": ca.tan,
    "asin": ca.asin, "acos": ca.acos, "atan": ca.atan, "sinh": ca.sinh, "cosh": ca.cosh,
    "tanh": ca.tanh, "asinh": ca.asinh, "acosh": ca.acosh, "atanh": ca.atanh,
    "not": ca.logic_not, "floor": ca.floor, "ceil": ca.ceil, "fabs": ca.fabs, "sign": ca.sign,
    "erf": ca.erf, "inv": lambda a: 1 / a, "log1p": ca.log1p, "expm1": ca.expm1,
}  # fmt: skip
_BINARY: dict[str, Any] = {
    "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b, "pow": lambda a, b: a**b, "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b, "eq": lambda a, b: a == b, "ne": lambda a, b: a != b,
    "and": ca.logic_and, "or": ca.logic_or, "fmod": ca.fmod, "copysign": ca.copysign,
    "if_else_zero": lambda a, b: ca.if_else(a, b, 0.0), "fmin": ca.fmin, "fmax": ca.fmax,
    "atan2": ca.atan2, "hypot": ca.hypot, "remainder": ca.remainder,
    "constpow": lambda a, b: a**2.7 + b,
}  # fmt: skip
POINTS = (-800.0, -1.7, -1.0, -0.5, 0.0, 0.3, 1.0, 2.5, 800.0, math.inf, -math.inf)


def test_every_operation_is_tried() -> None:
    assert set(_UNARY) | set(_BINARY) == set(OPERATIONS)
    assert set(PYTHON.rules) == set(OPERATIONS)


@pytest.mark.parametrize("op", OPERATIONS)
def test_operation_on_hard_numbers(op: str) -> None:
    """Zero, infinity, overflow and arguments outside the domain never raise."""
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    value = _UNARY[op](a) if op in _UNARY else _BINARY[op](a, b)
    function = ca.Function("f", [a, b], [value], ["a", "b"], ["y"])
    assert op == "assign" or op in {i.op for i in tape(function).instructions}
    run = python_function(function)
    for x in POINTS:
        for y in POINTS if op in _BINARY else (0.0,):
            # Python rounds hypot in its own way
            last = 2.3e-16 if op == "hypot" else 0.0
            np.testing.assert_allclose(run(x, y)[0], [float(function(x, y))], rtol=last, atol=0)


def test_arithmetic_keeps_its_order() -> None:
    """Random trees: parentheses stand where the rounding needs them."""
    random = np.random.default_rng(0)
    for _ in range(60):
        pool = list(ca.vertsplit(ca.SX.sym("a", 4)))
        inputs = ca.vertcat(*pool)
        for _ in range(25):
            i, j = random.integers(0, len(pool), 2)
            kind = random.integers(0, 5)
            x, y = pool[i], pool[j]
            pool.append([x + y, x - y, x * y, -x, x / (y * y + 1.0)][kind])
        function = ca.Function(
            "f", [inputs], [pool[-1] - pool[-2] / (pool[-3] - 4.0)], ["m"], ["y"]
        )
        run = python_function(function)
        point = random.normal(size=4).tolist()
        same(run(point)[0], function(point))


def test_matrix_output_is_dense_and_column_after_column() -> None:
    a = ca.SX.sym("m", 2)
    matrix = ca.SX(2, 2)
    matrix[0, 1] = a[0] * 2.0
    function = ca.Function("f", [a], [matrix], ["m"], ["y"])
    found = tape(function)
    assert found.shapes == ((2, 2),)
    assert found.outputs == ((0.0, 0.0, "v0", 0.0),)
    same(python_function(function)([3.0, 4.0])[0], ca.densify(function([3.0, 4.0])))


def test_refusals_are_one_clear_line() -> None:
    x = ca.SX.sym("x", 2)
    y = ca.MX.sym("y")
    called = ca.Function("inner", [x], [ca.sum1(x)], {"never_inline": True})
    cases: list[tuple[Callable[[], AssignmentTape], str]] = [
        (lambda: tape(ca.Function("f", [y], [y])), "expand"),
        (lambda: tape(ca.Function("f", [x], [called(x)])), "'call' has no rule"),
        (lambda: tape(ca.Function("f", [x], [x]), [("a",)]), "2 entries but 1 names"),
        (lambda: tape(ca.Function("f", [ca.SX.sym("d", ca.Sparsity.diag(2))], [x[0] * 0])), "spar"),
    ]
    for make, words in cases:
        with pytest.raises(BondsightError, match=words):
            make()
    with pytest.raises(BondsightError, match="no rule for the operation 'mul'"):
        written(tape(ca.Function("f", [x], [x[0] * x[1]])), Notation({}, repr))
