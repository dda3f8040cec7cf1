"""What is known of two clocks, with how well."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray as Array
from hardware.contracts import Flag
from hardware.synchrony.held import Hold
from hardware.synchrony.time_map import TimeMap

How = Literal["shared clock", "copy", "copy, by its edges", "length", "phase"]


@dataclass(frozen=True, slots=True)
class SilentLoss:
    """Samples that the sensor lost without telling.

    Parameters
    ----------
    first : int
        Index of the first sample after the gap.
    missing : int
        How many are missing before it.
    """

    first: int
    missing: int


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """The time map between drive and sensor, and everything found with it.

    Attributes
    ----------
    map : TimeMap
        Where the delay is not known its nominal value stands there.
    covariance : ndarray
        (3 + bends, 3 + bends), of the numbers of the map: delay (s), skew, drift and its changes
        (1/s); infinite where unknown, zero where exact.
    how : str
        What it rests on.
    delay_known : bool
        Whether the delay was determined, and not assumed.
    span : float
        Length of the sensor's record (s).
    factor : float
        Standard errors in half a 95 % interval.
    hold : str
    lag, lag_error : float
        First-order lag of the amplifier (s) and its standard deviation (infinite: not determined).
    jitter, jitter_error : float
        Scatter of single instants (s, standard deviation); NaN if the record cannot show it.
    gain, offset : float
        Of the copy over the commanded voltage; NaN without a copy.
    rms : float
        What is left of copy or length, in its unit.
    gaps : tuple of SilentLoss
    alternatives : tuple of float
        Other delays (s) that explain the record as well (periods of the drive).
    notes : tuple of str
        What a reader must know.
    over_budget : bool
        Whether a declared budget is exceeded; the samples are then flagged.
    answer_lag, answer_lag_error : float
        Lag of the answer's fundamental behind the drive's less the delay (s), and its standard
        deviation: all that one tone tells of the two. NaN for other drives.
    """

    map: TimeMap
    covariance: Array
    how: How
    delay_known: bool
    span: float
    factor: float = 1.96
    hold: Hold = "zero"
    lag: float = 0.0
    lag_error: float = 0.0
    jitter: float = math.nan
    jitter_error: float = math.nan
    gain: float = math.nan
    offset: float = math.nan
    rms: float = math.nan
    gaps: tuple[SilentLoss, ...] = ()
    alternatives: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
    over_budget: bool = False
    answer_lag: float = math.nan
    answer_lag_error: float = math.nan

    @property
    def ratio(self) -> float:
        """Seconds of the drive's clock in one of the sensor's, at the start."""
        return self.map.ratio

    @property
    def delay_interval(self) -> tuple[float, float]:
        """95 % interval of the delay (s)."""
        return self._interval(0, self.map.delay)

    @property
    def skew_interval(self) -> tuple[float, float]:
        """95 % interval of the ratio less one, at the start."""
        return self._interval(1, self.map.skew)

    @property
    def drift_interval(self) -> tuple[float, float]:
        """95 % interval of the change of the ratio (1/s)."""
        return self._interval(2, self.map.drift)

    @property
    def flag(self) -> Flag:
        """What every sample of the record carries from the clocks."""
        clear = self.delay_known and not self.alternatives and not self.over_budget
        return Flag.GOOD if clear else Flag.UNSYNCHRONISED

    def error_at(self, time: ArrayLike) -> Array:
        """Return the standard deviation (s) of the drive's time at sensor times (s)."""
        t = np.asarray(time, float)
        if not np.isfinite(self.covariance[0, 0]):
            return np.full(t.shape, np.inf)
        by = self.map.columns(t)
        return np.asarray(np.sqrt(np.einsum("...i,ij,...j->...", by, self.covariance, by)))

    def skew_half_at(self, time: ArrayLike) -> Array:
        """Return half the 95 % interval of the ratio at sensor times (s)."""
        by, c = self.map.rates(time)[..., 1:], self.covariance[1:, 1:]
        return np.asarray(self.factor * np.sqrt(np.einsum("...i,ij,...j->...", by, c, by)))

    @property
    def worst(self) -> float:
        """Half width of the 95 % interval of the drive's time (s), where it is widest."""
        return self.factor * float(self.error_at(np.linspace(0.0, self.span, 33)).max())

    @property
    def skew_over_record(self) -> float:
        """Half width of the 95 % interval of what the clocks run apart within the record (s)."""
        c, t = self.covariance[1:, 1:], np.linspace(0.0, self.span, 33)
        by = self.map.columns(t)[:, 1:]
        return self.factor * float(np.sqrt(np.einsum("ni,ij,nj->n", by, c, by)).max())

    @property
    def sentence(self) -> str:
        """One sentence on what is known."""
        skew = f"{1e6 * self.map.skew:.4g} +- {1e6 * self._half(1):.2g} ppm"
        if self.how == "shared clock":
            skew = "0 ppm (one clock)"
        if self.covariance[2, 2] > 0.0:
            change = f"{6e7 * self.map.drift:.3g} +- {6e7 * self._half(2):.2g}"
            skew += f", drifting by {change} ppm a minute"
        if self.delay_known:
            delay = f"delay {1e6 * self.map.delay:.4g} +- {1e6 * self._half(0):.2g} us"
        else:
            why = "cannot tell it from the actuator's own lag"
            if self.how.startswith("copy"):
                why = f"leaves +- {1e6 * self._half(0):.2g} us of it open"
            delay = (
                f"delay NOT known ({1e6 * self.map.delay:.4g} us assumed): this record {why}; "
                "share the clock, record a copy of the voltage "
                "with the length, or let the trigger be known"
            )
        return f"clocks by {self.how}: skew {skew}; {delay}"

    def __str__(self) -> str:
        """Say everything a reader needs."""
        lines = [self.sentence]
        if self.how.startswith("copy"):
            lines.append(
                f"copy = {self.gain:.6g} x voltage {self.offset:+.4g}, {self.rms:.3g} rms left; "
                f"lag {1e6 * self.lag:.4g} +- {1e6 * self.factor * self.lag_error:.2g} us"
            )
        if math.isfinite(self.jitter):
            lines.append(
                f"jitter {1e6 * self.jitter:.2g} us (standard error {1e6 * self.jitter_error:.1g})"
            )
        lines += [f"{g.missing} samples lost before sample {g.first}" for g in self.gaps]
        return "\n".join([*lines, *self.notes])

    def _half(self, k: int) -> float:
        return self.factor * math.sqrt(float(self.covariance[k, k]))

    def _interval(self, k: int, value: float) -> tuple[float, float]:
        half = self._half(k)
        return (value - half, value + half)
