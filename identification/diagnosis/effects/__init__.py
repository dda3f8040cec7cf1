"""The catalogue: every effect the diagnosis can name, one class each, in a file of its own."""

from __future__ import annotations

from bondgraph.errors import unknown_name
from identification.diagnosis.effects.driving.dead_zone import DeadZoneEffect
from identification.diagnosis.effects.driving.low_pass import LowPass
from identification.diagnosis.effects.driving.saturation import SaturationEffect
from identification.diagnosis.effects.driving.slew_limit import SlewLimitEffect
from identification.diagnosis.effects.effect import Effect as Effect
from identification.diagnosis.effects.effect import Insertion as Insertion
from identification.diagnosis.effects.flow.nonlinear_resistance import NonlinearResistanceEffect
from identification.diagnosis.effects.flow.square_root_flow import SquareRootFlow
from identification.diagnosis.effects.friction.asymmetric_damping import AsymmetricDampingEffect
from identification.diagnosis.effects.friction.coulomb import CoulombFriction
from identification.diagnosis.effects.friction.presliding import PreslidingFriction
from identification.diagnosis.effects.friction.quadratic_drag import Drag
from identification.diagnosis.effects.friction.stribeck import StribeckFriction
from identification.diagnosis.effects.measuring.periodic_error import PeriodicError
from identification.diagnosis.effects.measuring.quantisation import Quantisation
from identification.diagnosis.effects.measuring.sensor_drift import SensorDrift
from identification.diagnosis.effects.measuring.sensor_lag import SensorLag
from identification.diagnosis.effects.measuring.sensor_nonlinearity import SensorNonlinearity
from identification.diagnosis.effects.measuring.sensor_offset import SensorOffset
from identification.diagnosis.effects.measuring.sensor_rectification import SensorRectification
from identification.diagnosis.effects.memories.creep import Creep
from identification.diagnosis.effects.memories.hysteresis import Hysteresis
from identification.diagnosis.effects.outside.external_disturbance import ExternalDisturbance
from identification.diagnosis.effects.outside.time_varying_parameter import TimeVaryingParameter
from identification.diagnosis.effects.outside.unnamed_curve import UnnamedCurve
from identification.diagnosis.effects.restoring.backlash import BacklashEffect
from identification.diagnosis.effects.restoring.bilinear_stiffness import BilinearStiffness
from identification.diagnosis.effects.restoring.contact_loss import ContactLossEffect
from identification.diagnosis.effects.restoring.end_stop import EndStopEffect
from identification.diagnosis.effects.restoring.nonlinear_stiffness import NonlinearStiffness
from identification.diagnosis.effects.storage.added_mode import AddedMode
from identification.diagnosis.effects.storage.leakage import Leakage
from identification.diagnosis.effects.storage.overflow import OverflowEffect
from identification.diagnosis.effects.storage.self_heating import SelfHeatingEffect
from identification.diagnosis.effects.timing.clock_skew import ClockSkew
from identification.diagnosis.effects.timing.delay import Delay
from identification.diagnosis.effects.transduction.nonlinear_ratio import NonlinearRatio
from identification.diagnosis.effects.transduction.position_periodic_force import (
    PositionPeriodicForce,
)

CATALOGUE: tuple[Effect, ...] = (
    # memory
    Hysteresis(),
    Creep(),
    # friction
    CoulombFriction(),
    StribeckFriction(),
    PreslidingFriction(),
    Drag(),
    AsymmetricDampingEffect(),
    # restoring
    NonlinearStiffness(),
    BilinearStiffness(),
    EndStopEffect(),
    BacklashEffect(),
    ContactLossEffect(),
    # transduction
    NonlinearRatio(),
    PositionPeriodicForce(),
    # drive
    SaturationEffect(),
    SlewLimitEffect(),
    LowPass(),
    DeadZoneEffect(),
    # storage
    Leakage(),
    OverflowEffect(),
    AddedMode(),
    SelfHeatingEffect(),
    # flow
    SquareRootFlow(),
    NonlinearResistanceEffect(),
    # measurement
    SensorLag(),
    SensorOffset(),
    SensorDrift(),
    SensorNonlinearity(),
    SensorRectification(),
    PeriodicError(),
    Quantisation(),
    # time
    Delay(),
    ClockSkew(),
    # outside
    ExternalDisturbance(),
    TimeVaryingParameter(),
)
"""All effects that may be named, by family in the order of the vocabulary."""

UNNAMED: Effect = UnnamedCurve()
"""What a port does when no effect of the catalogue says why."""

_BY_NAME = {e.name: e for e in (*CATALOGUE, UNNAMED)}


def by_name(name: str) -> Effect:
    """Return an effect of the vocabulary, ``unknown`` included.

    Raises
    ------
    UnknownName
        If there is none of that name; the nearest names are given.

    Examples
    --------
    >>> by_name("creep").law
    'kelvin_voigt'
    """
    if name not in _BY_NAME:
        raise unknown_name("effect", name, "the catalogue", _BY_NAME)
    return _BY_NAME[name]


def family_of(name: str) -> str:
    """Return the family of an effect by its name.

    Raises
    ------
    UnknownName
        If the vocabulary does not have it.

    Examples
    --------
    >>> family_of("stribeck_friction")
    'friction'
    """
    return by_name(name).family
