"""Simulated stacks sampled by a sensor whose clock is not that of the drive (section 6.6)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuators.stack.lumped import stack_lumped
from bondgraph.hysteresis import AlJanaideh, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondgraph.simulation.simulate import simulate
from bondgraph.support.ops import FloatArray

__all__ = ["NOISE", "PLANTS", "RATE", "SAMPLES", "cosine", "sensed"]

Plant = Callable[[FloatArray, FloatArray], FloatArray]
"""Displacement from even times (s) and voltages (V)."""

RATE, SAMPLES = 3125.0, 32768
NOISE = 2e-9
RESISTANCE = 190.0


def cosine(time: FloatArray, frequency: float) -> FloatArray:
    """Return voltages of 0 to 100 V; at rest before the start."""
    return np.asarray(50 - 50 * np.cos(2 * np.pi * frequency * np.maximum(time, 0.0)))


def sensed(
    plant: str,
    volt: Callable[[FloatArray], FloatArray],
    at: FloatArray,
    *,
    fine: FloatArray | None = None,
    seed: int = 0,
) -> FloatArray:
    """Return the displacement (m, (N,)) of a plant at instants of the drive, with noise.

    Parameters
    ----------
    plant : str
        Of `PLANTS`.
    volt : callable
        Voltage (V) at times (s) of the drive.
    at : ndarray, shape (N,)
        Instants (s) by the clock of the drive; without `fine` they are even.
    fine : ndarray, optional
        Even times (s) to simulate at, with a line between them.
    seed : int
        Of the noise.
    """
    time = at if fine is None else fine
    x = PLANTS[plant](time, volt(time))
    x = x if fine is None else np.interp(at, fine, x)
    return np.asarray(x + NOISE * np.random.default_rng(seed).standard_normal(at.size))


def _operator(time: FloatArray, volt: FloatArray) -> FloatArray:
    return AlJanaideh.stack_2hz().run(volt)[0]


def _rate_dependent(time: FloatArray, volt: FloatArray) -> FloatArray:
    """Return the lumped stack behind a resistance that widens the loop with frequency."""
    law = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
    return simulate(
        stack_lumped(law, resistance=RESISTANCE), time, {"V_in": volt}, x0="rest", hold="linear"
    )["x"]


PLANTS: dict[str, Plant] = {"without rate": _operator, "with rate": _rate_dependent}
