"""Operators with memory: play, stop, dead zone, Prandtl-Ishlinskii and Maxwell, with inverses.

Every operator is a frozen dataclass; its memory is a tuple that the caller carries:

>>> from bondgraph.backend import NUMPY
>>> operator = PrandtlIshlinskii(thresholds=(0.0, 1.0), weights=(1.0, 0.5))
>>> memory = operator.initial_memory()
>>> float(operator.value(NUMPY, 2.0, memory))
2.5
>>> operator.advance(NUMPY, 2.0, memory)
(1.0,)
"""

from __future__ import annotations

from bondgraph.hysteresis.al_janaideh import AlJanaideh as AlJanaideh
from bondgraph.hysteresis.ang import Ang as Ang
from bondgraph.hysteresis.ang import AngInverse as AngInverse
from bondgraph.hysteresis.catalogue import OPERATORS as OPERATORS
from bondgraph.hysteresis.catalogue import operator_from_dict as operator_from_dict
from bondgraph.hysteresis.dead_zone import DeadZone as DeadZone
from bondgraph.hysteresis.dead_zone import dead_zone as dead_zone
from bondgraph.hysteresis.errors import BadInput as BadInput
from bondgraph.hysteresis.errors import BadMemory as BadMemory
from bondgraph.hysteresis.errors import BadParameter as BadParameter
from bondgraph.hysteresis.errors import HysteresisError as HysteresisError
from bondgraph.hysteresis.errors import NotInvertible as NotInvertible
from bondgraph.hysteresis.maxwell import MaxwellResistiveCapacitor as MaxwellResistiveCapacitor
from bondgraph.hysteresis.one_plus import identity_plus as identity_plus
from bondgraph.hysteresis.one_plus import inverse_of_identity_plus as inverse_of_identity_plus
from bondgraph.hysteresis.operator import Memory as Memory
from bondgraph.hysteresis.operator import Operator as Operator
from bondgraph.hysteresis.play import initial_play as initial_play
from bondgraph.hysteresis.play import play as play
from bondgraph.hysteresis.play import play_record as play_record
from bondgraph.hysteresis.play import reachable_plays as reachable_plays
from bondgraph.hysteresis.prandtl_ishlinskii import PrandtlIshlinskii as PrandtlIshlinskii
from bondgraph.hysteresis.stop import stop as stop
from bondgraph.hysteresis.turning_points import turning_points as turning_points
