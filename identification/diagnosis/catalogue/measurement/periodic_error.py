"""A reading with an error that repeats along the way."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.elements import Element
from bondgraph.laws.periodic import Periodic
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.measurement.grid_step import quantisation_step
from identification.diagnosis.catalogue.places import sensors
from identification.diagnosis.catalogue.signal_traces import reading_without_offset, unit_of
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

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
    sentence = "its reading errs periodically along the way"
    looks = "a ripple over the reading, always at the same places, whatever the speed"
    confused_with = ("position_periodic_force", "sensor_nonlinearity", "quantisation")
    separated_by = (
        "the same way at two speeds: an error of the reading keeps its size, a force is filtered "
        "by the mass"
    )
    source = "interpolation error of encoders and resolvers, first harmonic"
    where = staticmethod(sensors)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Sine and cosine along the reading, for the most promising periods."""
        y = reading_without_offset(scene, element)
        left = scene.residual[:, scene.data.names.index(element.name)]
        span = 2 * PortHistory(y, y).half
        # rounding to a grid is periodic too, and no error of an encoder
        readings = scene.data.readings[:, scene.data.names.index(element.name)]
        grid = quantisation_step(readings) or 0.0
        found = []
        for cycles in promising_cycles(y, left, TRIED):
            if span / float(cycles) < GRIDS * grid:
                continue
            turn = 2 * np.pi * cycles / span * y
            found.append(Signature.of((np.sin(turn), np.cos(turn)), period=span / float(cycles)))
        return tuple(found) or (Signature(np.zeros((y.size, 2)), shape={"period": span}),)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One period; amplitudes and period as the signature has them."""
        y = reading_without_offset(scene, element)
        left = scene.residual[:, scene.data.names.index(element.name)]
        half = PortHistory(y, y).half
        if hint is None:
            cycles = promising_cycles(y, left, 1)
            period = 2 * half / float(cycles[0] if cycles.size else 4.0)
        else:
            period = float(hint.shape["period"])
        law = Periodic(period, 0.02 * half, half, unit_of(element), unit_of(element))
        graph, (sine, cosine, length) = self.with_law(scene, element, law)
        start = {length: period}
        if hint is None:
            start[sine] = start[cosine] = 0.01 * half
        else:
            start |= hint.by_name((sine, cosine))
        return self.inserted(element, graph, (start,), (sine, cosine))


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
