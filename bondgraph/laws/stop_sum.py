"""A law with memory whose heights are parameters: a sum of stops (Maxwell slip)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.hysteresis.plays.play import play, sum_of_plays
from bondgraph.hysteresis.rate.rate import measured_rate
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive, one_of
from bondgraph.support.ops import Ops

FAR = 100.0
"""Thresholds by which a play begins beyond its end, whatever a fit makes of them."""


@dataclass(frozen=True)
class StopSum(Law):
    """Prandtl-Ishlinskii law of stop type: ``sign * sum_i h_i (s - play_{r_i}[s])``.

    With ``h_i >= 0`` every stop is a spring with a slip: the law is passive (a Maxwell slip
    element in a storage). Thresholds are fixed, heights are parameters. `rated` stops slip later
    the faster `s` moves, at ``r_i (1 + b |v| / speed)``; the rate `v` is that of the last accepted
    step, so that the widths of a step are known before it is solved (Al Janaideh and Krejci,
    IEEE/ASME Trans. Mechatronics 18 (2013) 1498; `RateDependentPrandtlIshlinskii`).

    Parameters
    ----------
    thresholds : tuple of float
        ``r_i > 0`` in units of `s`.
    height : float
        Start value of each ``h_i``, output units per unit of `s`.
    sign : float
        +1 in a storage; -1 where the output lags the argument (drive, sensor).
    rated : bool
        Thresholds grow with the rate; ``b`` is a parameter.
    speed : float
        Typical rate of `s`, units of `s` per second.
    begun : str
        What came before the first value of `s`: nothing that is remembered (``relaxed``), a way
        from zero, where all was relaxed (``virgin``), or a long way up or down (``risen``,
        ``fallen``), which leaves every stop at its slip.

    Examples
    --------
    >>> law = StopSum((1e-3, 2e-3), 0.6)
    >>> [p.name for p in law.parameters("k")]
    ['h_1_k', 'h_2_k']
    """

    thresholds: tuple[NonNegative, ...] = (1.0,)
    height: float = 0.0
    scale: float = 1.0
    sign: float = 1.0
    unit: str = "1"
    rated: bool = False
    speed: Positive = 1.0
    begun: Annotated[str, one_of("relaxed", "virgin", "risen", "fallen")] = "relaxed"
    starts: ClassVar[tuple[str, ...]] = ("height", "scale", "unit", "begun")
    name: ClassVar[str] = "prandtl_ishlinskii"
    meanings: ClassVar[Mapping[str, str]] = {
        "h_i": "stiffness of each spring that slips",
        "thresholds_i": "way after which each spring slips",
        "b": "by how much the ways grow with speed",
    }
    energy: ClassVar[str] = "dissipates"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the heights ``h_i``; of rated stops also how much they widen at `speed`, ``b``."""
        heights = tuple(
            Parameter(f"h_{i}_{element}", self.height, self.unit, lower=0.0, scale=self.scale)
            for i in range(1, len(self.thresholds) + 1)
        )
        if not self.rated:
            return heights
        return (*heights, Parameter(f"b_{element}", 0.01, "1", lower=0.0, scale=0.1))

    @property
    def timed(self) -> bool:
        """Whether the rate matters."""
        return self.rated

    @property
    def n_memory(self) -> int:
        """One play state for each threshold; of rated stops also the last argument and its rate."""
        return len(self.thresholds) + 2 * self.rated

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Plays after what came before, at rest; those far away are at their end at once."""
        return (*(self._begun(s, r) for r in self.thresholds), *((s, 0.0) if self.rated else ()))

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Memory follows `s` but where zero is remembered."""
        plays = (float(self.begun != "virgin"),) * len(self.thresholds)
        return (*plays, *((1.0, 0.0) if self.rated else ()))

    def _begun(self, s: float, r: float) -> float:
        away = {"risen": -FAR * r, "fallen": FAR * r}.get(self.begun, 0.0)
        return 0.0 if self.begun == "virgin" else s + away

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Each play moved to `s`."""
        widths = self._widths(ops, memory, p)
        plays = [play(ops, s, r, y) for r, y in zip(widths, memory, strict=False)]
        if not self.rated:
            return tuple(plays)
        last, rate = memory[-2:]
        return (*plays, s, measured_rate(ops, s, last, rate, p[-1], 0.0))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Weighted stops at `s`."""
        n, widths = len(self.thresholds), self._widths(ops, memory, p)
        return self.sign * sum_of_plays(ops, s, widths, p[:n], memory[:n], stops=True)

    def _widths(self, ops: Ops, memory: Sequence[Any], p: Sequence[Any]) -> list[Any]:
        """Half widths of the step."""
        if not self.rated:
            return list(self.thresholds)
        wider = 1.0 + p[len(self.thresholds)] * ops.absolute(memory[-1] / self.speed)
        return [r * wider for r in self.thresholds]
