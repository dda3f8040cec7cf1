"""A disturbance that hums: a sinusoid in time that the motion does not touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.clocked import Clocked
from bondgraph.laws.trigonometry import amplitudes, wave
from bondgraph.support.bounds import Positive
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Tone(Clocked):
    """``a sin(2 pi f t) + b cos(2 pi f t)``, `t` from the start of the run, whatever `s` is.

    Parameters
    ----------
    frequency : float
        Start value of the frequency, Hz.
    resolution : float
        One over the duration of the record, Hz: how finely the frequency shows in it.
    size : float
        Typical amplitude, output units.
    free_standing : bool
        The element is nothing but the disturbance; otherwise the deviation is added to its slope.

    Examples
    --------
    >>> law = Tone(50.0)
    >>> [p.name for p in law.parameters("d")]
    ['a_d', 'b_d', 'freq_d']
    """

    frequency: Positive = 1.0
    resolution: Positive = 0.1
    size: Positive = 1.0
    unit: str = "N"
    free_standing: bool = True
    starts: ClassVar[tuple[str, ...]] = ("frequency", "resolution", "size", "unit")
    name: ClassVar[str] = "tone"
    meanings: ClassVar[Mapping[str, str]] = {
        "a": "amplitude of the sine in time",
        "b": "amplitude of the cosine in time",
        "freq": "frequency",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Sine and cosine amplitude, frequency."""
        f, df = self.frequency, self.resolution
        return (
            *amplitudes(element, self.unit, self.size),
            Parameter(
                f"freq_{element}", f, "Hz", positive=False,
                lower=max(f - 2 * df, 0.1 * df), upper=f + 2 * df, scale=0.1 * df,
            ),
        )  # fmt: skip

    @property
    def slope(self) -> float | None:
        """None of its own if free standing."""
        return 0.0 if self.free_standing else None

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value at the end of the step."""
        a, b, f, step = p
        return wave(ops, 2 * pi * f * (memory[0] + step), a, b)
