"""Units of a law's parameters where the law stands: a friction torque is in N*m, not in N.

A law that was given no units says those of the domain it is known from. Every such unit is effort,
flow and time to some power; the element says by its own unit which effort and flow are meant.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from bondgraph.graph.domain_check import as_quotient, fitting
from bondgraph.graph.domains import DOMAINS, Domain
from bondgraph.graph.elements import C, I, R, Valued
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.unit_slips import COEFFICIENTS
from bondgraph.signals.units import read_unit
from bondgraph.support.arrays import Array

HOMES = ("translation", "electrical", "hydraulic")
"""Domains in whose units laws are written."""

Powers = tuple[int, int, int]
"""Of effort, flow and time."""


def placed(parameters: Iterable[Parameter], element: Valued) -> tuple[Parameter, ...]:
    """Return a law's parameters with their units in the domain of the element that holds it.

    What fits that domain already, or cannot be told, stays as it is.

    Examples
    --------
    >>> from bondgraph.laws import Coulomb
    >>> bearing = R("b", unit="N*m*s/rad", law=Coulomb(5e-3))
    >>> [(p.name, p.unit) for p in placed(bearing.law.parameters("b"), bearing)]
    [('F_c_b', 'N*m')]
    """
    name = domain_of(element)
    if not name:
        return tuple(parameters)
    return tuple(replace(p, unit=_translated(p.unit, name)) for p in parameters)


def domain_of(element: Valued) -> str:
    """Return the one domain that the unit of a resistor or storage fits; "" if none or several."""
    unit = read_unit(element.unit)
    if unit is None:
        return ""
    quantities = "z" if isinstance(element, R) else "i" if isinstance(element, I) else "kc"
    if isinstance(element, C) and element.stiffness is not None:
        quantities = "k"
    elif isinstance(element, C) and element.value is not None:
        quantities = "c"
    found = {d for q in quantities for d in fitting(*as_quotient(q, unit.dims))}
    return found.pop() if len(found) == 1 else ""


@lru_cache(maxsize=512)
def _translated(text: str, name: str) -> str:
    made = {h: p for h in (name, *HOMES) if (p := _powers(text, h)) is not None}
    if not made:
        return text
    home = min(made, key=lambda h: (_far(made[h]), h != name))
    return text if home == name else _written(DOMAINS[name], made[home])


def _far(powers: Powers) -> int:
    """Return how unlike the unit of a law it is: pressure is N/m^2, and kg/m no Pa*s^2."""
    effort, flow, time = powers
    return abs(effort) + abs(flow) + 3 * min(abs(time), abs(time - flow), abs(time - effort))


def _powers(text: str, name: str) -> Powers | None:
    """Return the whole powers that make a unit of effort, flow and time; None if there are none."""
    unit = read_unit(text)
    if unit is None or not unit.is_si:  # what was not converted is refused by `check`
        return None
    d, second = DOMAINS[name], (0, 0, 1, 0, 0)
    turning = d.flow.parsed.dims == (0, 0, -1, 0, 0)  # rad/s is the inverse of a time already
    rows = [d.effort.parsed.dims, d.flow.parsed.dims, second][: 2 if turning else 3]
    base = np.array(rows, float).T
    solved: Array = np.linalg.lstsq(base, np.array(unit.dims, float), rcond=None)[0].round()
    if np.any(base @ solved != unit.dims):
        return None
    return int(solved[0]), int(solved[1]), 0 if turning else int(solved[2])


def _written(d: Domain, powers: Powers) -> str:
    """Return effort, flow and time to these powers as an engineer writes them."""
    r, c, k, i = COEFFICIENTS[d.name] if d.name in COEFFICIENTS else ("", "", "", "")
    usual: dict[Powers, str] = {
        (1, 0, 0): d.effort.unit, (0, 1, 0): d.flow.unit, (0, 1, 1): d.displacement.unit,
        (1, 0, 1): d.momentum.unit, (1, -1, 0): r, (-1, 1, 1): c, (1, -1, -1): k, (1, -1, 1): i,
    }  # fmt: skip
    if text := usual.get(powers, ""):
        return text
    effort, flow, time = powers
    through = d.flow.unit
    if through.endswith("/s"):  # in displacements: N*m*s^2/rad^2
        through, time = d.displacement.unit, time - flow
    parts = ((d.effort.unit, effort), (through, flow), ("s", time))
    up = "*".join(_power(u, n, "/") for u, n in parts if n > 0)
    down = "".join(f"/{_power(u, -n, '*/')}" for u, n in parts if n < 0)
    return (up or "1") + down


def _power(unit: str, n: int, inner: str) -> str:
    """Return a power of a unit, in brackets where it holds one of the signs `inner`."""
    signs = inner if n == 1 else "*/^"
    held = f"({unit})" if any(c in unit for c in signs) else unit
    return held if n == 1 else f"{held}^{n}"
