"""The generalised Prandtl-Ishlinskii operator: plays between two envelopes.

Sizes: n + 1 operators, number 0 being the part without memory, n memory states, N samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from bondgraph.hysteresis.checks import all_numbers
from bondgraph.hysteresis.errors import BadParameter, NotInvertible
from bondgraph.hysteresis.invertible import SolvedInSteps
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.envelope import (
    Envelope,
    check_envelope,
    envelope,
    envelope_range,
    envelope_slope,
    inverse_envelope,
    largest_excess,
)
from bondgraph.hysteresis.plays.play import play
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class GeneralisedPrandtlIshlinskii(SolvedInSteps):
    """``y = w_0 (gamma_l(x) + gamma_r(x))/2 + sum_(i=1..n) w_i p_i`` with generalised plays p_i.

    ``p+ = max(gamma_l(x) - r, min(gamma_r(x) + r, p))``: the play rises along gamma_l - r and falls
    along gamma_r + r. Stated by maximum and minimum, and not by the sign of the input difference as
    often printed: the two agree only where the envelopes are equal, and only this one ignores noise
    and sampling. Unequal envelopes give asymmetric loops, bounded ones saturate.

    The part without memory acts on the mean of the envelopes, a choice of this package; published
    models give it an envelope of its own or leave it out (w_0 = 0).

    For equal envelopes ``x = gamma^-1(P^-1[y])`` with P the plays alone is the inverse, exact but
    for the rounding of gamma^-1, which grows as an envelope saturates.

    Parameters
    ----------
    thresholds : sequence
        r_i, shape (n + 1,), the first one 0, strictly increasing; unit of the envelopes.
    weights : sequence
        w_i, shape (n + 1,), any sign; output per envelope.
    left, right : sequence
        gamma_l and gamma_r, five numbers each: ``a_0 tanh(a_1 x + a_2) + a_3 x + a_4``, strictly
        increasing. gamma_l may exceed gamma_r by 2 r_1 at most.

    Raises
    ------
    BadParameter
        If thresholds and weights are no Prandtl-Ishlinskii operator, an envelope does not rise, or
        the rising bound of a play passes its falling bound, which would leave it undefined.

    References
    ----------
    aljanaideh2009, aljanaideh2011

    Examples
    --------
    >>> bend = (2.0, 0.5, 0.0, 0.0, 0.0)
    >>> operator = GeneralisedPrandtlIshlinskii((0.0, 0.5), (1.0, 1.0), bend, bend)
    >>> operator.run([0.0, 90.0, 0.0])[0].tolist()
    [0.0, 3.5, 0.5]
    """

    kind: ClassVar[str] = "generalised_prandtl_ishlinskii"

    thresholds: tuple[Expression, ...]
    weights: tuple[Expression, ...]
    left: Envelope
    right: Envelope

    def __post_init__(self) -> None:
        """Check and store the parameters as tuples."""
        plain = PrandtlIshlinskii(self.thresholds, self.weights)
        object.__setattr__(self, "thresholds", plain.thresholds)
        object.__setattr__(self, "weights", plain.weights)
        for name in ("left", "right"):
            object.__setattr__(self, name, check_envelope(name, getattr(self, name)))
        numeric = all_numbers((*self.left, *self.right, *self.thresholds))
        if numeric and self.n_memory and self.left != self.right:
            excess = largest_excess(self.left, self.right)
            room = 2.0 * self.thresholds[1]
            if excess > room * (1.0 + 1e-12):
                raise BadParameter(
                    f"left exceeds right by {excess:.6g} somewhere, more than 2 r_1 = {room:.6g}: "
                    "the rising bound of that play passes its falling bound; shift the envelopes "
                    "apart, equal their a_3, or raise thresholds[1]"
                )

    @property
    def plays(self) -> PrandtlIshlinskii:
        """The plays and weights alone; with equal envelopes they act on gamma(x)."""
        return PrandtlIshlinskii(self.thresholds, self.weights)

    @property
    def n_memory(self) -> int:
        """Number of plays with a width, n."""
        return len(self.thresholds) - 1

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal at input 0, w_0 times the mean slope of the envelopes."""
        return self.weights[0] * 0.5 * (envelope_slope(self.left) + envelope_slope(self.right))

    @property
    def symmetric(self) -> bool:
        """Whether both envelopes are known to be equal."""
        pairs = list(zip(self.left, self.right, strict=True))
        if all_numbers((*self.left, *self.right)):
            return all(a == b for a, b in pairs)
        return all(a is b for a, b in pairs)

    def _bounds(self, ops: Ops, x: Expression) -> tuple[Expression, Expression]:
        lower = envelope(ops, x, self.left)
        return lower, lower if self.symmetric else envelope(ops, x, self.right)

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        if states is None:
            at_zero = self._advance(ops, 0.0, (0.0,) * self.n_memory, 0.0)
            return self._advance(ops, x0, at_zero, 0.0)
        # Neighbouring plays stay within the difference of their widths, as plain plays do.
        lower, upper = self._bounds(ops, x0)
        chained: list[Expression] = []
        for i, wanted in enumerate(states):
            if chained:
                wanted = play(ops, chained[-1], self.thresholds[i + 1] - self.thresholds[i], wanted)
            chained.append(_bounded(ops, lower, upper, self.thresholds[i + 1], wanted))
        return tuple(chained)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        lower, upper = self._bounds(ops, x)
        output = self.weights[0] * 0.5 * (lower + upper)
        for w, state in zip(self.weights[1:], self._advance(ops, x, memory, 0.0), strict=True):
            output = output + w * state
        return output

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        lower, upper = self._bounds(ops, x)
        plays = zip(self.thresholds[1:], memory, strict=True)
        return tuple(_bounded(ops, lower, upper, r, p) for r, p in plays)

    def check_invertible(self) -> None:
        """Only equal envelopes are invertible, and only if every slope of the plays is positive."""
        if not self.symmetric:
            raise NotInvertible(
                "no exact inverse: left and right differ, and only plays on one common envelope "
                "are a Prandtl-Ishlinskii operator; use numeric_inverse",
                0,
            )
        self.plays.check_invertible()

    @property
    def _inverse_slope(self) -> Expression:
        """At output 0 of the plays: the envelope need not be 0 at input 0."""
        at = float(inverse_envelope(NUMPY, 0.0, self.left))
        return 1.0 / (self.weights[0] * envelope_slope(self.left, at))

    @property
    def _inverse_congruent(self) -> bool:
        """Only without a bend: the inverse envelope reshapes a loop according to its height."""
        return all_numbers(self.left) and self.left[0] == 0.0

    def _inverse_memory(self, ops: Ops, memory: Memory) -> Memory:
        self.check_invertible()
        return memory

    def _memory_at(self, ops: Ops, y0: Expression, states: Memory | None) -> Memory:
        inverse = self.plays.inverse()
        wanted = None if states is None else self.plays.inverse_memory(states)
        return inverse.inverse_memory(inverse.initial_memory(y0, wanted, ops=ops))

    def _solved(self, ops: Ops, y: Expression, memory: Memory, step: Expression) -> Expression:
        inner = self.plays.inverse().value(ops, y, self.plays.inverse_memory(memory))
        return inverse_envelope(ops, inner, self.left)

    def _check_solved(self, y: FloatArray, x: FloatArray, memory: Memory, step: float) -> None:
        inner, _ = self.plays.inverse().run(y, self.plays.inverse_memory(memory))
        low, high = envelope_range(self.left)
        outside = np.flatnonzero((inner < low) | (inner > high))
        if outside.size:
            k = int(outside[0])
            raise NotInvertible(
                f"no input gives y[{k}] = {y[k]:.6g}: it needs the envelope {inner[k]:.6g}, which "
                f"saturates at {low:.6g} and {high:.6g}; keep the reference within",
                k,
            )


def _bounded(
    ops: Ops, lower: Expression, upper: Expression, r: Expression, p: Expression
) -> Expression:
    """Generalised play: p kept between the envelopes, each moved out by r."""
    return ops.maximum(lower - r, ops.minimum(upper + r, p))
