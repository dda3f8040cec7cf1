"""A plant around another one."""

from __future__ import annotations

from abc import ABC, abstractmethod

from hardware.simulators.arrays import Array
from hardware.simulators.edges import push
from hardware.simulators.plant_contract import Moved, Plant, PlantMotion, Rewindable


class WrappedPlant(ABC):
    """A plant that changes the readings of another one, which has to be `Rewindable`.

    Parameters
    ----------
    plant : Plant
        The plant.
    """

    def __init__(self, plant: Plant) -> None:
        if not isinstance(plant, Rewindable):
            raise TypeError(f"{type(plant).__name__}: it must offer snapshot and restore")
        self._plant: Plant = plant
        self._state: Rewindable = plant
        self.step = plant.step

    @abstractmethod
    def _read(self, moved: Moved) -> PlantMotion:
        """Return the readings that the motion of the inner plant becomes."""

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per voltage (V), ``(n,)``."""
        return self._read(self._plant.advance(volts))

    def advance_edges(self, count: int, at: Array, volts: Array) -> PlantMotion:
        """Go on with edges inside the steps, see `EdgeDriven`."""
        return self._read(push(self._plant, count, at, volts))
