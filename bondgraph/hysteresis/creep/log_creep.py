"""Creep over decades of time: first-order relaxations, each driven through a slot.

Sizes: n thresholds, m eigenvalues, n m relaxing states and the last input, N samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Self, final

import numpy as np

from bondgraph.hysteresis.checks import (
    non_negative,
    numbers,
    parameter,
    parameters,
    positive,
    same_length,
    strictly_increasing,
)
from bondgraph.hysteresis.creep.first_order_lag import relaxed_share
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Memory, Operator
from bondgraph.hysteresis.plays.play import play
from bondgraph.support.ops import Expression, Ops


@final
@dataclass(frozen=True, slots=True)
class LogCreep(Operator):
    """Creep ``K[x] = sum_i c_i sum_j y_ij`` with ``y_ij' = a_j (play_(r_i)(x; y_ij) - y_ij)``.

    Written out, the rate is ``a_j max(x - r_i - y, min(x + r_i - y, 0))``: a state relaxes towards
    the slot of half width r_i around x, and rests inside it. With one eigenvalue a decade and equal
    weights the creep after a step grows by about c log10(t) over the decades covered.

    The input counts as held since the last accepted step, so the output at a sample is made by the
    inputs before it: ``value`` does not depend on ``x``. That makes the sum of hysteresis and
    creep invertible without solving an equation. For such an input the step is exact and may be
    divided at will, because a state never overshoots its slot: within a step it keeps its target.

    The memory is the last input, then the states y_00, y_01, .., y_10, ... No energy function is
    offered: what is lost within a step depends on the step, and the energy protocol has none.

    Parameters
    ----------
    eigenvalues : sequence
        a_j > 0, shape (m,), 1/s.
    thresholds : sequence
        r_i >= 0, shape (n,), strictly increasing, unit of the input.
    weights : sequence
        c_i, shape (n,), any sign, output per input.

    Raises
    ------
    BadParameter
        If a sequence is empty, lengths differ, an eigenvalue is not positive, or a threshold is
        negative or out of order; names the entry.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> creep = LogCreep(eigenvalues=(1.0,), thresholds=(0.0,), weights=(0.5,))
    >>> creep.run([2.0, 2.0, 2.0], step=1.0)[0].round(3).tolist()
    [0.632, 0.865, 0.95]
    """

    kind: ClassVar[str] = "log_creep"
    flows: ClassVar[bool] = True

    eigenvalues: tuple[Expression, ...]
    thresholds: tuple[Expression, ...]
    weights: tuple[Expression, ...]

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        for name in ("eigenvalues", "thresholds", "weights"):
            values = parameters(name, getattr(self, name))
            if not values:
                raise BadParameter(f"{name} is empty; creep needs at least one entry")
            object.__setattr__(self, name, values)
        same_length("thresholds", self.thresholds, "weights", self.weights)
        non_negative("eigenvalues", self.eigenvalues, strict=True)
        non_negative("thresholds", self.thresholds)
        strictly_increasing("thresholds", self.thresholds)

    @classmethod
    def over_decades(
        cls,
        fastest: float,
        slowest: float,
        weight: Expression,
        *,
        threshold: Expression = 0.0,
        per_decade: int = 1,
    ) -> Self:
        """Return creep with one threshold that grows by ``weight`` a decade of time.

        Parameters
        ----------
        fastest, slowest : float
            Shortest and longest time constant covered, s; both ends get a state.
        weight : expression
            Creep per decade, output per input.
        threshold : expression, optional
            r, unit of the input.
        per_decade : int, optional
            States a decade, at least 1. One makes the slope over log10(t) ripple by 11 %, two by
            0.2 %. The spacing is adapted so that whole steps lie between the ends.

        Returns
        -------
        LogCreep
            With one threshold.

        Raises
        ------
        BadParameter
            If a time is not positive, the slowest is not slower than the fastest, or
            ``per_decade`` is below 1.

        References
        ----------
        krejci2001

        Examples
        --------
        >>> LogCreep.over_decades(0.1, 10.0, 0.02).eigenvalues
        (10.0, 1.0, 0.1)
        """
        (first,) = numbers("fastest", (parameter("fastest", fastest),))
        (last,) = numbers("slowest", (parameter("slowest", slowest),))
        positive("fastest", first)
        if not last > first:
            raise BadParameter(f"slowest = {last} s must be longer than fastest = {first} s")
        if per_decade < 1:
            raise BadParameter(f"per_decade = {per_decade} must be at least 1")
        decades = float(np.log10(last / first))
        intervals = max(1, round(per_decade * decades))
        times = np.geomspace(first, last, intervals + 1)
        return cls(
            tuple((1.0 / times).tolist()), (threshold,), (weight * (decades / intervals),)
        )  # fmt: skip

    @property
    def timed(self) -> bool:
        """Always."""
        return True

    @property
    def n_memory(self) -> int:
        """The last input and one state for each threshold and eigenvalue, 1 + n m."""
        return 1 + len(self.thresholds) * len(self.eigenvalues)

    @property
    def linear_slope(self) -> Expression:
        """Nothing follows the input within a step: 0."""
        return 0.0

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        m = len(self.eigenvalues)
        if states is None:
            return (x0, *(0.0 * x0 for _ in range(self.n_memory - 1)))
        rows = [list(states[1 : 1 + m])]
        # States of one eigenvalue never part by more than the difference of their slots.
        for i, (low, high) in enumerate(pairwise(self.thresholds), start=1):
            row = states[1 + i * m : 1 + (i + 1) * m]
            gap = high - low
            rows.append([play(ops, near, gap, y) for near, y in zip(rows[-1], row, strict=True)])
        return (x0, *(y for row in rows for y in row))

    def _relaxed(self, ops: Ops, memory: Memory, step: Expression) -> Iterator[Expression]:
        x, states = memory[0], iter(memory[1:])
        shares = [relaxed_share(ops, a * step) for a in self.eigenvalues]
        for r in self.thresholds:
            for share in shares:
                y = next(states)
                yield y + share * (play(ops, x, r, y) - y)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        states = self._relaxed(ops, memory, step)
        output = 0.0 * x  # gives the output the shape of the input
        for c in self.weights:
            row = [next(states) for _ in self.eigenvalues]
            total = row[0]
            for y in row[1:]:
                total = total + y
            output = output + c * total
        return output

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return (x, *self._relaxed(ops, memory, step))
