"""What a Kalman filter saw of the recordings it was fitted to."""

from __future__ import annotations

from dataclasses import dataclass

from bondgraph.support.arrays import Array
from identification.estimation.estimates import Estimate


@dataclass(frozen=True, eq=False)
class Filtered:
    """Recordings through the filter at the fitted values, SI; arrays record by record.

    Attributes
    ----------
    log_likelihood : float
        Of the training readings, natural logarithm, SI.
    noises : tuple of Estimate
        Intensity of the process noise, ``sigma PLACE``, and deviation of each reading's noise that
        was not known, ``noise READING``.
    reading : tuple of ndarray, shape (N, n_y)
        Predicted one step ahead.
    innovation : tuple of ndarray, shape (N, n_y)
        Over its standard deviation: white with unit variance if the model is right; each reading
        less what the readings before it in the same sample tell; NaN where it is missing.
    state : tuple of ndarray, shape (N, n_x)
        Filtered: given the readings up to each sample.
    deviation : tuple of ndarray, shape (N, n_y)
        What each innovation was divided by, SI; empty in fits that were kept before it was.
    """

    log_likelihood: float
    noises: tuple[Estimate, ...]
    reading: tuple[Array, ...]
    innovation: tuple[Array, ...]
    state: tuple[Array, ...]
    deviation: tuple[Array, ...] = ()
