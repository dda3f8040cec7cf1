"""What periodic and arbitrary records say before any model: response, noise, distortion."""

from identification.experiments.frequency.bla import (
    best_linear_approximation as best_linear_approximation,
)
from identification.experiments.frequency.bla import response_of_periods as response_of_periods
from identification.experiments.frequency.distortions import DistortionLevel as DistortionLevel
from identification.experiments.frequency.distortions import Distortions as Distortions
from identification.experiments.frequency.distortions import distortions as distortions
from identification.experiments.frequency.local import local_polynomial as local_polynomial
from identification.experiments.frequency.periods import Periods as Periods
from identification.experiments.frequency.periods import cut as cut
from identification.experiments.frequency.response import FrequencyResponse as FrequencyResponse
from identification.statistics.periods import find_period as find_period
