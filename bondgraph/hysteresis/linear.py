"""Operators that are linear in some of their numbers, which makes their identification convex."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import finite_record, numbers
from bondgraph.hysteresis.operator import Operator
from bondgraph.hysteresis.plays.play import play_record
from bondgraph.support.ops import NUMPY, Expression, FloatArray


class LinearInWeights(Operator, ABC):
    """An operator of plays whose output is a matrix times its weights."""

    __slots__ = ()

    @property
    @abstractmethod
    def _half_widths(self) -> Sequence[Expression]:
        """Half widths of the plays that the memory holds, shape (n,)."""

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
