"""Symbols and equality for hand derivations."""

from __future__ import annotations

from typing import Any

import sympy as sp


def P(names: str) -> Any:
    """Parameters."""
    return sp.symbols(names, positive=True)


def S(names: str) -> Any:
    """Signals."""
    return sp.symbols(names, real=True)


def same(a: Any, b: Any) -> bool:
    return bool(sp.cancel(sp.expand(a - b)) == 0)
