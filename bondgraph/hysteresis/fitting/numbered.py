"""Least squares in a handful of numbers, and what their intervals are.

Sizes: M samples, n numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar, final

import numpy as np

from bondgraph.hysteresis.operator import Operator
from bondgraph.support.descent import Damping, Trial, descend
from bondgraph.support.ops import FloatArray
from bondgraph.support.tall import triangle

Residual = Callable[[FloatArray], tuple[FloatArray, FloatArray] | None]
"""Numbers to residuals (M,) and their Jacobian (M, n); None where there is no model."""

_WORTHWHILE = 1e-9
_TOLD = 1e-12
"""Directions of less effect, columns scaled to norm 1, are rounding."""
_SHARE = 1e-12
"""Squared share of a number in such directions that is rounding."""
O_co = TypeVar("O_co", bound=Operator, covariant=True)


@final
@dataclass(frozen=True, slots=True)
class FittedNumber:
    """A number of an operator with its 95 % interval.

    Attributes
    ----------
    name : str
    value : float
    ci95 : tuple of float, or None
        None if the record does not determine the number; files hold it as null.
    reason : str
        Why there is no interval.
    """

    name: str
    value: float
    ci95: tuple[float, float] | None
    reason: str = ""


@final
@dataclass(frozen=True, slots=True, eq=False)
class NumberedFit(Generic[O_co]):
    """An operator fitted in all its numbers.

    Attributes
    ----------
    operator : Operator
    numbers : tuple of FittedNumber
        Those that were fitted; a correlation of the residuals from sample to sample widens their
        intervals as in a first-order process.
    rms : float
        Of the misfit over the scored samples, unit of the output.
    held_out : float
        Of the samples that the fit did not see; NaN if there are none.
    """

    operator: O_co
    numbers: tuple[FittedNumber, ...]
    rms: float
    held_out: float = math.nan


@dataclass(frozen=True, slots=True, eq=False)
class NumberedPoint:
    """Numbers, residuals and Jacobian; the cost is the rms."""

    numbers: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    cost: float


def lowered(residual: Residual, start: FloatArray, most: int = 60) -> NumberedPoint | None:
    """Lower the rms by damped Gauss-Newton steps; None if there is no model at the start."""

    def at(numbers: FloatArray) -> NumberedPoint | None:
        found = residual(numbers)
        if found is None:
            return None
        rms = float(np.sqrt(np.mean(found[0] ** 2)))
        return NumberedPoint(numbers, *found, rms)

    def steps_from(point: NumberedPoint) -> Trial[NumberedPoint]:
        r = triangle(np.column_stack((point.jacobian, point.residual)))
        a, b = r[:, :-1], -r[:, -1]
        size = np.linalg.norm(a, axis=0)
        size[size == 0.0] = 1.0

        def trial(damping: float, number: int) -> NumberedPoint | None:
            rows = np.vstack((a / size, math.sqrt(damping) * np.eye(size.size)))
            step = np.linalg.lstsq(rows, np.append(b, np.zeros(size.size)), rcond=None)[0]
            return at(point.numbers + step / size)

        return trial

    begin = at(start)
    if begin is None:
        return None
    return descend(
        begin, steps_from, Damping(start=1e-4, least=1e-12), most,
        lambda old, new: old.cost - new.cost <= _WORTHWHILE * new.cost,
    ).at  # fmt: skip


def intervals(point: NumberedPoint, names: tuple[str, ...]) -> tuple[FittedNumber, ...]:
    """Return every number with its interval, or with the reason why it has none."""
    e, size = point.residual, np.linalg.norm(point.jacobian, axis=0)
    size[size == 0.0] = 1.0
    _, effect, directions = np.linalg.svd(triangle(point.jacobian / size))
    told = int(np.count_nonzero(effect > _TOLD * effect.max(initial=0.0)))
    # numbers along the other directions change nothing that was recorded
    silent = directions[told:].T @ directions[told:]
    spreads = np.sum((directions[:told].T / effect[:told]) ** 2, axis=1)
    power = float(e @ e)
    rho = min(max(float(e[1:] @ e[:-1]) / power if power else 0.0, 0.0), 0.99)
    spread = power / max(e.size - size.size, 1) * (1.0 + rho) / (1.0 - rho)
    errors = np.sqrt(spread * spreads) / size
    return tuple(
        FittedNumber(name, float(v), None, _undetermined(j, silent, names))
        if silent[j, j] > _SHARE
        else FittedNumber(name, float(v), (float(v - 1.96 * s), float(v + 1.96 * s)))
        for j, (name, v, s) in enumerate(zip(names, point.numbers, errors, strict=True))
    )


def _undetermined(j: int, silent: FloatArray, names: tuple[str, ...]) -> str:
    others = [n for k, n in enumerate(names) if k != j and silent[j, k] ** 2 > _SHARE]
    if others:
        return f"the record tells only combinations of it with {', '.join(others)}"
    return "no sample of the record depends on it"
