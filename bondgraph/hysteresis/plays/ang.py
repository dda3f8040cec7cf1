"""The Prandtl-Ishlinskii operator of Ang: plays, then dead zones that make the loop asymmetric.

Sizes: n + 1 plays (n memory states), m + 1 dead zones, N samples.
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import ClassVar, Generic, Self, final

from bondgraph.hysteresis.composed.cascade import InSeries, Other
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Operator
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import Ops


class _Stages(InSeries[Other], ABC, Generic[Other]):
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

    def check_invertible(self) -> None:
        """Every slope of both stages must be positive."""
        self.play.check_invertible()
        self.dead_zone.check_invertible()


@final
@dataclass(frozen=True, slots=True)
class Ang(_Stages["AngInverse"]):
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
    def _parts(self) -> tuple[Operator, Operator]:
        return self.play, self.dead_zone

    def _inverse(self, ops: Ops) -> AngInverse:
        return AngInverse(self.dead_zone.inverse(), self.play.inverse())


@final
@dataclass(frozen=True, slots=True)
class AngInverse(_Stages[Ang]):
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
    def _parts(self) -> tuple[Operator, Operator]:
        return self.dead_zone, self.play

    def _inverse(self, ops: Ops) -> Ang:
        return Ang(self.play.inverse(), self.dead_zone.inverse())
