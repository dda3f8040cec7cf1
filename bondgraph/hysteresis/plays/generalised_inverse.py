"""The inverse of a generalised Prandtl-Ishlinskii operator with equal envelopes.

Sizes: n memory states, N samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from bondgraph.hysteresis.checks import all_numbers
from bondgraph.hysteresis.errors import BadParameter, NotInvertible
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.hysteresis.operator import Memory
from bondgraph.hysteresis.plays.envelope import (
    Envelope,
    check_envelope,
    envelope_range,
    envelope_slope,
    inverse_envelope,
)
from bondgraph.hysteresis.plays.generalised import GeneralisedPrandtlIshlinskii
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops


@final
@dataclass(frozen=True, slots=True)
class GeneralisedInverse(InvertibleOperator[GeneralisedPrandtlIshlinskii]):
    """Plays followed by an inverse envelope, ``x = gamma^-1(P[y])``.

    Parameters
    ----------
    plays : PrandtlIshlinskii
        P, with n memory states in units of y; its output is an envelope.
    shape : sequence
        gamma, the five numbers of the envelope to undo.

    Raises
    ------
    BadParameter
        If P is of another kind or the envelope does not rise.

    References
    ----------
    aljanaideh2011

    Examples
    --------
    >>> from bondgraph.hysteresis.plays.generalised import GeneralisedPrandtlIshlinskii
    >>> line = (0.0, 0.0, 0.0, 2.0, 0.0)
    >>> forward = GeneralisedPrandtlIshlinskii((0.0, 1.0), (1.0, 0.5), line, line)
    >>> forward.inverse().run(forward.run([0.0, 2.0, 0.0])[0])[0].round(12).tolist()
    [0.0, 2.0, 0.0]
    """

    kind: ClassVar[str] = "generalised_inverse"

    plays: PrandtlIshlinskii
    shape: Envelope

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not isinstance(self.plays, PrandtlIshlinskii):
            raise BadParameter(f"plays must be a PrandtlIshlinskii, not {self.plays!r}")
        object.__setattr__(self, "shape", check_envelope("shape", self.shape))

    @property
    def n_memory(self) -> int:
        """Number of plays with a width, n."""
        return self.plays.n_memory

    @property
    def congruent(self) -> bool:
        """Only without a bend: the inverse envelope reshapes a loop according to its height."""
        return all_numbers(self.shape) and self.shape[0] == 0.0

    @property
    def linear_slope(self) -> Expression:
        """Slope right after a reversal near input 0 with the plays' output at 0."""
        at = float(inverse_envelope(NUMPY, 0.0, self.shape))
        return self.plays.linear_slope / envelope_slope(self.shape, at)

    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        return self.plays.initial_memory(x0, states, ops=ops)

    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        return inverse_envelope(ops, self.plays.value(ops, x, memory), self.shape)

    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        return self.plays.advance(ops, x, memory)

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        inner, after = self.plays.run(x, memory)
        low, high = envelope_range(self.shape)
        outside = np.flatnonzero((inner < low) | (inner > high))
        if outside.size:
            k = int(outside[0])
            raise NotInvertible(
                f"no input gives y[{k}] = {x[k]:.6g}: it needs the envelope {inner[k]:.6g}, which "
                f"saturates at {low:.6g} and {high:.6g}; keep the reference within",
                k,
            )
        return np.asarray(inverse_envelope(NUMPY, inner, self.shape), float), after

    def _inverse(self, ops: Ops) -> GeneralisedPrandtlIshlinskii:
        plain = self.plays.inverse()
        return GeneralisedPrandtlIshlinskii(plain.thresholds, plain.weights, self.shape, self.shape)

    def _inverse_memory(self, ops: Ops, memory: Memory) -> Memory:
        return self.plays.inverse_memory(memory)
