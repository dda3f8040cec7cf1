"""Hysteresis and creep side by side, with an inverse that needs no equation to be solved.

Sizes: the memory is the one of the hysteresis, n states, followed by the one of the creep.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from bondgraph.hysteresis.composed.cascade import inverse_memory_of, inverse_of
from bondgraph.hysteresis.composed.pair import SideBySide, require_operators
from bondgraph.hysteresis.creep.log_creep import LogCreep
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.invertible import Inverse, SolvedInSteps
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.support.ops import Expression, Ops


@final
@dataclass(frozen=True, slots=True)
class HysteresisWithCreep(SideBySide, SolvedInSteps):
    """``y = H[x] + K[x]`` with creep K that does not see the present input; ``x = H^-1[y - K[x]]``.

    Followed by dead zones in a `Cascade` it is the full model of a piezo actuator with hysteresis,
    creep and saturation.

    Parameters
    ----------
    hysteresis : Operator
        H; the inverse needs one with ``inverse``.
    creep : LogCreep
        K, output in the unit of H.

    Raises
    ------
    BadParameter
        If a part is of another kind.

    References
    ----------
    krejci2001, kuhnen2003

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
    >>> hysteresis = PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5))
    >>> model = HysteresisWithCreep(hysteresis, LogCreep((1.0,), (0.0,), (0.5,)))
    >>> y, _ = model.run([2.0, 2.0, 1.0], step=1.0)
    >>> y.round(3).tolist()
    [3.132, 3.365, 2.45]
    >>> model.inverse().run(y, model.initial_memory(2.0), step=1.0)[0].round(12).tolist()
    [2.0, 2.0, 1.0]
    """

    kind: ClassVar[str] = "hysteresis_with_creep"

    hysteresis: Operator
    creep: LogCreep

    def __post_init__(self) -> None:
        """Check the parts."""
        require_operators(hysteresis=self.hysteresis)
        if not isinstance(self.creep, LogCreep):
            raise BadParameter(
                f"creep must be a LogCreep, which does not see the present input, not "
                f"{type(self.creep).__name__}; add others with Parallel"
            )

    @property
    def _parts(self) -> tuple[Operator, Operator]:
        return self.hysteresis, self.creep

    @property
    def linear_slope(self) -> Expression:
        """Slope of the hysteresis; the creep adds nothing within a step."""
        return self.hysteresis.linear_slope

    def _inverse(self, ops: Ops) -> Inverse:
        inverse_of(ops, self.hysteresis)  # raises if there is none
        return Inverse(self)

    def _memory_at(self, ops: Ops, y0: Expression, states: Memory | None) -> Memory:
        if states is not None:
            return self.initial_memory(states[self.hysteresis.n_memory], states, ops=ops)
        inverse = inverse_of(ops, self.hysteresis)
        x = inverse.value(ops, y0, inverse.initial_memory(y0, ops=ops))
        return self.initial_memory(x, ops=ops)

    def _solved(self, ops: Ops, y: Expression, memory: Memory, step: Expression) -> Expression:
        first, second = self._split(memory)
        # K[x] is made by the inputs before, so it is known before x is
        rest = y - self.creep.value(ops, y, second, step)
        inverse = inverse_of(ops, self.hysteresis)
        return inverse.value(ops, rest, inverse_memory_of(ops, self.hysteresis, first), step)
