"""The C code of the plants, called by ctypes."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.compiling import compiled
from hardware.simulators.generator.parameters import ALL_PLANTS

Array = NDArray[np.float64]
OPEN_LOOP = (0.0, 0.0, 0.0, 0.0, 0.0)
_ORDER = tuple(ALL_PLANTS)


@dataclass(frozen=True, slots=True)
class Row:
    """An effect as the C code reads it: kind, slot, number of own states, up to ten numbers."""

    kind: int
    slot: int
    states: int
    numbers: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Run:
    """A simulated record.

    Parameters
    ----------
    command : (n,) array
        Command as applied.
    readings : (n * over, sensors) array
        What ideal sensors read, on a grid `over` times finer than the samples.
    seen : (slots, 4) array
        Rms and largest displacement, rms and largest flow of each slot.
    """

    command: Array
    readings: Array
    seen: Array


@cache
def _library() -> ctypes.CDLL:
    library = compiled("run")
    library.simulate.restype = ctypes.c_long
    return library


def _pointer(a: Array) -> ctypes.c_void_p:
    return a.ctypes.data_as(ctypes.c_void_p)


def run(
    plant: str,
    values: Sequence[float],
    effects: Sequence[Row],
    command: Array,
    *,
    sub: int,
    over: int = 1,
    hold: str = "zero",
    loop: Sequence[float] = OPEN_LOOP,
    noise: Array | None = None,
) -> Run | None:
    """Simulate a plant from rest.

    Parameters
    ----------
    plant : str
        Name of the plant.
    values : sequence of float
        True parameters, in the order of the table of parameters.
    effects : sequence of Row
        What is added.
    command : (n,) array
        Command, or the reference in closed loop.
    sub : int
        Sub-steps of the integrator in an interval of the fine record.
    over : int
        Intervals of the fine record in one between samples.
    hold : str
        ``"zero"`` or ``"linear"``: the command between samples.
    loop : sequence of five float
        On, number of the sensor, proportional, integral and differential gain.
    noise : (n,) array, optional
        Noise of the sensor in the loop.

    Returns
    -------
    Run or None
        None if the motion grew beyond bounds.
    """
    n = len(command)
    u = np.array(command, dtype=float)
    rows = np.zeros((max(len(effects), 1), 13))
    for k, e in enumerate(effects):
        rows[k, :3] = e.kind, e.slot, e.states
        rows[k, 3 : 3 + len(e.numbers)] = e.numbers
    sensors = len(ALL_PLANTS[plant].sensors)
    y = np.zeros((n * over, sensors))
    seen = np.zeros((12, 4))
    c = np.array(values, dtype=float)
    gains = np.array(loop, dtype=float)
    w = np.zeros(n) if noise is None else np.array(noise, dtype=float)
    done = _library().simulate(
        ctypes.c_int(_ORDER.index(plant)),
        _pointer(c),
        ctypes.c_int(len(effects)),
        _pointer(rows),
        _pointer(gains),
        _pointer(w),
        ctypes.c_long(n),
        ctypes.c_double(ALL_PLANTS[plant].step),
        ctypes.c_int(sub),
        ctypes.c_int(over),
        ctypes.c_int(0 if hold == "zero" else 1),
        _pointer(u),
        _pointer(y),
        _pointer(seen),
    )
    if done < n or not np.all(np.isfinite(y)):
        return None
    seen[:, ::2] = np.sqrt(seen[:, ::2])
    return Run(u, y, seen)
