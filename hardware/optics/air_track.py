"""Correction of a whole record with the air that was read along it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Air, Flag
from hardware.optics.refraction import HELIUM_NEON, SENSOR_DOMAIN, ciddor_index

STALE_AFTER: Final = 4.0
"""Sensors speak about every second; older than this (s) they are taken as silent."""


@dataclass(frozen=True, slots=True, eq=False)
class AirTrack:
    """Readings of the air along a record.

    Parameters
    ----------
    instants : ndarray
        When each was measured (s, increasing), on the clock of the record.
    temperature, pressure, humidity : ndarray
        K, Pa, relative (0 to 1); all ``(m,)``.
    measured : ndarray
        ``(m,)`` bool; False for a default or a value given by the user.
    """

    instants: Array
    temperature: Array
    pressure: Array
    humidity: Array
    measured: NDArray[np.bool_]

    def __post_init__(self) -> None:
        """Check shapes and order."""
        m = self.instants.size
        columns = (self.temperature, self.pressure, self.humidity, self.measured)
        if m == 0 or any(c.shape != (m,) for c in columns):
            raise UnusableInput("air track: give at least one reading, each with T, p and humidity")
        if not (np.all(np.isfinite(self.instants)) and np.all(np.diff(self.instants) > 0.0)):
            raise UnusableInput(
                "air track: instants must increase; sort the readings, drop repeats"
            )

    @classmethod
    def of(cls, readings: Iterable[tuple[float, Air]]) -> Self:
        """Collect readings (instant when read (s), air); their age is taken off the instant.

        The same sensor value read twice has the same instant and counts once.
        """
        by_instant = {round(t - air.age, 6): air for t, air in readings}
        order = sorted(by_instant)
        airs = [by_instant[t] for t in order]
        return cls(
            np.array(order, dtype=np.float64),
            np.array([a.temperature for a in airs], dtype=np.float64),
            np.array([a.pressure for a in airs], dtype=np.float64),
            np.array([a.humidity for a in airs], dtype=np.float64),
            np.array([a.measured for a in airs], dtype=np.bool_),
        )

    def usable(self) -> NDArray[np.bool_]:
        """Which readings are measured and inside of what the sensors may say."""
        return np.array(
            [
                bool(ok) and SENSOR_DOMAIN.contains(T, p, h)
                for ok, T, p, h in zip(
                    self.measured, self.temperature, self.pressure, self.humidity, strict=True
                )
            ],
            dtype=np.bool_,
        )

    def index(
        self,
        wavelength: float = HELIUM_NEON,
        formula: Callable[..., NDArray[np.float64]] = ciddor_index,
    ) -> Array:
        """Refraction index of the usable readings, in order."""
        use = self.usable()
        return formula(self.temperature[use], self.pressure[use], self.humidity[use], wavelength)


@dataclass(frozen=True, slots=True, eq=False)
class AirCorrected:
    """A displacement corrected for the air.

    Parameters
    ----------
    position : ndarray
        ``(n,)``, m.
    index : ndarray
        ``(n,)``, index that was applied.
    flags : ndarray
        ``(n,)``, uint16: `Flag.AIR_STALE` where no usable reading is as near as `STALE_AFTER`.
    shift : ndarray
        ``(n,)``, m, what was added to the record.
    """

    position: Array
    index: Array
    flags: NDArray[np.uint16]
    shift: Array


def correct_record(
    position: ArrayLike,
    instants: ArrayLike,
    track: AirTrack,
    *,
    index_used: float,
    dead_path: float = 0.0,
    index_at_zero: float | None = None,
    wavelength: float = HELIUM_NEON,
    formula: Callable[..., NDArray[np.float64]] = ciddor_index,
) -> AirCorrected:
    """Recompute a displacement record with the air along it.

    The record counts phase since its zero: ``n_used x_read = n (x + L) - n_zero L`` with the dead
    path L; it is solved for x. The index runs straight between the readings and stays what it was
    beyond them.

    Parameters
    ----------
    position : array_like
        ``(n,)``, m, as recorded with one index.
    instants : array_like
        ``(n,)``, s, on the clock of the track.
    track : AirTrack
        Readings.
    index_used : float
        Index with which the record was made; 1 if it was not corrected.
    dead_path : float
        Of the zero (m); 0 if the device corrected for it already.
    index_at_zero : float, optional
        Index when the zero was set; by default that at the first sample.
    wavelength : float
        In vacuum (m).
    formula : callable
        `ciddor_index` or `edlen_index`.

    Returns
    -------
    AirCorrected
        Nothing is corrected, and all is flagged, if no reading is usable.
    """
    x = np.asarray(position, dtype=np.float64)
    t = np.asarray(instants, dtype=np.float64)
    if x.ndim != 1 or x.shape != t.shape:
        raise UnusableInput(f"air correction: {x.shape} positions at {t.shape} instants; give (n,)")
    use = track.usable()
    if x.size == 0 or not use.any():
        n = np.full(x.shape, float(index_used))
        return AirCorrected(
            x, n, np.full(x.shape, int(Flag.AIR_STALE), np.uint16), np.zeros(x.shape)
        )
    times = track.instants[use]
    n = np.interp(t, times, track.index(wavelength, formula))
    zero = float(n[0]) if index_at_zero is None else index_at_zero
    right = (index_used * x - (n - zero) * dead_path) / n
    flags = np.where(_age(t, times) > STALE_AFTER, int(Flag.AIR_STALE), 0).astype(np.uint16)
    return AirCorrected(right, n, flags, right - x)


def _age(t: Array, times: Array) -> Array:
    """Time (s) since the reading before; before the first one, time until it."""
    before = np.searchsorted(times, t, side="right") - 1
    return np.asarray(np.where(before < 0, times[0] - t, t - times[np.maximum(before, 0)]))
