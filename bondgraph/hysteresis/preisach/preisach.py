"""The Preisach operator as saturating functions of plays, with a piecewise constant density.

Sizes: n + 1 lines, n memory states, m cells on each line, N samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, final

import numpy as np

from bondgraph.hysteresis.checks import (
    from_zero,
    parameter,
    parameters,
    strictly_increasing,
)
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.preisach.play_lines import Cell, PlayLine, PlayLines, cell_columns
from bondgraph.support.ops import Expression, FloatArray


@final
@dataclass(frozen=True, slots=True)
class Preisach(PlayLines):
    """``y = c x + sum_i g_i(play_(r_i)[x])``, g_i' = w_ij between the knots v_j and v_(j+1).

    A relay that switches up at alpha and down at beta <= alpha sits at r = (alpha - beta)/2 and
    v = (alpha + beta)/2, and is up exactly while play_r[x] > v. Lines of width r_i are therefore
    parallels to the diagonal of the classical half plane, and g_i adds up the relays on them: w_ij
    is 4 times the density mu(alpha, beta) of relays with outputs -1 and 1, times the
    width of the band that the line stands for. Outside the knots there are no relays, so the
    output saturates. g_i(0) = 0. The Prandtl-Ishlinskii operator is the case of equal slopes on
    each line, within the knots. The columns of `regressors` belong to ``(slope, *densities)``.

    Parameters
    ----------
    thresholds : sequence
        Half widths r_i, shape (n + 1,), the first one 0 (its cells bend the reversible part),
        strictly increasing; unit of the input.
    knots : sequence
        v_j, shape (m + 1,), m >= 1, strictly increasing; unit of the input.
    densities : sequence
        w_ij, shape ((n + 1) m,), line by line, any sign; output per input. Not negative for a
        dissipative operator.
    slope : expression
        c, output per input.

    Raises
    ------
    BadParameter
        If the lengths differ, the first threshold is not 0, or thresholds or knots are out of
        order or not finite; names the entry.

    References
    ----------
    krejci1996, brokate1996, mayergoyz2003

    Examples
    --------
    >>> operator = Preisach((0.0, 1.0), (-2.0, 0.0, 2.0), (0.0, 0.0, 0.5, 1.0), 1.0)
    >>> operator.run([0.0, 3.0, 9.0, 0.0])[0].tolist()
    [0.0, 5.0, 11.0, 1.0]
    """

    kind: ClassVar[str] = "preisach"

    thresholds: tuple[Expression, ...]
    knots: tuple[Expression, ...]
    densities: tuple[Expression, ...]
    slope: Expression = 0.0

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        thresholds = parameters("thresholds", self.thresholds)
        knots = parameters("knots", self.knots)
        densities = parameters("densities", self.densities)
        from_zero("thresholds", thresholds, "reversible")
        strictly_increasing("thresholds", thresholds)
        if len(knots) < 2:
            raise BadParameter(f"knots has {len(knots)} entries; a cell needs two")
        strictly_increasing("knots", knots)
        expected = len(thresholds) * (len(knots) - 1)
        if len(densities) != expected:
            raise BadParameter(
                f"densities has {len(densities)} entries; {len(thresholds)} thresholds with "
                f"{len(knots) - 1} cells between the knots need {expected}, line by line"
            )
        object.__setattr__(self, "thresholds", thresholds)
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "densities", densities)
        object.__setattr__(self, "slope", parameter("slope", self.slope))

    @property
    def n_memory(self) -> int:
        """Number of lines with a width, n."""
        return len(self.thresholds) - 1

    @property
    def shape(self) -> tuple[int, int]:
        """Lines and cells per line, (n + 1, m): the shape that ``densities`` flattens."""
        return len(self.thresholds), len(self.knots) - 1

    @property
    def straight_slope(self) -> Expression:
        """Slope c of the part without memory and without saturation; output per input."""
        return self.slope

    @property
    def lines(self) -> tuple[PlayLine, ...]:
        """The lines in order of their half widths, shape (n + 1,), each with m cells."""
        m = self.shape[1]
        rows = (self.densities[i : i + m] for i in range(0, len(self.densities), m))
        return tuple(
            PlayLine(r, self._cells(row)) for r, row in zip(self.thresholds, rows, strict=True)
        )

    def _cells(self, row: Sequence[Expression]) -> tuple[Cell, ...]:
        ends = zip(pairwise(self.knots), row, strict=True)
        return tuple(Cell(low, high, w, centred=False) for (low, high), w in ends)

    @property
    def saturating_inputs(self) -> tuple[Expression, Expression]:
        """Inputs ``v_0 - r_n`` and ``v_m + r_n`` beyond which only the straight part moves."""
        return self.knots[0] - self.thresholds[-1], self.knots[-1] + self.thresholds[-1]

    def _columns(self, plays: FloatArray) -> FloatArray:
        lines = zip(plays.T, self.lines, strict=True)
        return np.column_stack([plays[:, 0], *(cell_columns(p, line.cells) for p, line in lines)])
