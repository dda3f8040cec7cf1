"""Elements of a physical domain, told by their units, and numbers that several effects need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, R
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue.effect import other_resistors, storages
from identification.diagnosis.screening.port_history import PortHistory

Array = np.ndarray

SPRINGS = ("N/m", "m/N", "N*m/rad", "rad/(N*m)", "N*m", "1/(N*m)")
TANKS = ("m3/Pa", "Pa/m3")
CAPACITORS = ("F", "1/F", "F*m2")  # the last one between field and dipole moment
HEAT_STORES = ("J/K", "K/J")
MASSES = ("kg", "kg*m2")


def has_unit(element: Element, units: tuple[str, ...]) -> bool:
    """Whether the unit of `element` has the dimension of one of `units`."""
    text = getattr(element, "unit", "")
    if not text:
        return False
    try:
        unit = parse_unit(text)
    except BondsightError:
        return False
    return any(unit.same_dimension(parse_unit(u)) for u in units)


def springs(graph: BondGraph) -> tuple[Element, ...]:
    """Mechanical storages without a law; without a unit those that are given a stiffness."""
    return tuple(
        e
        for e in storages(graph)
        if has_unit(e, SPRINGS)
        or (isinstance(e, C) and not e.unit and e.stiffness is not None)
    )  # fmt: skip


def vessels(graph: BondGraph) -> tuple[Element, ...]:
    """Capacitors, tanks and heat stores without a law."""
    return tuple(e for e in storages(graph) if has_unit(e, (*TANKS, *CAPACITORS, *HEAT_STORES)))


def tanks(graph: BondGraph) -> tuple[Element, ...]:
    """Hydraulic storages without a law."""
    return tuple(e for e in storages(graph) if has_unit(e, TANKS))


def masses(graph: BondGraph) -> tuple[Element, ...]:
    """Mechanical inertias: all with the unit of a mass, or without a unit."""
    return tuple(e for e in graph.of_type(I) if not e.unit or has_unit(e, MASSES))


def electrical_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Resistors in ohm without a law."""
    return tuple(e for e in other_resistors(graph) if has_unit(e, ("ohm",)))


def hydraulic_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Resistors of a fluid's flow without a law."""
    return tuple(e for e in other_resistors(graph) if has_unit(e, ("Pa*s/m3",)))


def rubbing_units(element: Element) -> tuple[str, str, str]:
    """Units of effort, flow and displacement of a mechanical element."""
    unit = getattr(element, "unit", "")
    turning = "rad" in unit or unit.replace("(", "").startswith("N*m") or "m2" in unit
    return ("N*m", "rad/s", "rad") if turning else ("N", "m/s", "m")


@dataclass(frozen=True)
class Shared:
    """The coefficient of a storage as laws want it that need it too.

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
    """Coefficient of a linear storage, by name if it has one."""
    assert isinstance(element, C)
    inverse = element.stiffness is None
    value = element.value if inverse else element.stiffness
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
