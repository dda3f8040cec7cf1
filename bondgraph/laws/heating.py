"""A resistor that its own heat changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class SelfHeating(Law):
    """``r theta f`` with ``tau dtheta/dt = (f / level)^2 - theta``.

    ``theta`` is the temperature rise over that of a steady flow `level`, so that ``r`` is the
    resistance gained at that flow. The power of the linear part alone heats (first order in r).
    Between samples ``f^2`` is held at the mean of its ends and ``theta`` follows its exact
    exponential. One thermal body with linear cooling: Incropera et al., Fundamentals of Heat and
    Mass Transfer, chapter 5 (lumped capacitance).

    Parameters
    ----------
    rise : float
        Start value of ``r``, units of the resistance.
    tau : float
        Start value of the thermal time constant, s.
    level : float
        Reference flow, a fixed parameter.

    Examples
    --------
    >>> law = SelfHeating(0.4, 12.0)
    >>> [p.name for p in law.parameters("r")]
    ['r_heat_r', 'tau_heat_r', 'level_r']
    """

    rise: float = 0.1
    tau: Positive = 1.0
    level: Positive = 1.0
    unit: str = "ohm"
    flow_unit: str = "A"
    starts: ClassVar[tuple[str, ...]] = ("rise", "tau", "level", "unit", "flow_unit")
    name: ClassVar[str] = "self_heating"
    meanings: ClassVar[Mapping[str, str]] = {
        "r_heat": "change of the resistance at the reference flow once warm",
        "tau_heat": "time constant of the warming",
        "level": "reference flow",
    }
    lives_in_time: ClassVar[bool] = True
    """Heat leaves with time."""
    flows: ClassVar[bool] = True
    follows: ClassVar[tuple[bool, ...]] = (False, True)
    """Temperature rise and last flow."""

    @property
    def energy(self) -> str:  # type: ignore[override]
        """``dissipates`` while heat adds to the resistance; what it takes away gives energy."""
        return "dissipates" if self.rise >= 0 else "signal"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``r``, ``tau``, then the fixed level."""
        tau = self.tau
        return (
            Parameter(
                f"r_heat_{element}",
                self.rise,
                self.unit,
                positive=False,
                scale=abs(self.rise) or 1.0,
            ),
            Parameter(
                f"tau_heat_{element}", tau, "s", lower=0.02 * tau, upper=50.0 * tau, scale=tau
            ),
            Parameter(f"level_{element}", self.level, self.flow_unit, fixed=True),
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Warm up to the end of the step."""
        kept = ops.exp(-p[-1] / p[1])
        heat = 0.5 * (memory[1] ** 2 + s**2) / p[2] ** 2
        return (memory[0] * kept + heat * (1.0 - kept), s)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Effort of the resistance gained."""
        return p[0] * self.advance(ops, s, memory, p)[0] * s
