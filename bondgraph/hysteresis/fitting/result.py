"""What fits return."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Literal, TypeVar, final

from bondgraph.hysteresis.fitting.excited import Unexcited
from bondgraph.hysteresis.operator import Operator
from bondgraph.support.ops import FloatArray

Constraint = Literal["prefix_sums", "non_negative", "none"]
"""Partial sums above a minimum (the inverse exists); weights not negative; anything."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """Fitted weights and what the record says about them.

    Attributes
    ----------
    weights : array
        w, shape (n,), output per unit of a regressor.
    offset : float
        y0, unit of the output; 0 if none was fitted.
    rms : float
        Root mean square of ``Phi w + y0 - y``, unit of the output.
    n_samples : int
        N.
    constraint : {"prefix_sums", "non_negative", "none"}
        As asked for.
    lower : array
        The bounds of partial sums or weights, shape (n,); -inf where there is none.
    active : tuple of int
        Where a bound holds with equality.
    unexcited : tuple of Unexcited
        Operators the record does not determine, or hardly, with the reasons.
    standard_errors : array
        Of the weights, shape (n,), for white noise in the output and with the active bounds taken
        as known: a weight held by bounds alone has 0. Infinite for dropped ones.
    offset_error : float
        Standard error of the offset.
    condition : float
        Condition number of the fitted columns, each scaled to norm 1.
    """

    weights: FloatArray
    offset: float
    rms: float
    n_samples: int
    constraint: Constraint
    lower: FloatArray
    active: tuple[int, ...]
    unexcited: tuple[Unexcited, ...]
    standard_errors: FloatArray
    offset_error: float
    condition: float


O_co = TypeVar("O_co", bound=Operator, covariant=True)


@final
@dataclass(frozen=True, slots=True, eq=False)
class OperatorFit(Generic[O_co]):
    """An operator fitted to a record.

    ``operator.run(x[start:], memory)[0] + offset`` is the fitted output of the scored samples.

    Attributes
    ----------
    operator : Operator
        The fitted one.
    solution : LinearFit
        Weights of all thresholds asked for, errors, active bounds, unexcited operators.
    memory : tuple of float
        Memory of the operator before sample ``start``, unit of the input.
    start : int
        First scored sample.
    """

    operator: O_co
    solution: LinearFit
    memory: tuple[float, ...]
    start: int

    @property
    def weights(self) -> FloatArray:
        """Weights of all thresholds asked for, output per input."""
        return self.solution.weights

    @property
    def offset(self) -> float:
        """Fitted constant, unit of the output; 0 if none was asked for."""
        return self.solution.offset

    @property
    def rms(self) -> float:
        """Root mean square of the misfit over the scored samples, unit of the output."""
        return self.solution.rms

    @property
    def active(self) -> tuple[int, ...]:
        """Indices of the thresholds where a bound holds with equality."""
        return self.solution.active

    @property
    def unexcited(self) -> tuple[Unexcited, ...]:
        """Operators the record does not determine, or hardly, with the reasons."""
        return self.solution.unexcited

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the weights, output per input."""
        return self.solution.standard_errors
