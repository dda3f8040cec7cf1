"""What periodic and arbitrary records say before any model: response, noise, distortion."""

from __future__ import annotations

from identification.experiments.frequency.bla import best_linear_approximation, response_of_periods
from identification.experiments.frequency.distortions import (
    DistortionLevel,
    Distortions,
    distortions,
)
from identification.experiments.frequency.figures import plot_distortions, plot_response
from identification.experiments.frequency.local import local_polynomial
from identification.experiments.frequency.periods import Periods, cut
from identification.experiments.frequency.response import FrequencyResponse
from identification.statistics.periods import find_period

__all__ = [
    "DistortionLevel",
    "Distortions",
    "FrequencyResponse",
    "Periods",
    "best_linear_approximation",
    "cut",
    "distortions",
    "find_period",
    "local_polynomial",
    "plot_distortions",
    "plot_response",
    "response_of_periods",
]
