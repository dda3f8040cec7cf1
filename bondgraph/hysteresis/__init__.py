"""Operators with memory: hysteresis, creep and rate dependence, with their inverses.

Every operator is a frozen dataclass; its memory is a tuple that the caller carries:

>>> from bondgraph.support.ops import NUMPY
>>> operator = PrandtlIshlinskii(thresholds=(0.0, 1.0), weights=(1.0, 0.5))
>>> memory = operator.initial_memory()
>>> float(operator.value(NUMPY, 2.0, memory))
2.5
>>> operator.advance(NUMPY, 2.0, memory)
(1.0,)
"""

from bondgraph.hysteresis.catalogue import OPERATORS as OPERATORS
from bondgraph.hysteresis.catalogue import operator_from_dict as operator_from_dict
from bondgraph.hysteresis.composed.cascade import Cascade as Cascade
from bondgraph.hysteresis.composed.parallel import Parallel as Parallel
from bondgraph.hysteresis.creep.hysteresis_with_creep import (
    HysteresisWithCreep as HysteresisWithCreep,
)
from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep as KelvinVoigtCreep
from bondgraph.hysteresis.creep.log_creep import LogCreep as LogCreep
from bondgraph.hysteresis.duhem.bouc_wen import BoucWen as BoucWen
from bondgraph.hysteresis.duhem.dahl import Dahl as Dahl
from bondgraph.hysteresis.errors import BadInput as BadInput
from bondgraph.hysteresis.errors import BadMemory as BadMemory
from bondgraph.hysteresis.errors import BadParameter as BadParameter
from bondgraph.hysteresis.errors import HysteresisError as HysteresisError
from bondgraph.hysteresis.errors import NotInvertible as NotInvertible
from bondgraph.hysteresis.invertible import Inverse as Inverse
from bondgraph.hysteresis.numeric_inverse import numeric_inverse as numeric_inverse
from bondgraph.hysteresis.operator import Memory as Memory
from bondgraph.hysteresis.operator import Operator as Operator
from bondgraph.hysteresis.plays.al_janaideh import AlJanaideh as AlJanaideh
from bondgraph.hysteresis.plays.ang import Ang as Ang
from bondgraph.hysteresis.plays.ang import AngInverse as AngInverse
from bondgraph.hysteresis.plays.dead_zone import DeadZones as DeadZones
from bondgraph.hysteresis.plays.dead_zone import dead_zone as dead_zone
from bondgraph.hysteresis.plays.generalised import (
    GeneralisedPrandtlIshlinskii as GeneralisedPrandtlIshlinskii,
)
from bondgraph.hysteresis.plays.kuhnen_modified import bent_line as bent_line
from bondgraph.hysteresis.plays.kuhnen_modified import kuhnen_modified as kuhnen_modified
from bondgraph.hysteresis.plays.maxwell import (
    MaxwellResistiveCapacitor as MaxwellResistiveCapacitor,
)
from bondgraph.hysteresis.plays.one_plus import identity_plus as identity_plus
from bondgraph.hysteresis.plays.one_plus import inverse_of_identity_plus as inverse_of_identity_plus
from bondgraph.hysteresis.plays.play import play as play
from bondgraph.hysteresis.plays.play import play_record as play_record
from bondgraph.hysteresis.plays.play import reachable_plays as reachable_plays
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii as PrandtlIshlinskii
from bondgraph.hysteresis.plays.stop import stop as stop
from bondgraph.hysteresis.preisach.krasnoselskii_pokrovskii import (
    KrasnoselskiiPokrovskii as KrasnoselskiiPokrovskii,
)
from bondgraph.hysteresis.preisach.preisach import Preisach as Preisach
from bondgraph.hysteresis.preisach.preisach_grid import (
    preisach_from_everett as preisach_from_everett,
)
from bondgraph.hysteresis.preisach.preisach_grid import preisach_from_relays as preisach_from_relays
from bondgraph.hysteresis.rate.ang_rate_dependent import AngRateDependent as AngRateDependent
from bondgraph.hysteresis.rate.closed_form_check import closed_form_check as closed_form_check
from bondgraph.hysteresis.rate.closed_form_inverse import (
    RateDependentClosedFormInverse as RateDependentClosedFormInverse,
)
from bondgraph.hysteresis.rate.rate_dependent import (
    RateDependentPrandtlIshlinskii as RateDependentPrandtlIshlinskii,
)
from bondgraph.hysteresis.turning_points import turning_points as turning_points
