"""Ways to fit, behind one interface."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from identification.estimation.methods.frequency_domain import FrequencyDomain
from identification.estimation.methods.method import Method, Options, Solution
from identification.estimation.methods.multiple_shooting import MultipleShooting
from identification.estimation.methods.single_shooting import SingleShooting

__all__ = ["METHODS", "Method", "Options", "Solution"]

METHODS: Mapping[str, Method] = MappingProxyType(
    {m.name: m for m in (SingleShooting(), MultipleShooting(), FrequencyDomain())}
)
"""All methods by name."""
