"""Generalised Maxwell slip: a few bristles in parallel whose slip levels fall with speed."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.bracketing import bracketed
from bondgraph.laws.dahl import mean_flow
from bondgraph.laws.iteration import Iteration
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive, least, one_of
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class MaxwellSlip(Law):
    """``sum F_i x_i / delta_i`` in a resistor: each ``x_i`` follows the way and slips at its level.

    The level is ``delta_i (1 + r exp(-(f / f_s)^2))``: a bristle bears ``F_i`` in motion and
    ``(1 + r) F_i`` near rest. This is Lampaert, Swevers and Al-Bender, IEEE Trans. Automatic
    Control 47 (2002) 683, with a quick return to the Stribeck curve; with ``r = 0`` it is Maxwell
    slip (Iwan, J. Appl. Mech. 33 (1966) 893).

    Parameters
    ----------
    ways : tuple of float
        Start values of the slip lengths ``delta_i``, units of the way.
    force, drop, speed : float
        Start values of every ``F_i``, of ``r`` and of ``f_s``.
    fitted : {"all", "ways", "levels"}
        Without "all" the levels are the same in motion and at rest, ``r = 0``: a charge that drives
        stops in series is such a law of a resistor (Goldfarb and Celanovic, IEEE Control Systems 17
        (1997) 69). "levels" keeps the slip lengths.

    Examples
    --------
    >>> law = MaxwellSlip((1e-4, 4e-4), 0.8)
    >>> [p.name for p in law.parameters("d")]
    ['F_1_d', 'F_2_d', 'r_d', 'f_s_d', 'delta_1_d', 'delta_2_d']
    """

    ways: Annotated[tuple[Positive, ...], least(1)]
    force: Positive = 1.0
    drop: NonNegative = 0.1
    speed: Positive = 1e-2
    unit: str = "N"
    flow_unit: str = "m/s"
    way_unit: str = "m"
    fitted: Annotated[str, one_of("all", "ways", "levels")] = "all"
    name: ClassVar[str] = "maxwell_slip"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_i": "level of each spring that slips",
        "r": "by what part the levels near rest are higher",
        "f_s": "speed over which that excess falls",
        "delta_i": "way after which each spring slips",
    }
    energy: ClassVar[str] = "dissipates"
    lives_in_time: ClassVar[bool] = True
    """The way is the flow over time."""

    @property
    def structure(self) -> Hashable:
        """The number of bristles, and whether their levels fall."""
        return MaxwellSlip, len(self.ways), self.fitted

    @property
    def n_memory(self) -> int:
        """One bend a bristle, then the last flow."""
        return len(self.ways) + 1

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """No bristle is bent."""
        return (*(0.0 for _ in self.ways), s)

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Only the last flow follows `s`."""
        return (*(0.0 for _ in self.ways), 1.0)

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``F_i``, ``r``, ``f_s``, then the slip lengths."""
        v, counted = self.speed, tuple(enumerate(self.ways, start=1))
        levels = tuple(
            Parameter(f"F_{i}_{element}", self.force, self.unit, lower=0.0, scale=self.force)
            for i, _ in counted
        )
        ends = tuple(
            Parameter(
                f"delta_{i}_{element}", way, self.way_unit, fixed=self.fitted == "levels",
                lower=0.1 * way, upper=10 * way, scale=way,
            )
            for i, way in counted
        )  # fmt: skip
        if self.fitted != "all":
            return (*levels, *ends)
        return (
            *levels,
            Parameter(f"r_{element}", self.drop, "1", lower=0.0, upper=10.0, scale=0.1),
            Parameter(f"f_s_{element}", v, self.flow_unit, lower=0.1 * v, upper=10 * v, scale=v),
            *ends,
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Bends and flow after the step."""
        n = len(self.ways)
        moved = mean_flow(ops, s, memory[n]) * p[-1]
        level = 1.0 if self.fitted != "all" else 1.0 + p[n] * ops.exp(-((s / p[n + 1]) ** 2))
        slip = [way * level for way in self._ways(p)]
        bent = (
            ops.maximum(-most, ops.minimum(most, x + moved))
            for most, x in zip(slip, memory, strict=False)
        )
        return (*bent, s)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Force of all bristles at the end of the step."""
        n, total = len(self.ways), 0.0
        bent = self.advance(ops, s, memory, p)
        for force, way, x in zip(p[:n], self._ways(p), bent[:n], strict=True):
            total = total + force * x / way
        return total

    def iteration(self, memory: Sequence[Any], p: Sequence[Any]) -> Iteration:
        """Search between the free flow and the one that all bristles together would leave."""
        n = len(self.ways)
        more = p[n] if self.fitted == "all" else 0.0
        return bracketed(self, memory, p, sum(p[:n]) * (1.0 + more))

    def _ways(self, p: Sequence[Any]) -> Sequence[Any]:
        n = len(self.ways)
        return p[n + 2 : 2 * n + 2] if self.fitted == "all" else p[n : 2 * n]
