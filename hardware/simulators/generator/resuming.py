"""The plants of the trial with a state that goes on from call to call."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.compiling import compiled
from hardware.simulators.generator.native import _ORDER, Row, _pointer
from hardware.simulators.generator.parameters import PLANTS

Array = NDArray[np.float64]


@cache
def _library() -> ctypes.CDLL:
    library = compiled("resume", "run.c")
    library.bench_size.restype = ctypes.c_long
    return library


@final
class Going:
    """A plant from rest on, advanced in equal steps with constant commands.

    Parameters
    ----------
    plant : str
        Name of the plant.
    values : sequence of float
        True parameters, in the order of the table of parameters.
    effects : sequence of Row
        What is added; no dead times.
    span : float
        Time (s) in which what changes with time does so.
    """

    def __init__(
        self, plant: str, values: Sequence[float], effects: Sequence[Row], span: float
    ) -> None:
        self._code = _library()
        self._state = ctypes.create_string_buffer(self._code.bench_size())
        self._sensors = len(PLANTS[plant].sensors)
        rows = np.zeros((max(len(effects), 1), 13))
        for k, e in enumerate(effects):
            rows[k, :3] = e.kind, e.slot, e.states
            rows[k, 3 : 3 + len(e.numbers)] = e.numbers
        numbers = np.array(values, dtype=float)
        self._code.bench_start(
            self._state,
            ctypes.c_int(_ORDER.index(plant)),
            ctypes.c_int(numbers.size),
            _pointer(numbers),
            ctypes.c_int(len(effects)),
            _pointer(rows),
            ctypes.c_double(span),
        )

    def begin(self, span: float) -> None:
        """Let what changes with time do so from now on, in `span` seconds."""
        self._code.bench_begin(self._state, ctypes.c_double(span))

    def advance(self, count: int, at: Array, command: Array, step: float, sub: int) -> Array | None:
        """Return the readings ``(count, sensors)`` at the ends of steps; None if it ran away.

        Parameters
        ----------
        at : (m,) array
            Where the command changes, in steps from now, rising.
        command : (m + 1,) array
            Command before the first change and after each.
        step : float
            Step (s), with `sub` steps of the integrator in it.
        """
        edges = np.ascontiguousarray(at, dtype=float)
        u = np.ascontiguousarray(command, dtype=float)
        y = np.zeros((count, self._sensors))
        good = self._code.bench_advance(
            self._state,
            ctypes.c_long(count),
            ctypes.c_double(step),
            ctypes.c_int(sub),
            ctypes.c_long(edges.size),
            _pointer(edges),
            _pointer(u),
            _pointer(y),
        )
        return y if good else None

    def snapshot(self) -> bytes:
        """Return a copy of the state."""
        return self._state.raw

    def restore(self, state: bytes) -> None:
        """Put a state back."""
        self._state.raw = state
