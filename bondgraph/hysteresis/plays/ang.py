"""The Prandtl-Ishlinskii operator of Ang: plays, then dead zones that make the loop asymmetric.

Sizes: n + 1 plays (n memory states), m + 1 dead zones, N samples.
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import ClassVar, Self, final

from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


class _Stages(Operator, ABC):
    """Plays and dead zones, in one order or the other; the memory is the one of the plays."""

    __slots__ = ()

    play: PrandtlIshlinskii
    dead_zone: DeadZones

    def __post_init__(self) -> None:
        """Check the stages."""
        if not isinstance(self.play, PrandtlIshlinskii):
            raise BadParameter(f"play must be a PrandtlIshlinskii, not {type(self.play).__name__}")
        if not isinstance(self.dead_zone, DeadZones):
            raise BadParameter(f"dead_zone must be a DeadZone, not {type(self.dead_zone).__name__}")

    @property
    def n_memory(self) -> int:
        """Number of plays with a width, n."""
        return self.play.n_memory

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal near 0, w_0 times the dead zones' slope at 0."""
        return self.play.linear_slope * self.dead_zone.linear_slope

    def check_invertible(self) -> None:
        """Every slope of both stages must be positive."""
        self.play.check_invertible()
        self.dead_zone.check_invertible()

    def _inverse_memory(self, ops: Ops, memory: Memory) -> Memory:
        return self.play.inverse_memory(memory)


@final
@dataclass(frozen=True, slots=True)
class Ang(_Stages, InvertibleOperator["AngInverse"]):
    """Plays followed by dead zones, ``z = S[P[x]]``.

    Thresholds of the plays are in units of the input, those of the dead zones in units of the
    output of the plays; there is no order between the two. The memory is the one of the plays.

    Parameters
    ----------
    play : PrandtlIshlinskii
        P, with n memory states.
    dead_zone : DeadZones
        S.

    Raises
    ------
    BadParameter
        If a stage is of another kind.

    References
    ----------
    ang2007, kuhnen2003

    Examples
    --------
    >>> operator = Ang(PrandtlIshlinskii((0, 1), (1, 1)), DeadZones((0, 2), (1, 0.5)))
    >>> operator.run([0.0, 3.0])[0].tolist()
    [0.0, 6.5]
    """

    kind: ClassVar[str] = "ang"

    play: PrandtlIshlinskii
    dead_zone: DeadZones

    @classmethod
    def stack_2hz(cls) -> Self:
        """Return the operator fitted to a piezo stack at 2 Hz, V to m.

        Eq. (6.3) of the stack actuator thesis, there in nm. It names 12 plays besides the one of
        width 0 but prints 11 weights in all; the loop comes out right with thresholds i 50 V/12 and
        the last two weights 0. Over 0..100 V the steady loop goes from 476 nm to 4873 nm and is
        766 nm thick.
        """
        printed = (9.84, 11.13, 1.26, 2.04, 1.27, 1.45, 1.16, 1.20, 1.09, 0.85, 1.38)
        weights = tuple(w * 1e-9 for w in (*printed, 0.0, 0.0))
        thresholds = tuple(i * 50.0 / 12.0 for i in range(13))
        return cls(
            PrandtlIshlinskii(thresholds, weights), DeadZones((0.0, 342.58e-9), (1.47, 0.21))
        )

    @property
    def congruent(self) -> bool:
        """Only without a bend: the output stage reshapes a loop according to its height."""
        return len(self.dead_zone.thresholds) == 1

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        return self.play.initial_memory(x0, states, ops=ops)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self.dead_zone.value(ops, self.play.value(ops, x, memory), ())

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.play.advance(ops, x, memory)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        inner, after = self.play.run(x, memory)
        return self.dead_zone.run(inner, ())[0], after

    def _inverse(self, ops: Ops) -> AngInverse:
        return AngInverse(self.dead_zone.inverse(), self.play.inverse())


@final
@dataclass(frozen=True, slots=True)
class AngInverse(_Stages, InvertibleOperator[Ang]):
    """Dead zones followed by plays, ``x = P[S[z]]``: the inverse of `Ang`.

    Parameters
    ----------
    dead_zone : DeadZones
        S, first stage.
    play : PrandtlIshlinskii
        P, second stage, with n memory states in units of the output of S.

    Raises
    ------
    BadParameter
        If a stage is of another kind.

    References
    ----------
    ang2007, kuhnen2003

    Examples
    --------
    >>> forward = Ang(PrandtlIshlinskii((0, 1), (1, 1)), DeadZones((0, 2), (1, 0.5)))
    >>> forward.inverse().run([0.0, 6.5])[0].tolist()
    [0.0, 3.0]
    """

    kind: ClassVar[str] = "ang_inverse"

    dead_zone: DeadZones
    play: PrandtlIshlinskii

    @property
    def congruent(self) -> bool:
        """Always: between the same turning points the bent input moves the same."""
        return True

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        return self.play.initial_memory(self._bent(ops, x0), states, ops=ops)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self.play.value(ops, self._bent(ops, x), memory)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.play.advance(ops, self._bent(ops, x), memory)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        return self.play.run(self._bent(NUMPY, x), memory)

    def _bent(self, ops: Ops, x: Expression) -> Expression:
        return self.dead_zone.value(ops, x, ())

    def _inverse(self, ops: Ops) -> Ang:
        return Ang(self.play.inverse(), self.dead_zone.inverse())
