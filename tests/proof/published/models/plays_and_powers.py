"""A law that is a line, a sum of plays and a few powers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.hysteresis.plays.play import play
from bondgraph.laws.law import Law
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class PlaysAndPowers(Law):
    """``gain s + sum_j w_j play_(r_j)[s] + b |s| s + a_2 s^2 + a_3 s^3 + ...``, all numbers.

    Plays of any sign and even powers are allowed, so nothing is claimed about energy: as a store
    the law is a local fit around rest, not a passive material.

    Parameters
    ----------
    gain : float
        Output per unit of `s`, without memory.
    thresholds, weights : tuple of float
        Half widths ``r_j > 0`` in units of `s`, and outputs per unit of `s`.
    powers : tuple of float
        ``a_2, a_3, ...``.
    signed_square : float
        b.
    apart : float or None
        Slope that the element adds itself: 1 in a drive, whose law is the identity and a
        deviation; the gain if not given.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> law = PlaysAndPowers(gain=1.0, thresholds=(1.0,), weights=(0.5,), powers=(0.1,))
    >>> float(law.value(NUMPY, 3.0, law.initial_memory(0.0), (), law.slope))
    4.9
    """

    gain: float = 1.0
    thresholds: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()
    powers: tuple[float, ...] = ()
    signed_square: float = 0.0
    apart: float | None = None
    name: ClassVar[str] = "plays_and_powers"
    energy: ClassVar[str] = "signal"

    @property
    def slope(self) -> float:
        """The part of the gain that the element adds."""
        return self.gain if self.apart is None else self.apart

    @property
    def n_memory(self) -> int:
        """One state for each play."""
        return len(self.thresholds)

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Virgin plays at `s`."""
        return tuple(float(max(s - r, min(s + r, 0.0))) for r in self.thresholds)

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Return 1 for plays that `s` has moved."""
        return tuple(1.0 if abs(s) > r else 0.0 for r in self.thresholds)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Each play moved to `s`."""
        return tuple(play(ops, s, r, y) for r, y in zip(self.thresholds, memory, strict=True))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Plays and powers at `s`, and what of the gain is not apart."""
        total: Any = (self.gain - self.slope) * s + self.signed_square * s * ops.maximum(s, -s)
        for w, y in zip(self.weights, self.advance(ops, s, memory, p), strict=True):
            total = total + w * y
        for order, a in enumerate(self.powers, start=2):
            total = total + a * s**order
        return total
