"""What plays share that depend on the rate of the input."""

from __future__ import annotations

from abc import ABC

from bondgraph.hysteresis.invertible import SolvedInSteps
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.rate.rate import measured_rate
from bondgraph.support.ops import Expression, Ops


class RatedPlays(SolvedInSteps, ABC):
    """Weighted plays and the rate of the input over the last accepted step.

    The memory is the last input, the rate and the n states of the plays.
    """

    __slots__ = ()

    thresholds: tuple[Expression, ...]
    weights: tuple[Expression, ...]
    smoothing: Expression

    @property
    def timed(self) -> bool:
        """Always."""
        return True

    @property
    def n_memory(self) -> int:
        """Last input, rate and n plays."""
        return 1 + len(self.thresholds)

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal (at rest), w_0."""
        return self.weights[0]

    def _rate(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        """Return the rate known after a step that ended at ``x``."""
        return measured_rate(ops, x, memory[0], memory[1], step, self.smoothing)
