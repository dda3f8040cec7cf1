"""A bent spring of a lossy material: the bent part of its effort comes with a loss of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.elements import Parameter
from bondgraph.laws.law import Law
from bondgraph.laws.polynomial import Polynomial
from bondgraph.support.bounds import NonZero
from bondgraph.support.ops import Ops

SHORTEST = 1e-15
"""s; where a record begins no time has passed, and nothing has moved."""


@dataclass(frozen=True)
class LossySpring(Law):
    """``N(s) + tau dN/dt`` with ``N = a_2 z^2 + a_3 z^3``, ``z = (s - centre) / half``.

    A Kelvin-Voigt solid whose viscous stress follows the bent part of the elastic one: damping that
    grows with the displacement, ``tau (2 a_2 z + 3 a_3 z^2) / half`` (Findley, Lai, Onaran, Creep
    and Relaxation of Nonlinear Viscoelastic Materials, 1976). The rate is that of the last step.

    Parameters
    ----------
    size : float
        Typical size of N, output units.
    time : float
        Typical ``tau``, s.
    loss : float
        Start value of ``tau``, s.
    """

    centre: float = 0.0
    half: NonZero = 1.0
    size: float = 1.0
    time: float = 1e-3
    loss: float = 0.0
    unit: str = "1"
    starts: ClassVar[tuple[str, ...]] = ("size", "time", "loss", "unit")
    name: ClassVar[str] = "lossy_spring"
    energy: ClassVar[str] = "signal"
    lives_in_time: ClassVar[bool] = True
    follows: ClassVar[tuple[bool, ...]] = (True,)
    """The displacement one step ago."""

    @property
    def _curve(self) -> Polynomial:
        return Polynomial(self.centre, self.half, self.size, unit=self.unit)

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``a_2``, ``a_3`` and ``tau``."""
        loss = Parameter(f"tau_{element}", self.loss, "s", positive=False, scale=self.time)
        return (*self._curve.parameters(element), loss)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Displacement after the step."""
        return (s,)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """N at the end of the step, and what it has grown by over the step."""
        a_2, a_3, tau, step = p
        now, before = (self._curve.deviation(ops, x, (), (a_2, a_3)) for x in (s, memory[0]))
        return now + tau * (now - before) / ops.maximum(step, SHORTEST)
