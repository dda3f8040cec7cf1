"""Plants of the virtual bench, and what disturbs them."""

from hardware.simulators.plants.disturbance import (
    AirPath,
    Disturbance,
    Disturbed,
    SensorNoise,
    Vibration,
)
from hardware.simulators.plants.memory import Creeping, HystereticPlant
from hardware.simulators.plants.stack import StackPlant

__all__ = [
    "AirPath",
    "Creeping",
    "Disturbance",
    "Disturbed",
    "HystereticPlant",
    "SensorNoise",
    "StackPlant",
    "Vibration",
]
