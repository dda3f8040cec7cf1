"""Bouc-Wen memory beside a linear slope, with loops that soften, stay straight or harden."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.hysteresis.duhem.relaxation import branch
from bondgraph.laws.law import Law
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class BoucWenMemory(Law):
    """``sign h z``, ``dz/ds = 1 - |z| (gamma + beta sgn(ds z)) / reach``, exact along every move.

    The slope of z is ``1 - (beta + gamma) |z|`` while ``|z|`` grows and ``1 + (beta - gamma) |z|``
    while it falls: loops lose energy for ``beta > 0``, soften for ``gamma > -beta``, and harden
    for ``gamma < -beta``, where z is not bounded (the operator `BoucWen` leaves that out). Wen, J.
    Eng. Mech. Div. ASCE 102 (1976) 249; its five shapes in Ismail, Ikhouane and Rodellar, Arch.
    Comput. Methods Eng. 16 (2009) 161.

    Parameters
    ----------
    height, beta, gamma : float
        Start values: slope of the memory after a turn, output per argument, and two numbers
        without unit.
    scale : float
        Typical height.
    reach : float
        Typical size of the argument.
    sign : float
        1 where it adds to the output, -1 where the output lags behind, as of a drive.

    Examples
    --------
    >>> law = BoucWenMemory(0.6, 1.2, 0.7, reach=1e-3)
    >>> [p.name for p in law.parameters("k")]
    ['h_k', 'beta_k', 'gamma_k']
    """

    height: NonNegative = 0.0
    beta: NonNegative = 1.0
    gamma: float = 0.0
    scale: Positive = 1.0
    unit: str = "1"
    reach: Positive = 1.0
    sign: float = 1.0
    starts: ClassVar[tuple[str, ...]] = ("height", "beta", "gamma", "scale", "unit")
    name: ClassVar[str] = "bouc_wen"
    meanings: ClassVar[Mapping[str, str]] = {
        "h": "slope of the part with memory right after a turn",
        "beta": "how much a loop loses",
        "gamma": "how much a loop softens (hardens below -beta)",
    }
    energy: ClassVar[str] = "dissipates"
    follows: ClassVar[tuple[bool, ...]] = (True, False)
    """The last argument, and z."""

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``h``, ``beta`` and ``gamma``."""
        return (
            Parameter(f"h_{element}", self.height, self.unit, lower=0.0, scale=self.scale),
            Parameter(f"beta_{element}", self.beta, "1", lower=0.0, upper=MOST, scale=1.0),
            Parameter(
                f"gamma_{element}", self.gamma, "1", positive=False, lower=-MOST, upper=MOST,
                scale=1.0,
            ),
        )  # fmt: skip

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Argument and z after a monotone move."""
        last, z = memory
        falling, rising = (p[1] - p[2]) / self.reach, (p[1] + p[2]) / self.reach
        # odd: a way down from z is one up from -z; its slope is needed at no way, too
        way = ops.where(s >= last, 1.0, -1.0)
        return s, way * branch(ops, way * z, way * (s - last), 1.0, falling, rising)[0]

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """``sign h z`` at `s`."""
        return self.sign * p[0] * self.advance(ops, s, memory, p)[1]


MOST = 50.0
"""Largest size of beta and gamma: a fiftieth of the reach bends the loop."""
