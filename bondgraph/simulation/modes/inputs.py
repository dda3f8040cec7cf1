"""What all sources of a switched simulation do along the record, at any times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.signals.recorded_rates import LEAST
from bondgraph.simulation.start import missing, own_input
from bondgraph.support.arrays import Array

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

SHORT = 1e-9
"""Share of a sample below which two times are one."""


@dataclass(frozen=True)
class Inputs:
    """What all sources do along the record.

    Attributes
    ----------
    grid : ndarray, shape (N,), s
    commands : dict of str to ndarray, shape (N,), SI
    hold : {"hold", "linear"}
    """

    grid: Array
    commands: Mapping[str, Array]
    hold: str

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return float((self.grid[-1] - self.grid[0]) / (self.grid.size - 1))

    @property
    def slack(self) -> float:
        """Times so close (s) are one."""
        return SHORT * self.step

    def at(self, model: str, names: Sequence[str], recorded: Sequence[str], times: Array) -> Array:
        """Return inputs by name at rising times, shape (N, n_u); what is held ends with its last.

        Those of `recorded` are rates ``d_NAME`` of an input that is recorded as their integral.
        """
        index = self._before(times) if self.hold == "hold" else None
        u = np.empty((times.size, len(names)))
        for i, name in enumerate(names):
            way = name.partition("_")[2] if name in recorded else name
            if way != name and way in self._splines:
                u[:, i] = self._splines[way](times, 1)
            elif f"d_{name}" in recorded and name in self._splines:
                u[:, i] = self._splines[name](times)
            else:
                values = self._values(model, name)
                u[:, i] = np.interp(times, self.grid, values) if index is None else values[index]
        return u

    def _values(self, model: str, name: str) -> Array:
        """Return an input at the samples; a sensor drifts along the whole record, not a piece."""
        values = self.commands.get(name, own_input(name, self.grid.size))
        if values is None:
            raise missing(model, name, self.commands)
        return values

    @cached_property
    def _splines(self) -> dict[str, CubicSpline]:
        """Splines through commands, of which the rates of recorded integrals are the slopes."""
        from scipy.interpolate import CubicSpline

        if self.grid.size < LEAST:
            return {}
        return {n: CubicSpline(self.grid, v) for n, v in self.commands.items()}

    def _before(self, times: Array) -> Array:
        """Return the samples whose values are held at rising times."""
        index = np.searchsorted(self.grid, times + self.slack, side="right") - 1
        index[-1] = max(index[0], np.searchsorted(self.grid, times[-1] - self.slack) - 1)
        return np.clip(index, 0, None)
