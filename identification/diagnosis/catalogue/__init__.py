"""The catalogue: every effect the diagnosis can name, one class each, in a file of its own."""

from __future__ import annotations

from bondgraph.support.errors import unknown_name
from identification.diagnosis.catalogue.drive.dead_zone import DeadZoneEffect
from identification.diagnosis.catalogue.drive.inner_resistance import InnerResistance
from identification.diagnosis.catalogue.drive.low_pass import LowPass
from identification.diagnosis.catalogue.drive.saturation import SaturationEffect
from identification.diagnosis.catalogue.drive.slew_limit import SlewLimitEffect
from identification.diagnosis.catalogue.effect import Effect as Effect
from identification.diagnosis.catalogue.effect import Insertion as Insertion
from identification.diagnosis.catalogue.flow.current_limit import CurrentLimitEffect
from identification.diagnosis.catalogue.flow.diode import DiodeEffect
from identification.diagnosis.catalogue.flow.nonlinear_resistance import NonlinearResistanceEffect
from identification.diagnosis.catalogue.flow.square_root_flow import SquareRootFlow
from identification.diagnosis.catalogue.flow.voltage_drop import VoltageDrop
from identification.diagnosis.catalogue.friction.asymmetric_damping import AsymmetricDampingEffect
from identification.diagnosis.catalogue.friction.coulomb import CoulombFriction
from identification.diagnosis.catalogue.friction.presliding import PreslidingFriction
from identification.diagnosis.catalogue.friction.quadratic_drag import Drag
from identification.diagnosis.catalogue.friction.stribeck import StribeckFriction
from identification.diagnosis.catalogue.measurement.periodic_error import PeriodicError
from identification.diagnosis.catalogue.measurement.quantisation import Quantisation
from identification.diagnosis.catalogue.measurement.sensor_drift import SensorDrift
from identification.diagnosis.catalogue.measurement.sensor_gain import SensorGainEffect
from identification.diagnosis.catalogue.measurement.sensor_lag import SensorLag
from identification.diagnosis.catalogue.measurement.sensor_nonlinearity import SensorNonlinearity
from identification.diagnosis.catalogue.measurement.sensor_offset import SensorOffset
from identification.diagnosis.catalogue.measurement.sensor_rectification import SensorRectification
from identification.diagnosis.catalogue.memory.creep import Creep
from identification.diagnosis.catalogue.memory.hysteresis import Hysteresis
from identification.diagnosis.catalogue.outside.external_disturbance import ExternalDisturbance
from identification.diagnosis.catalogue.outside.time_varying_parameter import TimeVaryingParameter
from identification.diagnosis.catalogue.outside.unnamed_curve import UnnamedCurve
from identification.diagnosis.catalogue.restoring.backlash import BacklashEffect
from identification.diagnosis.catalogue.restoring.bilinear_stiffness import BilinearStiffness
from identification.diagnosis.catalogue.restoring.contact_loss import ContactLossEffect
from identification.diagnosis.catalogue.restoring.cross_coupling import CrossCoupling
from identification.diagnosis.catalogue.restoring.end_stop import EndStopEffect
from identification.diagnosis.catalogue.restoring.nonlinear_stiffness import NonlinearStiffness
from identification.diagnosis.catalogue.storage.added_mode import AddedMode
from identification.diagnosis.catalogue.storage.eddy_current_loss import EddyCurrentLoss
from identification.diagnosis.catalogue.storage.internal_leakage import InternalLeakage
from identification.diagnosis.catalogue.storage.leakage import Leakage
from identification.diagnosis.catalogue.storage.linear_capacity import LinearCapacity
from identification.diagnosis.catalogue.storage.linear_inertia import LinearInertia
from identification.diagnosis.catalogue.storage.linear_loss import LinearLoss
from identification.diagnosis.catalogue.storage.linear_spring import LinearSpring
from identification.diagnosis.catalogue.storage.overflow import OverflowEffect
from identification.diagnosis.catalogue.storage.self_heating import SelfHeatingEffect
from identification.diagnosis.catalogue.time.clock_skew import ClockSkewEffect
from identification.diagnosis.catalogue.time.delay import Delay
from identification.diagnosis.catalogue.transduction.nonlinear_ratio import NonlinearRatio
from identification.diagnosis.catalogue.transduction.position_periodic_force import (
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
    CrossCoupling(),
    # transduction
    NonlinearRatio(),
    PositionPeriodicForce(),
    # drive
    SaturationEffect(),
    SlewLimitEffect(),
    LowPass(),
    DeadZoneEffect(),
    InnerResistance(),
    # storage
    Leakage(),
    InternalLeakage(),
    OverflowEffect(),
    AddedMode(),
    LinearSpring(),
    LinearLoss(),
    LinearInertia(),
    LinearCapacity(),
    EddyCurrentLoss(),
    SelfHeatingEffect(),
    # flow
    SquareRootFlow(),
    NonlinearResistanceEffect(),
    DiodeEffect(),
    CurrentLimitEffect(),
    VoltageDrop(),
    # measurement
    SensorLag(),
    SensorOffset(),
    SensorGainEffect(),
    SensorDrift(),
    SensorNonlinearity(),
    SensorRectification(),
    PeriodicError(),
    Quantisation(),
    # time
    Delay(),
    ClockSkewEffect(),
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
        raise unknown_name("effect", name, "the catalogue", (e.name for e in CATALOGUE))
    return _BY_NAME[name]
