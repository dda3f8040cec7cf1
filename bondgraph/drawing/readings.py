"""Which signals modulated elements read, and from where: the dashed arrows of a drawing."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.elements import X0, X1, Element, Modulated, Multiport, One, TwoPort, Zero
from bondgraph.graph.sensors import Reading

_COMMON: dict[str, tuple[type[Element], ...]] = {"e": (Zero, X0), "f": (One, X1)}


@dataclass(frozen=True, slots=True)
class DrawnReading:
    """A modulated element reads signals at another element.

    Attributes
    ----------
    source : str
        Element where the signals are.
    target : str
        Modulated element.
    signals : tuple of str
        Such as ``q_theta``.
    """

    source: str
    target: str
    signals: tuple[str, ...]


def expression(e: Element) -> sp.Expr | None:
    """Return the expression of a modulated source, or of a ratio that is one; else None."""
    value = e.value if isinstance(e, Modulated | Reading) else getattr(e, "ratio", None)
    return value if isinstance(value, sp.Expr) and value.free_symbols else None


def readings(graph: BondGraph) -> tuple[DrawnReading, ...]:
    """Return the readings of all modulated elements, one for each pair of elements.

    Parameters, inputs from outside, time and unknown names have no place in the graph; they are
    left out.
    """
    found: dict[tuple[str, str], list[str]] = {}
    bonds = {n: b for b in graph.bonds for n in (b.name, f"{b.tail}_{b.head}")}
    for e in graph.of_type(Modulated, Reading, TwoPort):
        value = expression(e)
        symbols = value.free_symbols if value is not None else ()
        # a parameter that happens to be called like a signal is told by its sign
        for name in sorted(str(s) for s in symbols if not s.is_positive):
            source = _source(graph, bonds, name)
            if source is not None and source != e.name:
                found.setdefault((source, e.name), []).append(name)
    return tuple(DrawnReading(s, t, tuple(names)) for (s, t), names in found.items())


def _source(graph: BondGraph, bonds: dict[str, Bond], signal: str) -> str | None:
    """Element at which a signal such as ``f_axis``, ``q_field2`` or ``e_a>b`` is read."""
    letter, _, name = signal.partition("_")
    if letter not in ("e", "f", "q", "p"):
        return None
    if name in graph.elements:
        return name
    field = name.rstrip("0123456789")
    if field in graph.elements and isinstance(graph[field], Multiport):
        return field
    b = bonds.get(name)
    if b is None:
        return None
    common = _COMMON.get(letter, ())
    return b.head if isinstance(graph[b.head], common) else b.tail
