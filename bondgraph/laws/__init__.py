"""Constitutive laws: what an element does beyond being linear."""

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
