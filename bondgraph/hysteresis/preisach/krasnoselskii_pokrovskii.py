"""The Krasnoselskii-Pokrovskii operator: relays whose switches are ramps, on a triangular grid.

Sizes: n levels, n (n + 1)/2 hysterons, n - 1 memory states, N samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Self, final

import numpy as np

from bondgraph.hysteresis.checks import (
    count_of,
    parameter,
    parameters,
    positive,
)
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.plays.play import play
from bondgraph.hysteresis.preisach.play_lines import Cell, PlayLine, PlayLines, cell_columns
from bondgraph.support.bounds import whole
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class KrasnoselskiiPokrovskii(PlayLines):
    """Weighted sum of hysterons ``k+ = max(ridge(x - p_2), min(ridge(x - p_1), k))``.

    ``ridge`` is -1 below 0, rises linearly over the rise a, and is 1 above: a hysteron climbs from
    -1 to 1 over p_2 <= x <= p_2 + a and descends over p_1 + a >= x >= p_1. For a -> 0 it is the
    relay of the Preisach operator. p_1 <= p_2 run over n equally spaced levels.

    Because the ridge is monotone, it may be taken after the memory: a hysteron is the ridge of one
    unbounded play of half width (p_2 - p_1)/2. Hysterons of equal width share that play, so the
    memory is n - 1 plays and not n (n + 1)/2 hysterons; `hysterons` gives their values, and
    `regressors` has one column each.

    Parameters
    ----------
    low : expression
        First level, unit of the input.
    spacing : expression
        Step between levels, > 0, unit of the input.
    count : int
        Number of levels n, 1 or more.
    rise : expression
        a > 0, unit of the input; often the spacing.
    weights : sequence
        Shape (n (n + 1)/2,), any sign, in the order of `centres`; unit of the output. Not negative
        for a dissipative operator.

    Raises
    ------
    BadParameter
        If the spacing or the rise is not positive, the count is no such integer, or the number of
        weights is wrong.

    References
    ----------
    krasnoselskii1989, banks1997

    Examples
    --------
    >>> operator = KrasnoselskiiPokrovskii(0.0, 1.0, 2, 1.0, (0.0, 0.0, 1.0))
    >>> operator.run([-1.0, 1.0, 1.5, 3.0, 1.0, 0.5, 0.0])[0].tolist()
    [-1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0]
    """

    kind: ClassVar[str] = "krasnoselskii_pokrovskii"

    low: Expression
    spacing: Expression
    count: Annotated[int, whole(0, 10_000)]
    rise: Expression
    weights: tuple[Expression, ...]

    def __post_init__(self) -> None:
        """Check and store the parameters."""
        for name in ("low", "spacing", "rise"):
            object.__setattr__(self, name, parameter(name, getattr(self, name)))
        positive("spacing", self.spacing)
        positive("rise", self.rise)
        count_of("count", self.count, 1)
        weights = parameters("weights", self.weights)
        expected = self.count * (self.count + 1) // 2
        if len(weights) != expected:
            raise BadParameter(
                f"weights has {len(weights)} entries; {self.count} levels have {expected} pairs "
                "p_1 <= p_2"
            )
        object.__setattr__(self, "weights", weights)

    @classmethod
    def on_range(
        cls, low: float, high: float, count: int, weights: Sequence[Expression] | None = None
    ) -> Self:
        """Build the usual grid on an input range, with a rise of one spacing.

        The levels run from ``low`` to ``high - a``, so that every hysteron saturates at both ends.

        Parameters
        ----------
        low, high : float
            Range, low < high, unit of the input.
        count : int
            Number of levels n, 1 or more.
        weights : sequence, optional
            Shape (n (n + 1)/2,), unit of the output. Default: all equal, of sum 1.

        Returns
        -------
        KrasnoselskiiPokrovskii
            With outputs between -1 and 1 if the weights are not given.

        Raises
        ------
        BadParameter
            If the range is empty, or as the class says.

        References
        ----------
        banks1997
        """
        count_of("count", count, 1)
        spacing = (high - low) / count
        pairs = count * (count + 1) // 2
        given = (1.0 / pairs,) * pairs if weights is None else tuple(weights)
        return cls(low, spacing, count, spacing, given)

    @property
    def n_memory(self) -> int:
        """Number of plays with a width, n - 1."""
        return self.count - 1

    @property
    def _pairs(self) -> Iterator[tuple[int, int]]:
        """Levels of p_1 and p_2, narrow hysterons first."""
        for width in range(self.count):
            for first in range(self.count - width):
                yield first, first + width

    @property
    def centres(self) -> tuple[tuple[Expression, Expression], ...]:
        """Pairs (p_1, p_2) in the order of the weights: by width, then from low to high."""
        level = [self.low + i * self.spacing for i in range(self.count)]
        return tuple((level[i], level[j]) for i, j in self._pairs)

    @property
    def lines(self) -> tuple[PlayLine, ...]:
        """The plays with the ridges that act on them, shape (n,), the first one of width 0."""
        slopes = [2.0 * w / self.rise for w in self.weights]
        rows: list[list[Cell]] = [[] for _ in range(self.count)]
        for (i, j), slope in zip(self._pairs, slopes, strict=True):
            start = self.low + 0.5 * (i + j) * self.spacing
            rows[j - i].append(Cell(start, start + self.rise, slope, centred=True))
        widths = (0.0, *(0.5 * k * self.spacing for k in range(1, self.count)))
        return tuple(PlayLine(r, tuple(row)) for r, row in zip(widths, rows, strict=True))

    def hysterons(
        self, x: Expression, memory: Sequence[Expression], *, ops: Ops = NUMPY
    ) -> tuple[Expression, ...]:
        """Return the outputs of the single hysterons at ``x``, between -1 and 1.

        Parameters
        ----------
        x : expression
            Input, reached monotonically from the memory's step, unit of the input.
        memory : sequence of expression
            Shape (n - 1,).
        ops : Ops, optional
            Back end of the values.

        Returns
        -------
        tuple of expression
            Shape (n (n + 1)/2,), in the order of the weights.

        Raises
        ------
        BadMemory
            If the memory is not one of this operator.
        """
        first, *others = self.lines
        plays = zip(others, self._states(memory), strict=True)
        states = (x, *(play(ops, x, line.threshold, p) for line, p in plays))
        return tuple(
            2.0 * cell.stroke(ops, p) / self.rise
            for line, p in zip((first, *others), states, strict=True)
            for cell in line.cells
        )

    def _columns(self, plays: FloatArray) -> FloatArray:
        lines = zip(plays.T, self.lines, strict=True)
        strokes = [cell_columns(p, line.cells) for p, line in lines]
        return np.asarray(np.column_stack(strokes) * (2.0 / float(self.rise)))
