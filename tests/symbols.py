"""Symbols and equality for hand derivations."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import sympy as sp

from bondgraph import System
from bondgraph.graph.parameter import symbol


def P(names: str) -> Any:
    """Parameters."""
    return sp.symbols(names, positive=True)


def S(names: str) -> Any:
    """Signals."""
    return sp.symbols(names, real=True)


def same(a: Any, b: Any) -> bool:
    return bool(sp.cancel(sp.expand(a - b)) == 0)


def closed(model: System) -> Any:
    """States x, inputs u, dx/dt and outputs y as columns, laws as functions; rates by name."""
    forms = [model.shown(s.rate) for s in model.stored]
    return SimpleNamespace(
        x=sp.Matrix([symbol(n) for n in model.states]),
        u=sp.Matrix([symbol(n) for n in (*model.inputs, *model.recorded)]),
        dxdt=sp.Matrix(forms),
        y=sp.Matrix([model.shown(y) for _, y, _ in model.readings]),
        rates=dict(zip(model.states, forms, strict=True)),
    )
