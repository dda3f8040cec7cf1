"""What a converter that holds its samples puts out between them, behind a first-order lag."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, Protocol, Self, final

import numpy as np
from scipy.signal import lfilter

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput

Hold = Literal["zero", "linear"]


class Shape(Protocol):
    """Columns over the drive's time that a fit may move in time."""

    @property
    def step(self) -> float:
        """Step of the drive (s)."""
        ...

    @property
    def lag(self) -> float:
        """First-order lag (s)."""
        ...

    @property
    def count(self) -> int:
        """Number of columns, K."""
        ...

    def with_lag(self, lag: float) -> Self:
        """Return the same behind another lag (s)."""
        ...

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return values and their slopes in time at instants (s), both (n, K)."""
        ...


@final
@dataclass(frozen=True, slots=True, eq=False)
class HeldColumns:
    """Columns over time, held (steps) or joined by straight lines, exact behind a lag.

    Within step k the output goes ``v = b_k + m (p - lag (1 - e)) + (v_k - b_k) e`` with the time
    ``p`` since the step began, ``e = exp(-p / lag)`` and the slope ``m`` (zero for steps). Before
    the first sample and after the last the output stays.

    Parameters
    ----------
    columns : ndarray
        (m, K), values at the beginnings of the steps.
    step : float
        s.
    hold : {"zero", "linear"}
    lag : float
        Time constant (s); 0 for none.
    """

    columns: Array
    step: float
    hold: Hold = "zero"
    lag: float = 0.0

    def __post_init__(self) -> None:
        """Check sizes."""
        if self.columns.ndim != 2 or self.columns.shape[0] < 2:
            raise UnusableInput(f"held drive: (m, K) values wanted, not {self.columns.shape}")
        if not self.step > 0.0 or not self.lag >= 0.0:
            raise UnusableInput(
                f"held drive: step {self.step} s and lag {self.lag} s are not times"
            )
        if self.hold not in ("zero", "linear"):
            raise UnusableInput(f"held drive: no hold {self.hold!r}; take 'zero' or 'linear'")

    @property
    def count(self) -> int:
        """Number of columns, K."""
        return int(self.columns.shape[1])

    def with_lag(self, lag: float) -> Self:
        """Return the same behind another lag (s)."""
        return replace(self, lag=lag)

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return values and their slopes in time at instants (s), both (n, K)."""
        b = self.columns
        last = b.shape[0] - 1
        k = np.clip(np.floor(time / self.step).astype(np.intp), 0, last)
        p = np.maximum(time - k * self.step, 0.0)[:, None]
        slope = self._slopes()[k] if self.hold == "linear" else np.zeros(1)
        level = b[k]
        if self.lag <= 0.0:
            return level + slope * p, np.broadcast_to(slope, level.shape)
        e = np.exp(-p / self.lag)
        rest = self._states()[k] - level
        values = level + slope * (p - self.lag * (1.0 - e)) + rest * e
        return values, slope * (1.0 - e) - rest * (e / self.lag)

    def _slopes(self) -> Array:
        return np.diff(self.columns, axis=0, append=self.columns[-1:]) / self.step

    def _states(self) -> Array:
        """Return the output at the beginnings of the steps."""
        b = self.columns
        e = float(np.exp(-self.step / self.lag))
        gain = 1.0 - e
        fed = gain * b
        if self.hold == "linear":
            fed += self._slopes() * (self.step - self.lag * gain)
        after = lfilter([1.0], [1.0, -e], fed[:-1], axis=0, zi=e * b[:1])[0]
        return np.concatenate([b[:1], after])
