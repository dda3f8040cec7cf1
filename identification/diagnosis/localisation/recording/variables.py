"""What the variables of a port are called and measured in."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.domains import DOMAINS, Domain
from bondgraph.graph.elements import GY, C, Element, I, Multiport, R, TwoPort
from bondgraph.signals.units import Unit, parse_unit
from bondgraph.support.errors import BondsightError


@dataclass(frozen=True)
class Variables:
    """Words and SI units of a port's displacement, flow, effort and momentum."""

    displacement: str
    displacement_unit: str
    flow: str
    flow_unit: str
    effort: str
    effort_unit: str
    momentum: str
    momentum_unit: str


GENERIC = Variables("displacement", "", "flow", "", "effort", "", "momentum", "")
LEVELS = Variables(
    "volume", "m3", "volume flow", "m3/s", "level", "m", "integral of the level", "m*s"
)
"""Of tanks and outlets whose effort is a level in place of a pressure."""


MOVES = ("position", "angle", GENERIC.displacement)
"""Displacements that an element itself has; of all else something passes through it."""


def variables_of(element: Element) -> Variables:
    """Read the domain of a storage, resistor or inertia from the unit of its parameter.

    Elements without a unit, and units that fit no domain, get the generic words and no unit.
    """
    text = str(getattr(element, "unit", "") or "")
    if not text or not isinstance(element, C | R | I):
        return GENERIC
    try:
        unit = parse_unit(text)
    except (BondsightError, ValueError):
        return GENERIC
    kind = "C" if isinstance(element, C) else "R" if isinstance(element, R) else "I"
    for name, ways in _parameter_units():
        if any(unit.same_dimension(u) for k, u in ways if k == kind):
            return LEVELS if name == "levels" else _variables(DOMAINS[name])
    return GENERIC


def restoring_words(element: Element) -> str:
    """Say in words of the element's domain what depends on what where its effort restores.

    Examples
    --------
    >>> restoring_words(I("L", 1e-3, unit="H"))
    'a current that depends on the flux linkage'
    >>> restoring_words(I("J", 1e-3, unit="kg*m2"))
    'a torque that depends on the angle'
    """
    v = variables_of(element)
    if v is GENERIC or v == _variables(DOMAINS["translation"]):
        return "a force that depends on the displacement"
    # what moves has a place that a force may depend on; its mass is seldom bent
    bends = isinstance(element, I) and v.displacement not in MOVES
    bent, on = (v.flow, v.momentum) if bends else (v.effort, v.displacement)
    return f"{'an' if bent[0] in 'aeiou' else 'a'} {bent} that depends on the {on}"


def losing_words(element: Element, both: bool = False) -> str:
    """Say what depends on an element's flow, or on its displacement and flow, in its domain.

    Empty where the domain is not known.

    Examples
    --------
    >>> losing_words(R("b", 1.0, unit="N*m*s/rad"))
    'a loss that depends on the angular velocity'
    >>> losing_words(C("k", stiffness=1.0, unit="N/m"), both=True)
    'a force that depends on position and velocity together'
    """
    v = variables_of(element)
    if v is GENERIC or (both and isinstance(element, I) and v.displacement not in MOVES):
        return ""
    if not both:
        return f"a loss that depends on the {v.flow}"
    article = "an" if v.effort[0] in "aeiou" else "a"
    return f"{article} {v.effort} that depends on {v.displacement} and {v.flow} together"


def displacement_words(element: Element) -> str:
    """Return what the integral of an element's flow is called, such as ``charge through L``."""
    v = variables_of(element)
    stores = isinstance(element, C) or v.displacement in MOVES
    return f"{v.displacement} {'of' if stores else 'through'} {element.name}"


def two_port_variables(graph: BondGraph, e: TwoPort) -> tuple[str, str, str, str]:
    """Return units and words of what a two-port's law reads behind it and gives before it.

    Units are those of the elements on either side; empty where none tells.
    """
    ends = {b.tail == e.name: b for b in graph.bonds_of(e.name)}
    behind = variables_beside(graph, ends[True].head) if True in ends else GENERIC
    into = variables_beside(graph, ends[False].tail) if False in ends else GENERIC
    turned = isinstance(e, GY)
    unit = behind.flow_unit if turned else behind.effort_unit
    word = "flow" if turned else "effort"
    return unit, into.flow_unit, f"{word} behind {e.name}", f"flow into {e.name}"


def variables_beside(graph: BondGraph, start: str) -> Variables:
    """Return the variables of what is connected to `start` without a two-port between."""
    side, new = {start}, [start]
    while new:
        n = new.pop()
        for other in (b.head if b.tail == n else b.tail for b in graph.bonds_of(n)):
            if other not in side and not isinstance(graph[other], TwoPort | Multiport):
                side.add(other)
                new.append(other)
    found = (variables_of(graph[n]) for n in sorted(side))
    return next((v for v in found if v is not GENERIC), GENERIC)


@cache
def _parameter_units() -> tuple[tuple[str, tuple[tuple[str, Unit], ...]], ...]:
    """Units that parameters have in each domain: compliance or stiffness, and so on."""
    found = []
    known = {n: _variables(d) for n, d in DOMAINS.items() if n != "generic"} | {"levels": LEVELS}
    for name, v in known.items():
        e, f = v.effort_unit, v.flow_unit
        q, p = v.displacement_unit, v.momentum_unit
        ways = (("C", q, e), ("C", e, q), ("R", e, f), ("R", f, e), ("I", p, f), ("I", f, p))
        found.append((name, tuple((k, parse_unit(f"({a})/({b})")) for k, a, b in ways)))
    return tuple(found)


def _variables(d: Domain) -> Variables:
    words = (d.displacement.name, d.displacement.unit, d.flow.name, d.flow.unit)
    return Variables(*words, d.effort.name, d.effort.unit, d.momentum.name, d.momentum.unit)
