"""A spring's own loss that grows with its displacement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops

SHORTEST = 1e-15
"""s; where a record begins no time has passed, and nothing has moved."""


@dataclass(frozen=True)
class GrowingDamping(Law):
    """``gamma (s - rest)^2 ds/dt`` in a storage, beside whatever bends its effort.

    In a Kelvin-Voigt solid the viscous stress follows the elastic one: a cubic spring brings a
    damping that grows with the square of the displacement (Zaitsev, Shtempluck, Buks, Gottlieb,
    Nonlinear Dynamics 67 (2012) 859). Over a step ``(s - rest)^2`` is its exact mean along the
    way and the rate that of the step, so that no step gives energy back for ``gamma >= 0``.

    Parameters
    ----------
    rest : float
        Start value of the displacement at which nothing is lost, units of `s`.
    loss : float
        Start value of ``gamma``, output units per square of `s` and rate.
    reach, size : float
        Typical displacement and ``gamma``.

    Examples
    --------
    >>> law = GrowingDamping(0.0, 3e6)
    >>> [p.name for p in law.parameters("k")]
    ['gamma_k', 'rest_k']
    """

    rest: float = 0.0
    loss: NonNegative = 0.0
    reach: Positive = 1.0
    size: Positive = 1.0
    unit: str = "N*s/m3"
    way_unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = ("rest", "loss", "reach", "size", "unit", "way_unit")
    name: ClassVar[str] = "growing_damping"
    meanings: ClassVar[Mapping[str, str]] = {
        "gamma": "damping for each square of the displacement",
        "rest": "displacement at which nothing is lost",
    }
    energy: ClassVar[str] = "dissipates"
    lives_in_time: ClassVar[bool] = True
    """The rate is the way of a step over its time."""
    follows: ClassVar[tuple[bool, ...]] = (True,)
    """The displacement one step ago."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``gamma``, then the place of rest."""
        return (
            Parameter(f"gamma_{element}", self.loss, self.unit, lower=0.0, scale=self.size),
            Parameter(
                f"rest_{element}", self.rest, self.way_unit, positive=False, scale=self.reach
            ),
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Displacement after the step."""
        return (s,)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Loss over the step: the integral of ``(s - rest)^2`` along the way, over the time."""
        gamma, rest, step = p
        now, before = s - rest, memory[0] - rest
        mean = (now * now + now * before + before * before) / 3.0
        return gamma * mean * (s - memory[0]) / ops.maximum(step, SHORTEST)
