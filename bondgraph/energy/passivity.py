"""Proof that a port-Hamiltonian model is passive, or the elements that break it."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from bondgraph.energy.definiteness import is_positive, sign_of
from bondgraph.energy.stores import positivity
from bondgraph.energy.structure import Resistance
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import RE, C, CField, I, IField, Modulated, R, RField
from bondgraph.support.errors import BondsightError


@dataclass(frozen=True)
class Passivity:
    """What is proved about the energy that ports can draw.

    Attributes
    ----------
    passive : bool
        No element can give energy that it did not take: power lost is a sum of ``f^T R f`` with
        every R positive, and no law or source is active. With `unbounded` empty this is passivity;
        otherwise only on the region where the energy of those stores is bounded below.
    exact : bool
        For all positive parameters; otherwise at the declared values.
    breakers : tuple of str
        Elements that break it, one line each.
    relied_on : tuple of str
        Elements whose law claims to dissipate, which is taken as true (the claim is tested).
    unbounded : tuple of str
        Stores whose energy is not shown to be bounded below.
    """

    passive: bool
    exact: bool
    breakers: tuple[str, ...]
    relied_on: tuple[str, ...]
    unbounded: tuple[str, ...]

    def __str__(self) -> str:
        """Readable lines."""
        where = "for all positive parameters" if self.exact else "at the declared values"
        lines = [f"passive {where}" if self.passive else "not shown to be passive"]
        lines += self.breakers
        if self.relied_on:
            lines.append("relies on the claim of " + ", ".join(self.relied_on))
        if self.unbounded:
            lines.append("energy not shown to be bounded below: " + ", ".join(self.unbounded))
        return "; ".join(lines)


def judge(graph: BondGraph, found: tuple[Resistance, ...]) -> Passivity:
    """Judge every element; junctions and two-ports keep power by their equations."""
    breakers: list[str] = []
    exact = True
    values = {p.symbol: sp.Rational(str(float(p.value))) for p in graph.parameters.values()}
    for r in found:
        holds, everywhere = _resists(r.matrix, values)
        exact = exact and everywhere
        if not holds:
            breakers.append(f"{r.element} gives power: its resistance is not positive")
    relied_on = []
    for e in graph.of_type(R, RField, RE, C, I):
        law = getattr(e, "law", None)
        if isinstance(e, RE):
            if not is_positive(graph.coefficient(e)):
                breakers.append(f"{e.name} (RE): its rate constant is not positive")
        elif law and isinstance(e, RField):
            if e.name not in {r.element for r in found}:
                breakers.append(f"{e.name} (RF): its nonlinear law claims nothing")
        elif law and (isinstance(e, R) or law.n_memory):
            if law.energy == "dissipates":
                relied_on.append(e.name)
            else:
                breakers.append(
                    f"{e.name} ({e.kind}): its law ({law.name}) does not claim to dissipate"
                )
    for e in graph.of_type(Modulated):
        breakers.append(f"{e.name} ({e.kind}) is an active source: a signal commands its power")
    unbounded = []
    for e in graph.of_type(C, I, CField, IField):
        if isinstance(e, C | I) and e.law is not None and e.law.n_memory:
            continue
        bounded, everywhere = _bounded(graph, e.name)
        exact = exact and everywhere
        if not bounded:
            unbounded.append(e.name)
    return Passivity(not breakers, exact, tuple(breakers), tuple(relied_on), tuple(unbounded))


def _resists(matrix: sp.Matrix, values: dict[sp.Symbol, sp.Rational]) -> tuple[bool, bool]:
    if matrix.rows == 1:
        if is_positive(matrix[0, 0]):
            return True, True
    sign, everywhere = sign_of((matrix + matrix.T) / 2, values)
    return sign != "indefinite", everywhere


def _bounded(graph: BondGraph, name: str) -> tuple[bool, bool]:
    """Decide a quadratic energy by its matrix; of a curved one conclude nothing."""
    try:
        found = positivity(graph, name)
    except BondsightError:
        return False, True
    if found.at:
        return False, True
    return found.sign != "indefinite", found.exact
