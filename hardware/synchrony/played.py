"""Plays of a held voltage behind a lag, exact at any instant."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self, final

import numpy as np

from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.support.arrays import FloatArray as Array
from hardware.synchrony.held import HeldColumns


@final
@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """The voltage, its plays, and slow relaxations of some of them.

    Within a step the voltage goes one way only, so the plays at its beginning give those at every
    instant: ``max(v - r, min(v + r, y_k))``.

    Parameters
    ----------
    volts : HeldColumns
        One column.
    widths : tuple of float
        Thresholds r (V), positive, increasing.
    slow : tuple of float
        Time constants of relaxations (s) of the voltage and of the middle play.
    """

    volts: HeldColumns
    widths: tuple[float, ...]
    slow: tuple[float, ...] = ()

    @property
    def step(self) -> float:
        """Step of the drive (s)."""
        return self.volts.step

    @property
    def lag(self) -> float:
        """Of the amplifier (s)."""
        return self.volts.lag

    @property
    def count(self) -> int:
        """Number of columns."""
        return 1 + len(self.widths) + 2 * len(self.slow)

    def with_lag(self, lag: float) -> Self:
        """Return the same behind another lag (s)."""
        return replace(self, volts=self.volts.with_lag(lag))

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return values and their slopes in time at instants (s), both (n, K)."""
        b, r = self.volts.columns[:, 0], np.asarray(self.widths)
        edges = np.asarray(self.step * np.arange(b.size + 1), float)
        begun = self.volts.at(edges)[0][:, 0]
        plays = PrandtlIshlinskii((0.0, *self.widths), (1.0,) * (r.size + 1)).regressors(begun)
        k = np.clip(np.floor(time / self.step).astype(np.intp), 0, b.size - 1)
        v, slope = self.volts.at(time)
        before = plays[k, 1:]
        now = np.maximum(v - r, np.minimum(v + r, before))
        values, slopes = [v, now], [slope, np.where(now != before, slope, 0.0)]
        for tau in self.slow:
            base = plays[:-1, [0, 1 + r.size // 2]]
            value, change = HeldColumns(base, self.step, "zero", tau).at(time)
            values.append(value)
            slopes.append(change)
        return np.column_stack(values), np.column_stack(slopes)
