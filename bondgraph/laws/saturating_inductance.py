"""A coil whose iron saturates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.laws.limits import soft_excess
from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.ops import Ops

ROUND = 0.2
"""Half width of the rounded knee over its flux linkage."""


@dataclass(frozen=True)
class SaturatingInductance(Law):
    """Current ``c max(|p| - p_s, 0) sign(p)`` beside ``p / L``; a law of an I of inductance L.

    ``p`` is the flux linkage, V s, and the current in A. With a sharp knee ``dp / di``, the
    inductance for small changes, is ``L`` up to ``p_s`` and ``1 / (1/L + c)`` beyond, a second
    inductance ``1 / c`` in parallel; ``p / i`` falls between them. The knee is rounded over
    ``0.2 p_s`` to either side: about ``p = 0`` it leaves ``dp / di = 1 / (1/L + 0.019 c)``, at
    ``p_s`` half of ``c``. The two-slope magnetisation curve of transient programs: Dommel, EMTP
    Theory Book, 1986, on the saturation of transformers.

    Parameters
    ----------
    change : float
        Start value of ``c``, the change of the reciprocal inductance, 1/H.
    knee : float
        Start value of ``p_s``, the flux linkage at the knee, V s.
    unit, flux_unit : str
        Units of ``c`` and of ``p_s``.

    Examples
    --------
    >>> law = SaturatingInductance(20.0, 0.05)
    >>> [p.name for p in law.parameters("L")]
    ['c_s_L', 'p_s_L']
    """

    change: NonNegative = 1.0
    knee: Positive = 1.0
    unit: str = "1/H"
    flux_unit: str = "V*s"
    starts: ClassVar[tuple[str, ...]] = ("change", "knee", "unit", "flux_unit")
    name: ClassVar[str] = "saturating_inductance"
    meanings: ClassVar[Mapping[str, str]] = {
        "c_s": "change of the reciprocal inductance beyond the knee",
        "p_s": "flux linkage at the knee",
    }
    energy: ClassVar[str] = "stores"

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Change of the reciprocal inductance, knee."""
        c, knee = self.change, self.knee
        return (
            Parameter(f"c_s_{element}", c, self.unit, positive=False, lower=0.0, scale=c or 1.0),
            Parameter(
                f"p_s_{element}", knee, self.flux_unit, lower=0.1 * knee, upper=5.0 * knee,
                scale=0.2 * knee,
            ),
        )  # fmt: skip

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Return the current beside ``p / L``, A."""
        return p[0] * beyond(ops, s, p[1])


def beyond(ops: Ops, s: Any, knee: Any) -> Any:
    """Return what of `s` lies beyond a knee on either side, the knee rounded."""
    width = ROUND * knee
    return soft_excess(ops, s - knee, width) - soft_excess(ops, -s - knee, width)
