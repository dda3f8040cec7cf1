"""Fitted numbers as a descent moves them: near zero at the start, of a size near one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.graph.parameter import Parameter


@dataclass(frozen=True)
class Free:
    """One fitted number: physical value = scale of theta, logarithmic or linear.

    Attributes
    ----------
    parameter : Parameter
    log : bool
        ``value = start * exp(theta)`` instead of ``value = start + scale * theta``.
    """

    parameter: Parameter
    start: float
    log: bool
    scale: float

    def value(self, theta: float) -> float:
        """Physical value."""
        return self.start * float(np.exp(theta)) if self.log else self.start + self.scale * theta

    def theta(self, value: float) -> float:
        """Return the unknown of a physical value."""
        return float(np.log(value / self.start)) if self.log else (value - self.start) / self.scale

    def slope(self, theta: float) -> float:
        """Return derivative of the value by theta."""
        return self.value(theta) if self.log else self.scale

    def bounds(self) -> tuple[float, float]:
        """Bounds on theta."""
        lo, hi = self.parameter.lower, self.parameter.upper
        if self.log:
            low = np.log(lo / self.start) if lo and lo > 0 else -12.0
            high = np.log(hi / self.start) if hi and hi > 0 else 12.0
            if self.parameter.spread is not None:
                away = np.log(self.parameter.value / self.start)
                low = max(low, away - np.log(self.parameter.spread))
                high = min(high, away + np.log(self.parameter.spread))
            return float(low), float(high)
        low = -np.inf if lo is None else (lo - self.start) / self.scale
        high = np.inf if hi is None else (hi - self.start) / self.scale
        return float(low), float(high)


def free_parameter(p: Parameter, start: float | None = None) -> Free:
    """Logarithmic for positive parameters without a lower bound of zero, else linear."""
    value = p.value if start is None else start
    log = p.positive and value > 0 and not (p.lower is not None and p.lower <= 0)
    scale = p.scale or (abs(value) if value else 1.0)
    return Free(p, value, log, scale)
