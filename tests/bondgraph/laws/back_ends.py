"""One formula on three back ends, along a walk."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from bondgraph.laws import Law
from bondgraph.support.ops import CASADI, NUMPY, SYMPY


def back_ends_agree(law: Law, p: Sequence[float], walk: Iterable[float]) -> tuple[float, ...]:
    """Hold CasADi and SymPy against NumPy; return the memory at the end of the walk."""
    s, m, q = ca.SX.sym("s"), ca.SX.sym("m", law.n_memory), ca.SX.sym("q", len(p))
    ms, qs = tuple(ca.vertsplit(m)) if law.n_memory else (), tuple(ca.vertsplit(q)) if p else ()
    compiled = ca.Function(
        "law",
        [s, m, q],
        [law.deviation(CASADI, s, ms, qs), ca.vertcat(*law.advance(CASADI, s, ms, qs))],
    )
    x = sp.Symbol("x", real=True)
    memory = law.initial_memory(0.0)
    for value in walk:
        plain = float(law.deviation(NUMPY, value, memory, p))
        new = law.advance(NUMPY, value, memory, p)
        from_casadi, casadi_memory = compiled(value, list(memory), p)
        symbolic = sp.sympify(law.deviation(SYMPY, x, memory, p)).subs(x, value)
        assert float(from_casadi) == pytest.approx(plain, abs=1e-12)
        assert float(symbolic) == pytest.approx(plain, abs=1e-12)
        np.testing.assert_allclose(casadi_memory.full().ravel(), new, atol=1e-14)
        memory = new
    return tuple(memory)
