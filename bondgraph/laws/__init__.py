"""Constitutive laws: what an element does beyond being linear; loaded when first asked for."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bondgraph.laws.friction import Coulomb as Coulomb
    from bondgraph.laws.friction import QuadraticDrag as QuadraticDrag
    from bondgraph.laws.friction import Stribeck as Stribeck
    from bondgraph.laws.friction import Viscous as Viscous
    from bondgraph.laws.hats import Hats as Hats
    from bondgraph.laws.hysteretic import Hysteretic as Hysteretic
    from bondgraph.laws.law import Law as Law
    from bondgraph.laws.limits import DeadZone as DeadZone
    from bondgraph.laws.limits import Saturation as Saturation
    from bondgraph.laws.lugre import LuGre as LuGre
    from bondgraph.laws.polynomial import Polynomial as Polynomial
    from bondgraph.laws.sliding import Sliding as Sliding
    from bondgraph.laws.stop_sum import StopSum as StopSum
    from bondgraph.laws.table import Table as Table

_PLACES = {
    "Coulomb": "bondgraph.laws.friction",
    "QuadraticDrag": "bondgraph.laws.friction",
    "Stribeck": "bondgraph.laws.friction",
    "Viscous": "bondgraph.laws.friction",
    "Hats": "bondgraph.laws.hats",
    "Hysteretic": "bondgraph.laws.hysteretic",
    "Law": "bondgraph.laws.law",
    "DeadZone": "bondgraph.laws.limits",
    "Saturation": "bondgraph.laws.limits",
    "LuGre": "bondgraph.laws.lugre",
    "Polynomial": "bondgraph.laws.polynomial",
    "Sliding": "bondgraph.laws.sliding",
    "StopSum": "bondgraph.laws.stop_sum",
    "Table": "bondgraph.laws.table",
}


def __getattr__(name: str) -> Any:
    """Load a law: most programs use few, and all together take a tenth of the import."""
    if name in _PLACES:
        return getattr(import_module(_PLACES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of the laws too."""
    return sorted({*globals(), *_PLACES})
