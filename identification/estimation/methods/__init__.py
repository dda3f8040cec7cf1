"""Ways to fit, behind one interface."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from identification.estimation.methods.collocation import Collocation
from identification.estimation.methods.frequency_domain import FrequencyDomain
from identification.estimation.methods.method import FitOptions as FitOptions
from identification.estimation.methods.method import FitTask as FitTask
from identification.estimation.methods.method import Method as Method
from identification.estimation.methods.method import MethodSolution as MethodSolution
from identification.estimation.methods.multiple_shooting import MultipleShooting
from identification.estimation.methods.prediction_error import PredictionError
from identification.estimation.methods.single_shooting import SingleShooting

_ALL: tuple[Method, ...] = (
    SingleShooting(),
    MultipleShooting(),
    Collocation(),
    PredictionError(),
    FrequencyDomain(),
)
METHODS: Mapping[str, Method] = MappingProxyType({m.name: m for m in _ALL})
"""All methods by name."""
