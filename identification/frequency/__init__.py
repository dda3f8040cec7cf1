"""What periodic and arbitrary records say before any model: response, noise, distortion."""

from __future__ import annotations

from identification.frequency.bla import best_linear_approximation, response_of_periods
from identification.frequency.distortions import Distortions, Level, distortions
from identification.frequency.figures import plot_distortions, plot_response
from identification.frequency.local import local_polynomial
from identification.frequency.period_search import find_period
from identification.frequency.periods import Periods, cut
from identification.frequency.response import FrequencyResponse

__all__ = [
    "Distortions",
    "FrequencyResponse",
    "Level",
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
