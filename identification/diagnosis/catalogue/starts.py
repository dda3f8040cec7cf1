"""Units, slopes and start values that several effects need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.graph.elements import C, Element, R
from bondgraph.support.arrays import Array
from identification.diagnosis.screening.port_history import PortHistory


def rubbing_units(element: Element) -> tuple[str, str, str]:
    """Units of effort, flow and displacement of a mechanical element."""
    unit = getattr(element, "unit", "")
    turning = "rad" in unit or unit.replace("(", "").startswith("N*m") or "m2" in unit
    return ("N*m", "rad/s", "rad") if turning else ("N", "m/s", "m")


@dataclass(frozen=True)
class Shared:
    """The coefficient of an element as laws want it that need it too.

    Attributes
    ----------
    coefficient : str
        Name of the parameter, "" where an expression stands.
    stiffness : float
        Slope along the record.
    inverse : bool
        The parameter is a compliance or a capacity.
    """

    coefficient: str
    stiffness: float
    inverse: bool


def shared_slope(element: Element, past: PortHistory) -> Shared:
    """Coefficient of a linear storage or resistor, by name if it has one."""
    assert isinstance(element, C | R)
    inverse = isinstance(element, C) and element.stiffness is None
    value = element.stiffness if isinstance(element, C) and not inverse else element.value
    if isinstance(value, str):
        return Shared(value, past.slope, inverse)
    if isinstance(value, int | float):
        return Shared(element.name, past.slope, inverse)
    return Shared("", past.slope, False)


def rebalanced(element: Element, past: PortHistory, addition: Array) -> dict[str, float]:
    """Start value of an element's own coefficient beside an effect.

    The fitted linear element has taken over what of the effect resembles it (its equivalent
    linearisation); a start with both would count that twice.

    Parameters
    ----------
    addition : ndarray, shape (N,)
        What the effect at its start values adds to the element's output.

    Returns
    -------
    dict
        By parameter, 0.05 to 5 times the fitted value; empty where there is no free number.
    """
    assert isinstance(element, C | R)
    inverse = isinstance(element, C) and element.stiffness is None
    value = element.stiffness if isinstance(element, C) and not inverse else element.value
    if element.fixed or not isinstance(value, int | float):
        return {}
    s = past.argument - past.argument.mean()  # offsets of the sensors take the rest
    square = float(s @ s)
    if not square:
        return {}
    left = float(np.clip(1.0 - float(s @ addition) / square / past.slope, 0.05, 5.0))
    if element.spread is not None:
        slope = 1.0 / value if inverse else value
        low, high = (slope * element.spread**sign / past.slope for sign in (-0.9, 0.9))
        left = float(np.clip(left, low, high))
    slope = left * past.slope
    return {element.name: 1.0 / slope if inverse else slope}


def at_least(value: float, least: float) -> float:
    """Return a start value that is physical: the weight of a screening may have a wrong sign."""
    return max(float(value), least)


def tamed(weights: Array, size: float) -> Array:
    """Return quadratic and cubic weights shrunk until the whole curve still rises everywhere.

    ``z + (a_2 z^2 + a_3 z^3) / size`` has a slope of at least 0.5 within -1 to 1 while
    ``2 |a_2| + 3 |a_3| <= 0.5 size``; softer curves run away when the motion grows.
    """
    steepest = 2 * abs(float(weights[0])) + 3 * abs(float(weights[1]))
    return weights * min(1.0, 0.5 * size / steepest) if steepest else weights


def reach(past: PortHistory, share: float) -> float:
    """Displacement at a share of the half range above the middle."""
    return past.centre + share * past.half
