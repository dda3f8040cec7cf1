"""Hysteresis before a plant and creep behind it, for plants that have none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.edges import as_edges
from hardware.simulators.plant_contract import Moved, Plant, PlantMotion
from hardware.simulators.plants.wrapped import WrappedPlant


@final
class HystereticPlant(WrappedPlant):
    """A plant behind play operators in parallel, virgin at 0 V.

    The plant gets ``direct V + sum g_j play(V; r_j)``.

    Parameters
    ----------
    plant : Plant
        What follows.
    radii : sequence of float
        Half widths of the plays (V), > 0.
    gains : sequence of float
        Their gains.
    direct : float, optional
        Gain of the voltage itself; by default what makes all gains sum to one.
    """

    def __init__(
        self,
        plant: Plant,
        radii: Sequence[float],
        gains: Sequence[float],
        direct: float | None = None,
    ) -> None:
        if len(radii) != len(gains) or not all(r > 0.0 for r in radii):
            raise ValueError("Hysteretic: give one gain for every radius, radii > 0")
        super().__init__(plant)
        self._radii, self._gains = np.array(radii, float), np.array(gains, float)
        self._direct = 1.0 - float(self._gains.sum()) if direct is None else direct
        self._memory = np.zeros(self._radii.size)

    def advance(self, volts: Array) -> PlantMotion:
        """Go on by one step per voltage (V), ``(n,)``."""
        return self.advance_edges(len(volts), *as_edges(np.asarray(volts, dtype=np.float64)))

    def advance_edges(self, count: int, at: Array, volts: Array) -> PlantMotion:
        """Go on with edges inside the steps, see `EdgeDriven`; the plays need nothing else."""
        return super().advance_edges(count, at, self._played(volts))

    def _read(self, moved: Moved) -> PlantMotion:
        return PlantMotion(moved.x, moved.i)

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        return self._memory, self._state.snapshot()

    def restore(self, state: Any) -> None:
        """Put a state back."""
        self._memory = state[0]
        self._state.restore(state[1])

    def _played(self, u: Array) -> Array:
        out = np.empty(u.size)
        for k, volts in enumerate(u.tolist()):
            self._memory = np.clip(self._memory, volts - self._radii, volts + self._radii)
            out[k] = self._direct * volts + float(self._gains @ self._memory)
        return out


@final
class Creeping(WrappedPlant):
    """A plant whose displacement creeps on: ``tau_j z_j' = ratio_j x - z_j``, reading x + sum z_j.

    Parameters
    ----------
    plant : Plant
        The plant.
    ratios : sequence of float
        Final creep over the immediate answer.
    taus : sequence of float
        Time constants (s), > 0.
    """

    def __init__(self, plant: Plant, ratios: Sequence[float], taus: Sequence[float]) -> None:
        if len(ratios) != len(taus) or not all(t > 0.0 for t in taus):
            raise ValueError("Creeping: give one time constant for every ratio, > 0")
        super().__init__(plant)
        self._ratios = np.array(ratios, float)
        self._decay = np.exp(-plant.step / np.array(taus, float))
        self._z = np.zeros(self._ratios.size)

    def _read(self, moved: Moved) -> PlantMotion:
        return PlantMotion(self._crept(np.ascontiguousarray(moved.x)), moved.i)

    def snapshot(self) -> Any:
        """Return a copy of the state."""
        return self._z.copy(), self._state.snapshot()

    def restore(self, state: Any) -> None:
        """Put a state back."""
        self._z[:] = state[0]
        self._state.restore(state[1])

    def _crept(self, x: Array) -> Array:
        from scipy.signal import lfilter

        out = x.copy()
        for j, keep in enumerate(self._decay):
            toward = (1.0 - keep) * self._ratios[j]
            z, last = lfilter([toward], [1.0, -keep], x, zi=[keep * self._z[j]])
            out += z
            self._z[j] = last[0] / keep
        return out
