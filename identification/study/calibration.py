"""Calibrations that are known to a few percent: factors on readings and commands, fitted beside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import UnusableInput, real_number, require_known
from identification.study.factors import drives, gain_name
from identification.study.priors import LogNormal, Prior


@dataclass(frozen=True)
class Known:
    """A factor that is known within bounds.

    Parameters
    ----------
    value : float
        The factor by which what is recorded is too large: 1 for a calibrated channel.
    within : float
        By how much of it the true one may differ at most (0.02 is 2 %); 0: it is exact. Where the
        data do not tell, it stays at `value`: a normal prior has two standard errors at the bound.

    Examples
    --------
    >>> Known(1.0, 0.02).bounds
    (0.98, 1.02)
    """

    value: float = 1.0
    within: float = 0.0

    def __post_init__(self) -> None:
        """Refuse factors and widths that are none."""
        object.__setattr__(self, "value", real_number("gain", self.value))
        object.__setattr__(self, "within", real_number("within", self.within))
        if not self.value > 0:
            raise UnusableInput(
                f"gain = {self.value:g}: give a positive factor, 1 for a calibrated channel; turn "
                "a channel's sign round in the recording"
            )
        if not 0.0 <= self.within < 1.0:
            raise UnusableInput(
                f"gain within {self.within:g}: give the largest error as a fraction of it, such as "
                "0.02 for 2 %"
            )

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest factor."""
        return self.value * (1.0 - self.within), self.value * (1.0 + self.within)

    def parameter(self, channel: str) -> Parameter:
        """Return the parameter that stands for the factor of a channel."""
        low, high = self.bounds
        if not low < self.value < high:
            return Parameter(gain_name(channel), self.value, "1", fixed=True)
        scale = self.value * self.within
        return Parameter(gain_name(channel), self.value, "1", lower=low, upper=high, scale=scale)


def gain_prior(p: Parameter) -> Prior:
    """Prior on a factor: its bound is two standard errors away."""
    assert p.scale is not None
    return LogNormal(p.value, math.sqrt(1.0 + p.scale / p.value))


def gains_of(graph: BondGraph, gains: Mapping[str, Known]) -> tuple[Parameter, ...]:
    """Return the parameters of the channels' factors, channels checked.

    Raises
    ------
    UnknownName, UnusableInput
        A name is no channel of the model, or its element has a factor of its own.
    """
    channels = [*(s.name for s in drives(graph)), *(s.name for s in graph.of_type(Sensor))]
    found = []
    for name, known in gains.items():
        require_known("channel", graph.name, channels, name)
        if not isinstance(known, Known):
            raise UnusableInput(f"gain of {name} = {known!r}: give Known(1.0, 0.02) for 2 %")
        if (own := graph.channel_value(graph[name], "gain")) is not None:
            raise UnusableInput(
                f"{name}: its gain {own} is a parameter of the model already; free "
                "that, or leave it out of gains"
            )
        if gain_name(name) in graph.parameters or gain_name(name) in graph.elements:
            raise UnusableInput(
                f"{graph.name} has {gain_name(name)} already, the name that the factor of "
                f"{name} would have; name it otherwise"
            )
        found.append(known.parameter(name))
    return tuple(found)
