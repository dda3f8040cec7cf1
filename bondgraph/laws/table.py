"""A measured characteristic: values at knots, joined straight or by a monotone cubic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Annotated, Any, ClassVar, Self

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Rising, one_of
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.ops import NUMPY, Ops

JOINS = ("linear", "pchip")


@dataclass(frozen=True)
class TableLaw(Law):
    """``output(s)`` through the points ``(knots[i], values[i])``; the whole law, not a rest.

    It replaces the element's value, and in a drive or a sensor the identity; `reference` may be any
    slope near that of the points. A table in a storage is a function of `s` alone and so stores.

    Parameters
    ----------
    knots : tuple of float
        Arguments in rising order, units of `s`.
    values : tuple of float
        Output at each knot.
    join : {"linear", "pchip"}
        Straight lines, or the cubic that keeps the monotony of the points (Fritsch, Butland,
        SIAM J. Sci. Stat. Comput. 5 (1984) 300).
    flat : bool
        Beyond the outer knots the output stays at the last value; otherwise it goes on straight.
    free : bool
        The values are parameters ``t_<i>_<element>`` that a fit may move; otherwise numbers.
    reference : float
        Slope that the linear rest carries.

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> law = TableLaw((0.0, 2.0, 6.0), (0.0, 0.0, 1.0))
    >>> float(law.output(NUMPY, 4.0, ()))
    0.5
    """

    knots: Rising = (-1.0, 1.0)
    values: tuple[float, ...] = (-1.0, 1.0)
    join: Annotated[str, one_of(*JOINS)] = "linear"
    flat: bool = True
    free: bool = False
    reference: float = 1.0
    unit: str = "1"
    name: ClassVar[str] = "table"
    energy: ClassVar[str] = "signal"

    def __post_init__(self) -> None:
        """Refuse points that are no function."""
        require_known("way to join points", "Table", JOINS, self.join)
        n = len(self.knots)
        if n < 2 or n != len(self.values):
            raise UnusableInput(
                f"Table: {n} knots and {len(self.values)} values; give at least two points and "
                "one value for each knot"
            )
        if not all(map(isfinite, (*self.knots, *self.values, self.reference))):
            raise UnusableInput("Table: a knot, a value or the reference slope is not finite")
        for i, (a, b) in enumerate(zip(self.knots, self.knots[1:], strict=False)):
            if not b > a:
                raise UnusableInput(
                    f"Table: knots[{i + 1}] = {b:g} does not lie above knots[{i}] = {a:g}; sort "
                    "the points and merge equal arguments"
                )

    @classmethod
    def odd(cls, knots: Sequence[float], values: Sequence[float], **options: Any) -> Self:
        """Return a table mirrored for negative arguments from its positive half.

        Parameters
        ----------
        knots, values : sequence of float
            Positive half; the first point is ``(0, 0)``.
        **options
            The other fields.

        Raises
        ------
        UnusableInput
            If the half does not start at the origin.
        """
        if not knots or knots[0] != 0.0 or not values or values[0] != 0.0:
            raise UnusableInput("Table.odd: the positive half has to start at the point (0, 0)")
        mirrored = (*(-k for k in reversed(knots[1:])), *knots)
        heights = (*(-v for v in reversed(values[1:])), *values)
        return cls(mirrored, heights, **options)

    @property
    def slope(self) -> float:
        """The reference slope."""
        return self.reference

    @property
    def signal_slope(self) -> float:
        """The same in a drive or a sensor."""
        return self.reference

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the values at the knots, if they are free."""
        if not self.free:
            return ()
        size = (max(self.values) - min(self.values)) or 1.0
        return tuple(
            Parameter(f"t_{i}_{element}", v, self.unit, positive=False, scale=0.1 * size)
            for i, v in enumerate(self.values)
        )

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Output less ``reference * s``."""
        return self.output(ops, s, p) - self.reference * s

    def output(self, ops: Ops, s: Any, p: Sequence[Any]) -> Any:
        """Return the table at `s`; `p` holds the values if they are free, else nothing.

        Each interval adds what it rises over the part of it that lies below `s`, so the sum has
        no branch and serves arrays and expressions.
        """
        y = tuple(p) if self.free else self.values
        x = self.knots
        d = self._slopes(ops if self.free else NUMPY, y)
        total = y[0]
        for i in range(len(x) - 1):
            h = x[i + 1] - x[i]
            t = ops.maximum(ops.minimum((s - x[i]) / h, 1.0), 0.0)
            rise = y[i + 1] - y[i]
            if self.join == "linear":
                total = total + rise * t
            else:
                # Hermite cubic less its start value
                bend = h * (d[i] + d[i + 1]) - 2.0 * rise
                turn = 3.0 * rise - h * (2.0 * d[i] + d[i + 1])
                total = total + t * (h * d[i] + t * (turn + t * bend))
        if not self.flat:
            total = total + d[0] * ops.minimum(s - x[0], 0.0) + d[-1] * ops.maximum(s - x[-1], 0.0)
        return total

    def _slopes(self, ops: Ops, y: Sequence[Any]) -> tuple[Any, ...]:
        """Slope at each knot; of straight joins only the first and the last are meant."""
        x, n = self.knots, len(self.knots)
        h = [x[i + 1] - x[i] for i in range(n - 1)]
        c = [(y[i + 1] - y[i]) / h[i] for i in range(n - 1)]
        if self.join == "linear" or n == 2:
            return (c[0], *c)
        inner = [_mean_slope(ops, h[i], h[i + 1], c[i], c[i + 1]) for i in range(n - 2)]
        first = _end_slope(ops, h[0], h[1], c[0], c[1])
        last = _end_slope(ops, h[-1], h[-2], c[-1], c[-2])
        return (first, *inner, last)


def _mean_slope(ops: Ops, h0: float, h1: float, c0: Any, c1: Any) -> Any:
    """Weighted harmonic mean of two chords, zero at an extremum or a plateau."""
    same = c0 * c1 > 0
    a, b = ops.where(same, c0, 1.0), ops.where(same, c1, 1.0)
    w0, w1 = 2.0 * h1 + h0, h1 + 2.0 * h0
    return ops.where(same, (w0 + w1) / (w0 / a + w1 / b), 0.0)


def _end_slope(ops: Ops, h0: float, h1: float, c0: Any, c1: Any) -> Any:
    """Three-point slope at an end, limited so that the first interval stays monotone."""
    d = ((2.0 * h0 + h1) * c0 - h0 * c1) / (h0 + h1)
    # both at once without a logical operator, which the back ends write differently
    steep = ops.minimum(-c0 * c1, ops.absolute(d) - 3.0 * ops.absolute(c0)) > 0
    return ops.where(d * c0 <= 0, 0.0, ops.where(steep, 3.0 * c0, d))
