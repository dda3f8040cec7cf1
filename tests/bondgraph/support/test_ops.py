"""The three back ends give the same numbers."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import casadi as ca
import numpy as np
import pytest
import sympy

import bondgraph.support.ops
from bondgraph.support.ops import CASADI, NUMPY, SYMPY

UNARY = ["absolute", "sign", "tanh", "exp", "expm1", "log", "sqrt", "floor"]
BINARY = ["maximum", "minimum"]


@pytest.mark.parametrize("name", UNARY)
@pytest.mark.parametrize("matrix", [ca.SX, ca.MX])
def test_unary_functions_agree(name: Any, matrix: Any) -> None:
    rng = np.random.default_rng(1)
    positive = name in ("log", "sqrt")
    x, s = matrix.sym("x"), sympy.Symbol("s", real=True)
    compiled = ca.Function("f", [x], [getattr(CASADI, name)(x)])
    symbolic = getattr(SYMPY, name)(s)
    for value in rng.uniform(0.1 if positive else -2.0, 2.0, 5):
        expected = getattr(NUMPY, name)(value)
        assert float(compiled(value)) == pytest.approx(expected, rel=1e-14)
        assert float(symbolic.subs(s, value)) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("name", BINARY)
@pytest.mark.parametrize("matrix", [ca.SX, ca.MX])
def test_binary_functions_agree(name: Any, matrix: Any) -> None:
    x, s = matrix.sym("x"), sympy.Symbol("s", real=True)
    compiled = ca.Function("f", [x], [getattr(CASADI, name)(x, 0.5)])
    symbolic = getattr(SYMPY, name)(s, 0.5)
    for value in (-1.0, 0.5, 2.0):
        expected = getattr(NUMPY, name)(value, 0.5)
        assert float(compiled(value)) == expected
        assert float(symbolic.subs(s, value)) == expected


@pytest.mark.parametrize("matrix", [ca.SX, ca.MX])
def test_where_agrees(matrix: Any) -> None:
    x, s = matrix.sym("x"), sympy.Symbol("s", real=True)
    compiled = ca.Function("f", [x], [CASADI.where(x > 0.5, x, -x)])
    symbolic = SYMPY.where(s > 0.5, s, -s)
    for value in (-1.0, 0.5, 2.0):
        expected = float(NUMPY.where(value > 0.5, value, -value))
        assert float(compiled(value)) == expected
        assert float(symbolic.subs(s, value)) == expected


def test_numpy_works_on_arrays() -> None:
    np.testing.assert_array_equal(NUMPY.maximum(np.array([-1.0, 1.0]), 0.0), [0.0, 1.0])


def test_import_brings_in_neither_casadi_nor_sympy() -> None:
    """Run by path: the package around the module may import what it likes."""
    code = (
        f"import runpy, sys; runpy.run_path({bondgraph.support.ops.__file__!r}); "
        "raise SystemExit(bool({'casadi', 'sympy'} & sys.modules.keys()))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_repr_is_short() -> None:
    assert repr(NUMPY) == "Ops(name='numpy')"
