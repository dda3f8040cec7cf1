"""Constitutive laws: what an element does beyond being linear; loaded when first asked for."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bondgraph.laws.ageing import Ageing as Ageing
    from bondgraph.laws.asymmetric import AsymmetricDamping as AsymmetricDamping
    from bondgraph.laws.backlash import Backlash as Backlash
    from bondgraph.laws.bilinear import Bilinear as Bilinear
    from bondgraph.laws.contact_loss import ContactLoss as ContactLoss
    from bondgraph.laws.dahl import DahlFriction as DahlFriction
    from bondgraph.laws.end_stop import EndStop as EndStop
    from bondgraph.laws.friction import Coulomb as Coulomb
    from bondgraph.laws.friction import QuadraticDrag as QuadraticDrag
    from bondgraph.laws.friction import Stribeck as Stribeck
    from bondgraph.laws.friction import Viscous as Viscous
    from bondgraph.laws.heating import SelfHeating as SelfHeating
    from bondgraph.laws.hysteretic import Hysteretic as Hysteretic
    from bondgraph.laws.law import Law as Law
    from bondgraph.laws.limits import DeadZone as DeadZone
    from bondgraph.laws.limits import Saturation as Saturation
    from bondgraph.laws.lugre import LuGre as LuGre
    from bondgraph.laws.odometer import Odometer as Odometer
    from bondgraph.laws.onset import Onset as Onset
    from bondgraph.laws.overflow import Overflow as Overflow
    from bondgraph.laws.parametrised import Parametrised as Parametrised
    from bondgraph.laws.periodic import Periodic as Periodic
    from bondgraph.laws.piecewise_linear import PiecewiseLinear as PiecewiseLinear
    from bondgraph.laws.polynomial import Polynomial as Polynomial
    from bondgraph.laws.rectifier import Rectifier as Rectifier
    from bondgraph.laws.resistance import NonlinearResistance as NonlinearResistance
    from bondgraph.laws.rounding import Rounding as Rounding
    from bondgraph.laws.slew_limit import SlewLimit as SlewLimit
    from bondgraph.laws.sliding import Sliding as Sliding
    from bondgraph.laws.stop_sum import StopSum as StopSum
    from bondgraph.laws.table import TableLaw as TableLaw
    from bondgraph.laws.tone import Tone as Tone

_PLACES = {
    "AsymmetricDamping": "bondgraph.laws.asymmetric",
    "Backlash": "bondgraph.laws.backlash",
    "Bilinear": "bondgraph.laws.bilinear",
    "DahlFriction": "bondgraph.laws.dahl",
    "ContactLoss": "bondgraph.laws.contact_loss",
    "EndStop": "bondgraph.laws.end_stop",
    "SelfHeating": "bondgraph.laws.heating",
    "Overflow": "bondgraph.laws.overflow",
    "NonlinearResistance": "bondgraph.laws.resistance",
    "Odometer": "bondgraph.laws.odometer",
    "Tone": "bondgraph.laws.tone",
    "Periodic": "bondgraph.laws.periodic",
    "Onset": "bondgraph.laws.onset",
    "Ageing": "bondgraph.laws.ageing",
    "Coulomb": "bondgraph.laws.friction",
    "QuadraticDrag": "bondgraph.laws.friction",
    "Stribeck": "bondgraph.laws.friction",
    "Viscous": "bondgraph.laws.friction",
    "PiecewiseLinear": "bondgraph.laws.piecewise_linear",
    "Hysteretic": "bondgraph.laws.hysteretic",
    "Law": "bondgraph.laws.law",
    "DeadZone": "bondgraph.laws.limits",
    "Parametrised": "bondgraph.laws.parametrised",
    "Saturation": "bondgraph.laws.limits",
    "LuGre": "bondgraph.laws.lugre",
    "Polynomial": "bondgraph.laws.polynomial",
    "Rectifier": "bondgraph.laws.rectifier",
    "Rounding": "bondgraph.laws.rounding",
    "SlewLimit": "bondgraph.laws.slew_limit",
    "Sliding": "bondgraph.laws.sliding",
    "StopSum": "bondgraph.laws.stop_sum",
    "TableLaw": "bondgraph.laws.table",
}


def __getattr__(name: str) -> Any:
    """Load a law: most programs use few, and all together take a tenth of the import."""
    if name in _PLACES:
        return getattr(import_module(_PLACES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of the laws too."""
    return sorted({*globals(), *_PLACES})
