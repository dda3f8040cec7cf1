"""Operators whose memory is plays, and those that are linear in their weights."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import finite_record, numbers
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.hysteresis.plays.play import (
    play,
    play_record,
    reachable_plays,
)
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


class OnPlays(Operator, ABC):
    """An operator whose memory is the states of n plays of the input."""

    __slots__ = ()

    @property
    @abstractmethod
    def _half_widths(self) -> Sequence[Expression]:
        """Half widths of the plays that the memory holds, shape (n,)."""

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is None:
            return tuple(play(ops, x0, r, 0.0) for r in self._half_widths)
        return reachable_plays(ops, x0, self._half_widths, states)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return tuple(play(ops, x, r, y) for r, y in zip(self._half_widths, memory, strict=True))


class LinearInWeights(OnPlays, ABC):
    """An operator of plays whose output is a matrix times its weights."""

    __slots__ = ()

    @abstractmethod
    def _columns(self, plays: FloatArray) -> FloatArray:
        """Return the regressors of a record and its plays, shape (N, 1 + n)."""

    @final
    def regressors(self, x: ArrayLike, memory: Sequence[Expression] | None = None) -> FloatArray:
        """Return the outputs per unit weight: the operator is this matrix times the weights.

        Parameters
        ----------
        x : array
            Input, shape (N,), N >= 1, unit of the input.
        memory : sequence of float, optional
            Memory before the first sample, shape (n_memory,). Default: virgin at ``x[0]``.

        Returns
        -------
        array
            Shape (N, weights), unit of the output per unit of the weights; which ones and in which
            order, the operator says.

        Raises
        ------
        BadInput
            If the record is empty, not one-dimensional or not finite.
        BadMemory
            If the memory is not one of this operator.
        BadParameter
            If a threshold or knot is symbolic.
        """
        record = finite_record(x)
        r = np.array(numbers("thresholds", self._half_widths))
        start = self._initial(NUMPY, float(record[0]), None) if memory is None else memory
        states = np.array(self._states(start), float)
        plays = play_record(record, r, states) if r.size else np.empty((record.size, 0))
        return self._columns(np.column_stack((record, plays)))
