"""Plays whose slopes change with the rate of the input, after Ang.

Sizes: n plays with a width beside the identity (number 0), N samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, final

import numpy as np

from bondgraph.hysteresis.checks import (
    all_numbers,
    is_number,
    numbers,
    parameter,
    parameters,
    positive,
    same_length,
)
from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.hysteresis.invertible import Inverse
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.kuhnen import slopes
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.hysteresis.rate.rate import rate_record
from bondgraph.hysteresis.rate.rated_plays import RatedPlays
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class AngRateDependent(RatedPlays):
    """Plays of fixed width whose slopes are affine in the rate, ``S_i(v) = S_i(0) + c_i |v|``.

    S_i = w_0 + ... + w_i is the slope while the plays up to i move. v is the rate of the input
    over the last accepted step, so the slopes are known before the present input is. A negative
    c_i lets S_i reach 0 at the rate -S_i(0)/c_i; from there on the output falls with a rising input
    and the model means nothing (`rate_limit`).

    The memory is the last input, the rate v and the n states of the plays.

    Parameters
    ----------
    thresholds : sequence
        Half widths r_i, shape (n + 1,), the first one 0, strictly increasing; unit of the input.
    weights : sequence
        w_i at rest, shape (n + 1,), output per input.
    slope_gains : sequence
        c_i, shape (n + 1,), any sign, output per input and unit of rate.
    smoothing : expression, optional
        Time constant of a first-order lag on the rate, s; 0 for none.

    Raises
    ------
    BadParameter
        If the lengths differ or a threshold is out of order; names the entry.

    References
    ----------
    ang2007

    Examples
    --------
    >>> operator = AngRateDependent((0.0, 1.0), (1.0, 1.0), (0.0, -0.25))
    >>> operator.run([0.0, 2.0, 4.0], step=1.0)[0].tolist()
    [0.0, 3.0, 5.5]
    >>> operator.inverse().run([0.0, 3.0, 5.5], step=1.0)[0].tolist()
    [0.0, 2.0, 4.0]
    >>> operator.rate_limit()
    (8.0, 1)
    """

    kind: ClassVar[str] = "ang_rate_dependent"

    thresholds: tuple[Expression, ...]
    weights: tuple[Expression, ...]
    slope_gains: tuple[Expression, ...]
    smoothing: Expression = 0.0

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        plays = PrandtlIshlinskii(self.thresholds, self.weights)
        gains = parameters("slope_gains", self.slope_gains)
        same_length("thresholds", plays.thresholds, "slope_gains", gains)
        object.__setattr__(self, "thresholds", plays.thresholds)
        object.__setattr__(self, "weights", plays.weights)
        object.__setattr__(self, "slope_gains", gains)
        object.__setattr__(self, "smoothing", parameter("smoothing", self.smoothing))
        positive("smoothing", self.smoothing, or_zero=True)

    def at_rate(self, ops: Ops, rate: Expression) -> PrandtlIshlinskii:
        """Return the plays with the weights they have at a rate.

        Parameters
        ----------
        ops : Ops
            Back end of the rate.
        rate : expression
            v, unit of the input per s.

        Returns
        -------
        PrandtlIshlinskii
            Its memory is the states of the plays.

        References
        ----------
        ang2007
        """
        speed = ops.absolute(rate)
        bends = (b - a for a, b in pairwise((0.0, *self.slope_gains)))
        weights = tuple(w + c * speed for w, c in zip(self.weights, bends, strict=True))
        return PrandtlIshlinskii(self.thresholds, weights)

    def rate_limit(self) -> tuple[float, int | None]:
        """Return the rate from which on a slope is not positive, and the index of that slope.

        Returns
        -------
        float
            Unit of the input per s; infinity if no slope falls with the rate.
        int or None
            i of the first S_i to reach 0.

        Raises
        ------
        NotInvertible
            If a slope is not positive even at rest.
        BadParameter
            If a parameter is symbolic.

        References
        ----------
        ang2007
        """
        PrandtlIshlinskii(self.thresholds, self.weights).check_invertible()
        total = slopes(numbers("weights", self.weights))
        gains = numbers("slope_gains", self.slope_gains)
        limits = [(-s / c, i) for i, (s, c) in enumerate(zip(total, gains, strict=True)) if c < 0.0]
        return min(limits, default=(float("inf"), None))

    def check_invertible(self, rate: float = 0.0) -> None:
        """Raise if a slope is not positive at a rate; symbolic parameters pass.

        Parameters
        ----------
        rate : float, optional
            Highest rate of the motion, unit of the input per s.

        Raises
        ------
        NotInvertible
            With the index of the slope and the rate at which it reaches 0.
        """
        if not all_numbers((*self.weights, *self.slope_gains)):
            return
        limit, i = self.rate_limit()
        if i is not None and abs(rate) >= limit:
            raise NotInvertible(
                f"no inverse at the rate {abs(rate):.6g}: the slope S_{i} reaches 0 at "
                f"{limit:.6g} (slope_gains[{i}] = {self.slope_gains[i]:.6g}); move slower, or fit "
                "slope gains that are less negative",
                i,
            )

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        plays = PrandtlIshlinskii(self.thresholds, self.weights)
        rate = 0.0 * x0 if states is None else states[1]
        wanted = None if states is None else states[2:]
        return (x0, rate, *plays.initial_memory(x0, wanted, ops=ops))

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return self.at_rate(ops, memory[1]).value(ops, x, memory[2:])

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        rate = self._rate(ops, x, memory, step)
        plays = PrandtlIshlinskii(self.thresholds, self.weights)
        return (x, rate, *plays.advance(ops, x, memory[2:]))

    def inverse(self, rate: float = 0.0, *, ops: Ops = NUMPY) -> Inverse:
        """Return the inverse for motions up to a rate; it is checked once more on a record.

        Only the weights change with the rate, so the plays stay nested and the recursion of Kuhnen,
        applied anew in each step, is exact. The x found is fed back through the rate: where the
        slopes depend strongly on the rate, short steps need ``smoothing`` or errors grow.

        Parameters
        ----------
        rate : float, optional
            Highest rate it is meant for, unit of the input per s.
        ops : Ops, optional
            Back end of symbolic parameters.
        """
        self.check_invertible(rate)
        return self._inverse(ops)

    def _solved(self, ops: Ops, y: Expression, memory: Memory, step: Expression) -> Expression:
        if ops is NUMPY and is_number(memory[1]):
            self.check_invertible(memory[1])
        plays = self.at_rate(ops, memory[1])
        return plays.inverse().value(ops, y, plays.inverse_memory(memory[2:]))

    def _check_solved(self, y: FloatArray, x: FloatArray, memory: Memory, step: float) -> None:
        (smoothing,) = numbers("smoothing", (self.smoothing,))
        last, before = float(memory[0]), float(memory[1])
        rates = np.append(before, rate_record(x, last, before, step, smoothing)[:-1])
        self.check_invertible(float(np.max(np.abs(rates))))
