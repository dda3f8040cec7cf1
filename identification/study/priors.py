"""What is known of a parameter before the data."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

from bondgraph.support.errors import UnusableInput
from identification.study.scaled import Free


@dataclass(frozen=True)
class Prior(ABC):
    """What is known of a parameter before the data; abstract.

    Examples
    --------
    >>> isinstance(LogNormal(4.0, 2.0), Prior)
    True
    """

    @abstractmethod
    def on_theta(self, free: Free) -> tuple[float, float]:
        """Centre and weight (one over the standard deviation) on the scaled parameter."""


@dataclass(frozen=True)
class Normal(Prior):
    """Gaussian prior; `mean` and `sd` in the parameter's unit, sd > 0.

    Examples
    --------
    >>> from bondsight import Vary
    >>> weighed = Vary("m", prior=Normal(0.5, 0.05))
    >>> round(estimate(study.changed(free=(weighed, "d", "k"))).values["m"], 2)
    0.54
    """

    mean: float
    sd: float

    def __post_init__(self) -> None:
        """Refuse a width that is none."""
        _require(self.sd > 0 and math.isfinite(self.mean), f"Normal({self.mean}, {self.sd})")

    def on_theta(self, free: Free) -> tuple[float, float]:
        """Centre and weight; on a logarithmic parameter by the delta method."""
        if not free.log:
            return (self.mean - free.start) / free.scale, free.scale / self.sd
        _require(self.mean > 0, f"Normal({self.mean}, {self.sd}) of a positive parameter")
        return math.log(self.mean / free.start), self.mean / self.sd


@dataclass(frozen=True)
class LogNormal(Prior):
    """The logarithm is Gaussian: about two thirds of the weight within `factor` of `median`.

    Examples
    --------
    >>> from bondsight import Vary
    >>> guessed = Vary("d", prior=LogNormal(4.0, 2.0))
    >>> round(estimate(study.changed(free=("m", guessed, "k"))).values["d"], 1)
    5.1
    """

    median: float
    factor: float

    def __post_init__(self) -> None:
        """Refuse a width that is none."""
        _require(self.median > 0 and self.factor > 1, f"LogNormal({self.median}, {self.factor})")

    def on_theta(self, free: Free) -> tuple[float, float]:
        """Centre and weight."""
        width = math.log(self.factor)
        if free.log:
            return math.log(self.median / free.start), 1.0 / width
        return (self.median - free.start) / free.scale, free.scale / (self.median * width)


def _require(right: bool, what: str) -> None:
    if not right:
        raise UnusableInput(
            f"prior {what}: give a positive width (LogNormal: a factor above 1) and a finite "
            "centre, positive for parameters that must be"
        )
