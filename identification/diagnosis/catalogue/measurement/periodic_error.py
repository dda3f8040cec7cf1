"""A reading with an error that repeats along the way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.laws import Law, Periodic
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.measurement.grid_step import quantisation_step
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading
from identification.diagnosis.catalogue.site import Site, Values

TRIED = 10
"""Periods that become signatures."""
FEWEST, MOST = 1.5, 400.0
"""Cycles over the range of the reading between which periods are sought."""
GRIDS = 4.0
"""Steps of a converter that a period must span."""
FINE = 4096
"""Bins of the range."""
RESOLUTION = 4
"""Points of the spectrum per cycle."""


class PeriodicError(Effect):
    """The reading errs periodically along the way: interpolation of an encoder, eccentricity.

    The candidates are the highest peaks of the residual's spectrum over the reading, so that a
    period of a few thousandths of the range is found as easily as one of a third.
    """

    name = "periodic_error"
    family = "measurement"
    kind = "sensing"
    law = "sinusoid_of_reading"
    laws = (Periodic,)
    sentence = "its reading errs periodically along the way"
    looks = "a ripple over the reading, always at the same places, whatever the speed"
    confused_with = ("position_periodic_force", "sensor_nonlinearity", "quantisation")
    separated_by = (
        "the same way at two speeds: an error of the reading keeps its size, a force is filtered "
        "by the mass"
    )
    source = "interpolation error of encoders and resolvers, first harmonic"
    where = staticmethod(sensors)

    site = staticmethod(reading)
    weights = ("a", "b")

    def grid(self, at: Site) -> Sequence[Values]:
        """Return the most promising periods; rounding is periodic too, and no encoder's error."""
        readings = at.scene.data.readings[:, at.scene.data.names.index(at.element.name)]
        least = GRIDS * (quantisation_step(readings) or 0.0)
        cycles = promising_cycles(at.past.argument, at.residual, TRIED)
        found = [2 * at.past.half / float(c) for c in cycles]
        return [{"period": p} for p in found if p >= least]

    def made(self, at: Site, period: float = 0.0) -> Law:
        """Return one period."""
        if not period:
            cycles = promising_cycles(at.past.argument, at.residual, 1)
            period = 2 * at.past.half / float(cycles[0] if cycles.size else 4.0)
        unit, half = at.unit or "1", at.past.half
        return Periodic(period, 0.02 * half, half, unit, unit)

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the amplitudes of the hint; from none at all no fit would find the period."""
        if hint is None:
            return ({"a": 0.01 * at.past.half, "b": 0.01 * at.past.half},)
        return super().tried(at, law, hint)


def promising_cycles(y: Array, residual: Array, count: int) -> Array:
    """Cycles over the range of `y` at which the residual is periodic in `y`, most power first.

    The residual is collected in bins of `y`, freed of a cubic of `y`, and transformed; samples with
    a residual of exactly zero are not scored and do not count.

    Parameters
    ----------
    y, residual : ndarray, shape (N,)
    count : int
        How many peaks to return at most.

    Returns
    -------
    ndarray, shape (k,)
    """
    used = residual != 0
    span = float(np.ptp(y))
    if used.sum() < 16 or not span > 0:
        return np.zeros(0)
    z = (y[used] - y.min()) / span
    powers = np.vander(2 * z - 1, 4)
    r = residual[used] - powers @ np.linalg.lstsq(powers, residual[used], rcond=None)[0]
    bins = np.bincount(np.minimum((z * FINE).astype(int), FINE - 1), r, FINE)
    size = np.abs(np.fft.rfft(bins, RESOLUTION * FINE))
    cycles = np.arange(size.size) / RESOLUTION
    size[(cycles < FEWEST) | (cycles > MOST)] = 0.0
    inner = size[1:-1]
    peaks = 1 + np.flatnonzero((inner > size[:-2]) & (inner >= size[2:]) & (inner > 0))
    return np.asarray(cycles[peaks[np.argsort(-size[peaks])][:count]])
