"""The catalogue: every effect the diagnosis can name, one class each."""

from identification.diagnosis.effects.drive import DeadZoneEffect, LowPass, SaturationEffect
from identification.diagnosis.effects.effect import Effect as Effect
from identification.diagnosis.effects.effect import Insertion as Insertion
from identification.diagnosis.effects.friction import CoulombFriction, Drag, StribeckFriction
from identification.diagnosis.effects.measurement import (
    Delay,
    SensorDrift,
    SensorLag,
    SensorNonlinearity,
)
from identification.diagnosis.effects.memory import Creep, Hysteresis
from identification.diagnosis.effects.restoring import NonlinearStiffness
from identification.diagnosis.effects.unnamed import UnnamedCurve

CATALOGUE: tuple[Effect, ...] = (
    Hysteresis(),
    Creep(),
    CoulombFriction(),
    StribeckFriction(),
    Drag(),
    NonlinearStiffness(),
    SaturationEffect(),
    DeadZoneEffect(),
    LowPass(),
    Delay(),
    SensorDrift(),
    SensorNonlinearity(),
    SensorLag(),
)
UNNAMED: Effect = UnnamedCurve()


def by_name(name: str) -> Effect:
    """Effect of the catalogue by its name."""
    return {e.name: e for e in (*CATALOGUE, UNNAMED)}[name]
