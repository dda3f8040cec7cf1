"""Units, slopes and start values that several effects need."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph.graph.elements import C, Element, I, R, Source
from bondgraph.graph.sensors import Sensor
from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.recording.variables import GENERIC, variables_of
from identification.diagnosis.screening.port_history import PortHistory


def rubbing_units(element: Element) -> tuple[str, str, str]:
    """Units of effort, flow and displacement; without a unit to tell by, of a mechanical one."""
    v = variables_of(element)
    if v is not GENERIC:
        return v.effort_unit, v.flow_unit, v.displacement_unit
    unit = getattr(element, "unit", "")
    turning = "rad" in unit or unit.replace("(", "").startswith("N*m") or "m2" in unit
    return ("N*m", "rad/s", "rad") if turning else ("N", "m/s", "m")


def law_units(element: Element) -> tuple[str, str]:
    """Units of what a law at `element` gives and of its argument; "1" where nothing tells them."""
    if isinstance(element, Source | Sensor):
        unit = element.unit or "1"
        return unit, unit
    v = variables_of(element)
    argument = v.displacement_unit if isinstance(element, C) else v.flow_unit
    if isinstance(element, I):
        argument = v.momentum_unit
    return v.effort_unit or "1", argument or "1"


def reciprocal_unit(unit: str) -> str:
    """Return the unit of one over a quantity, as short as it can be written.

    Examples
    --------
    >>> [reciprocal_unit(u) for u in ("F", "m/N", "rad/(N*m)", "N*s/m", "N*m", "")]
    ['1/F', 'N/m', 'N*m/rad', 'm/(N*s)', '1/(N*m)', '1']
    """
    top, _, bottom = unit.partition("/")
    if unit in ("", "1") or "/" in bottom or "(" in top:
        return f"1/({unit})" if unit not in ("", "1") else "1"
    over = f"({top})" if "*" in top else top
    bottom = bottom.removeprefix("(").removesuffix(")") or "1"
    return bottom if top == "1" else f"{bottom}/{over}"


def shared_slope(element: Element, past: PortHistory, unit: str = "") -> dict[str, Any]:
    """Return the fields of a `SharedSlope` law: the coefficient of a linear storage or resistor.

    Its parameter by name, "" where an expression stands; in `unit` where the element says none.
    """
    assert isinstance(element, C | R)
    inverse = isinstance(element, C) and element.stiffness is None
    value = element.stiffness if isinstance(element, C) and not inverse else element.value
    named = isinstance(value, str | int | float)
    name = value if isinstance(value, str) else element.name
    return {
        "coefficient": name if named else "", "stiffness": past.slope,
        "inverse": named and inverse, "stiffness_unit": element.unit or unit,
    }  # fmt: skip


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
