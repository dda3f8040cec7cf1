"""Sums of saturating functions of plays: what Preisach and Krasnoselskii-Pokrovskii share.

A Preisach operator is a family of plays, one for each half width r, each followed by a memoryless
function g_r. Here there are n + 1 of them, r_0 = 0 being the input itself, and every g is piecewise
linear: a sum of cells that are constant outside their interval.

Sizes: n + 1 lines, n memory states, N samples.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from bondgraph.hysteresis.checks import is_number, numbers
from bondgraph.hysteresis.linear import LinearInWeights
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.play import play, play_chunks
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class Cell:
    """``slope (clip(p, low, high) - zero)``: a ramp that saturates on both sides.

    ``zero`` is the middle of a centred cell, else the point of the cell nearest to p = 0.

    Parameters
    ----------
    low, high : expression
        Interval of the play on which the cell works, low < high, unit of the input.
    slope : expression
        Output per input; the density of hysterons on this piece of the line.
    centred : bool
        Whether the output runs from -1/2 to 1/2 of its height; if not it is 0 at p = 0.
    """

    low: Expression
    high: Expression
    slope: Expression
    centred: bool

    def value(self, ops: Ops, p: Expression) -> Expression:
        """Return the output at the play state ``p``."""
        return self.slope * self.stroke(ops, p)

    def stroke(self, ops: Ops, p: Expression) -> Expression:
        """Return the output per unit of the slope, unit of the input."""
        if self.centred:
            zero = 0.5 * (self.low + self.high)
        else:
            zero = clipped(ops, 0.0, self.low, self.high)
        return clipped(ops, p, self.low, self.high) - zero

    def stored(self, ops: Ops, p: Expression) -> Expression:
        """Return the integral of p dg from 0 to ``p``."""
        end = clipped(ops, p, self.low, self.high)
        start = clipped(ops, 0.0, self.low, self.high)
        return 0.5 * self.slope * (end * end - start * start)


@final
@dataclass(frozen=True, slots=True)
class PlayLine:
    """One half width and the cells that act on its play.

    Parameters
    ----------
    threshold : expression
        Half width r >= 0, unit of the input.
    cells : tuple of Cell
        In any order; they may overlap.
    """

    threshold: Expression
    cells: tuple[Cell, ...]

    def value(self, ops: Ops, p: Expression) -> Expression:
        """Return g(p), the output of the line at the play state ``p``."""
        output: Expression = 0.0
        for cell in self.cells:
            output = output + cell.value(ops, p)
        return output

    def stored(self, ops: Ops, p: Expression) -> Expression:
        """Return the integral of p dg from 0 to ``p``."""
        energy: Expression = 0.0
        for cell in self.cells:
            energy = energy + cell.stored(ops, p)
        return energy

    def swing(self, ops: Ops, low: Expression, high: Expression) -> Expression:
        """Return the change of g when the input goes from one turning point to the other."""
        middle = 0.5 * (low + high)
        top = ops.maximum(high - self.threshold, middle)
        return self.value(ops, top) - self.value(ops, ops.minimum(low + self.threshold, middle))


def clipped(ops: Ops, p: Expression, low: Expression, high: Expression) -> Expression:
    """Return ``p`` kept within an interval.

    Examples
    --------
    >>> float(clipped(NUMPY, 3.0, 0.0, 1.0))
    1.0
    """
    return ops.minimum(ops.maximum(p, low), high)


class PlayLines(LinearInWeights, ABC):
    """``y = c x + sum_i g_i(play_(r_i)[x])`` with piecewise linear g_i.

    The memory is one play per half width above 0. Minor loops close and loops between the same
    turning points are congruent, whatever the slopes, because the plays do so.

    References
    ----------
    krejci1996, brokate1996
    """

    __slots__ = ()

    @property
    @abstractmethod
    def lines(self) -> tuple[PlayLine, ...]:
        """The lines in order of their half widths, shape (n + 1,), the first one of width 0."""

    @property
    def straight_slope(self) -> Expression:
        """Slope c of the part without memory and without saturation; output per input."""
        return 0.0

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal at input 0 upwards: c and the cells of width 0 there."""
        total = self.straight_slope
        for cell in self.lines[0].cells:
            low, high = numbers("knots", (cell.low, cell.high))
            if low <= 0.0 < high:
                total = total + cell.slope
        return total

    def saturation(self, *, ops: Ops = NUMPY) -> tuple[Expression, Expression]:
        """Return the outputs of the part that saturates, far below and far above all cells.

        Parameters
        ----------
        ops : Ops, optional
            Back end of symbolic parameters.

        Returns
        -------
        tuple of expression
            Unit of the output; the lowest and the highest if no slope is negative.
        """
        below: Expression = 0.0
        above: Expression = 0.0
        for cell in (cell for line in self.lines for cell in line.cells):
            below = below + cell.value(ops, cell.low)
            above = above + cell.value(ops, cell.high)
        return below, above

    @property
    def _half_widths(self) -> Sequence[Expression]:
        return [line.threshold for line in self.lines[1:]]

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        first, *others = self.lines
        output = self.straight_slope * x + first.value(ops, x)
        for line, state in zip(others, memory, strict=True):
            output = output + line.value(ops, play(ops, x, line.threshold, state))
        return output

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        first, *others = (_table(line) for line in self.lines)
        r = np.array(numbers("thresholds", [line.threshold for line in self.lines]))[1:]
        output = numbers("slope", (self.straight_slope,))[0] * x + np.interp(x, *first)
        last = np.array(memory, float)
        if not others:
            return output, ()
        for part, states in play_chunks(x, r, last):
            for table, column in zip(others, states.T, strict=True):
                output[part] += np.interp(column, *table)
            last = states[-1]
        return output, tuple(last.tolist())

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """``"input"`` if no slope is negative: every hysteron then only stores and loses."""
        slopes = [self.straight_slope, *(c.slope for line in self.lines for c in line.cells)]
        known = all(is_number(slope) and slope >= 0.0 for slope in slopes)
        return "input" if known else None

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        first, *others = self.lines
        stored = 0.5 * self.straight_slope * x * x + first.stored(ops, x)
        lost: Expression = 0.0
        states = self._advance(ops, x, memory, 0.0)
        for line, before, after in zip(others, memory, states, strict=True):
            # While the play moves, x = p + r or x = p - r: the r part of x dg is lost.
            stored = stored + line.stored(ops, after)
            moved = line.value(ops, after) - line.value(ops, before)
            lost = lost + line.threshold * ops.absolute(moved)
        return stored, lost

    def everett(self, low: Expression, high: Expression, *, ops: Ops = NUMPY) -> Expression:
        """Return half of the output change between two turning points.

        ``E = (f_high - f_(high,low)) / 2``: the change along the branch that starts at the
        turning point ``high`` of a large history, down to ``low``, halved. It is the integral of
        the Preisach density over the triangle between the two.

        Parameters
        ----------
        low, high : expression
            Turning points, low <= high, unit of the input.
        ops : Ops, optional
            Back end of the values.

        Returns
        -------
        expression
            Unit of the output.

        References
        ----------
        mayergoyz2003
        """
        change = self.straight_slope * (high - low)
        for line in self.lines:
            change = change + line.swing(ops, low, high)
        return 0.5 * change

    def loop_loss(
        self, amplitude: Expression, *, centre: Expression = 0.0, ops: Ops = NUMPY
    ) -> Expression:
        """Return the area of a closed loop, ``2 sum r_i (g_i(b - r_i) - g_i(a + r_i))``.

        The cyclic integral of x dy between a = centre - A and b = centre + A, over the lines with
        r_i < A; the energy lost per cycle when x is the effort and y the displacement.

        All but `centre`, the middle of the loop, is as in `PrandtlIshlinskii.loop_loss`.

        References
        ----------
        krejci1996
        """
        area: Expression = 0.0
        for line in self.lines[1:]:
            swing = line.swing(ops, centre - amplitude, centre + amplitude)
            area = area + 2.0 * line.threshold * swing
        return area


def _table(line: PlayLine) -> tuple[FloatArray, FloatArray]:
    """Breakpoints of g and its values there; g is constant outside them."""
    ends = numbers("knots", [end for cell in line.cells for end in (cell.low, cell.high)])
    p = np.unique(ends) if ends else np.zeros(1)
    return p, np.zeros(p.size) + line.value(NUMPY, p)


def cell_columns(p: FloatArray, cells: Sequence[Cell]) -> FloatArray:
    """Return the output of every cell per unit of its slope, shape (N, cells), at plays (N,).

    Examples
    --------
    >>> cell_columns(np.array([3.0]), (Cell(0.0, 1.0, 2.0, centred=False),)).tolist()
    [[1.0]]
    """
    return np.column_stack([cell.stroke(NUMPY, p) for cell in cells])
