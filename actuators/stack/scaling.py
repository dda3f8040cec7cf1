"""The operators of the stack in other units: ``x -> a H[b x]`` in closed form for every kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    AngInverse,
    BadParameter,
    DeadZones,
    MaxwellResistiveCapacitor,
    Operator,
    PrandtlIshlinskii,
)

_Kind = TypeVar("_Kind", bound=Operator)


def scaled(operator: _Kind, input_gain: float = 1.0, output_gain: float = 1.0) -> _Kind:
    """Return ``x -> output_gain H[input_gain x]`` as an operator of the same kind.

    Parameters
    ----------
    operator : Operator
        H: Prandtl-Ishlinskii, Al Janaideh, Ang or its inverse, dead zone, Maxwell.
    input_gain, output_gain : float
        b and a, both > 0 (a play is symmetric, but its thresholds are widths).

    Returns
    -------
    Operator
        Same kind and same number of memory states.

    Raises
    ------
    BadParameter
        If a gain is not positive, or the kind has no closed form here.

    Examples
    --------
    >>> scaled(PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5)), 2.0, 3.0)
    PrandtlIshlinskii(thresholds=(0.0, 0.5), weights=(6.0, 3.0))
    """
    for name, gain in (("input_gain", input_gain), ("output_gain", output_gain)):
        if not gain > 0.0:
            raise BadParameter(f"{name} = {gain} must be positive: thresholds are widths")
    return cast(_Kind, _scaled(operator, input_gain, output_gain))


def _scaled(operator: Operator, b: float, a: float) -> Operator:
    match operator:
        case PrandtlIshlinskii() | DeadZones():
            thresholds = _times(operator.thresholds, 1.0 / b)
            return type(operator)(thresholds, _times(operator.weights, a * b))
        case AlJanaideh():
            return replace(operator, q=a * operator.q, c=b * operator.c, alpha=a * operator.alpha)
        case Ang():
            return Ang(scaled(operator.play, b), scaled(operator.dead_zone, 1.0, a))
        case AngInverse():
            return AngInverse(scaled(operator.dead_zone, b), scaled(operator.play, 1.0, a))
        case MaxwellResistiveCapacitor():
            stiffnesses = _times(operator.stiffnesses, a * b)
            return MaxwellResistiveCapacitor(stiffnesses, _times(operator.breakaways, a))
        case _:
            raise BadParameter(
                f"{operator.kind} has no closed form under scaling here; scale its input and output"
            )


def _times(values: Sequence[Any], factor: float) -> tuple[Any, ...]:
    return tuple(v * factor for v in values)
