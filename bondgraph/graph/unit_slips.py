"""A unit that alone does not fit those of its neighbours: what is expected, where it would fit.

One element against two or more that agree with each other is a slip of the pen before it is another
domain: nobody forgets a transducer for a single spring.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

from bondgraph.graph.domains import DOMAINS
from bondgraph.graph.elements import C, Element, I, R, Se, Sf, Source
from bondgraph.graph.sensors import De, Df, Dq
from bondgraph.signals.units import Dimension, parse_unit

if TYPE_CHECKING:
    from bondgraph.graph.domain_check import UnitStatement

TRANSDUCER = "put a transducer between them (TF if effort gives effort, GY if effort gives flow)"
COEFFICIENTS: Mapping[str, tuple[str, str, str, str]] = MappingProxyType({
    "electrical": ("ohm", "F", "1/F", "H"),
    "translation": ("N*s/m", "m/N", "N/m", "kg"),
    "rotation": ("N*m*s/rad", "rad/(N*m)", "N*m/rad", "kg*m^2"),
    "hydraulic": ("Pa*s/m^3", "m^3/Pa", "Pa/m^3", "kg/m^4"),
    "magnetic": ("A/V", "Wb/A", "A/Wb", ""),
    "thermal": ("K/W", "J/K", "K/J", ""),
})  # fmt: skip
"""Usual units of a resistor, a compliance, a stiffness and an inertia by domain."""
_VARIABLES: Mapping[type[Element], tuple[int, str]] = MappingProxyType({
    Se: (0, "gives"), Sf: (1, "gives"), De: (0, "reads"), Df: (1, "reads"), Dq: (2, "reads"),
})  # fmt: skip
"""Elements that give or read the effort (0), the flow (1) or the displacement (2)."""


def slip(group: Sequence[UnitStatement]) -> str:
    """Return a line on the one element of a group of bonds whose unit does not fit all others.

    Empty where it may be more than one, or where the others do not agree among themselves.
    """
    names = list(dict.fromkeys(s.element.name for s in group))
    found = []
    for name in names:
        others = [s for s in group if s.element.name != name]
        fits = [s.domains for s in others]
        common = frozenset.intersection(*fits) if fits else frozenset()
        if len(names) > 2 and common and not _clash(others):
            own = next(s for s in group if s.element.name == name)
            found.append((own, others, common))
    return _line(*found[0]) if len(found) == 1 else ""


def _clash(said: Sequence[UnitStatement]) -> bool:
    """Whether one quantity has two dimensions."""
    return len({(s.quantity, s.dims) for s in said}) > len({s.quantity for s in said})


def _line(own: UnitStatement, others: Sequence[UnitStatement], common: frozenset[str]) -> str:
    e, first = own.element, others[0]
    expected = " or ".join(u for name in sorted(common) if (u := expected_unit(e, name)))
    rest = dict.fromkeys(s.element.name for s in others if s.element.name != first.element.name)
    names = [str(first), *rest]
    neighbours = f"{', '.join(names[:-1])} and {names[-1]}"
    wanted = f"{_of_kind(e)} has {expected} here" if expected else "another is expected here"
    turned = _turned(own, common)
    instead = f", or take {turned}" if turned else f", or, if it is meant, {TRANSDUCER}"
    return (
        f"{own}: its unit looks like a slip, {wanted}, for {neighbours} are all of "
        f"{' or '.join(sorted(common))}; correct it{instead if turned or own.domains else ''}"
    )


def expected_unit(e: Element, name: str) -> str:
    """Return the usual unit of an element in a domain; empty where there is none.

    Examples
    --------
    >>> from bondgraph import BondGraph, One, R
    >>> with BondGraph("g") as g:
    ...     _ = One("body") >> R("d", 4.0, unit="N*s")
    >>> expected_unit(g["d"], "translation")
    'N*s/m'
    """
    d = DOMAINS[name]
    if (known := _variable(e)) is not None:
        return (d.effort, d.flow, d.displacement)[known].unit
    resistance, compliance, stiffness, inertia = COEFFICIENTS.get(name, ("",) * 4)
    if isinstance(e, R):
        return resistance
    if isinstance(e, C):
        return stiffness if e.stiffness is not None else compliance
    return inertia if isinstance(e, I) else ""


def _variable(e: Element) -> int | None:
    if isinstance(e, Source) and e.given in ("rate", "integral"):
        return None
    return next((v for kind, (v, _) in _VARIABLES.items() if isinstance(e, kind)), None)


def _turned(own: UnitStatement, common: frozenset[str]) -> str:
    """Say which element the unit belongs to, where an effort was meant for a flow, or so."""
    if (known := _variable(own.element)) is None:
        return ""
    dims = _written(own)
    kinds = (Se, Sf) if isinstance(own.element, Source) else (De, Df, Dq)
    for kind in kinds:
        at, verb = _VARIABLES[kind]
        for name in sorted(common):
            d = DOMAINS[name]
            if at != known and (d.effort, d.flow, d.displacement)[at].parsed.dims == dims:
                article = "an" if kind in (Se, Sf) else "a"
                return f"{article} {kind.__name__}, which {verb} {own.unit}"
    return ""


def _written(own: UnitStatement) -> Dimension:
    return parse_unit(own.unit).dims


def _of_kind(e: Element) -> str:
    """Name of the kind with its article, as it is read aloud."""
    if isinstance(e, C) and e.stiffness is not None:
        return "the stiffness of a C"
    return f"{'an' if e.kind[0] in 'RISM' else 'a'} {e.kind}"
