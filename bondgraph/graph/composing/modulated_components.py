"""Components that a command changes: their equations are products of signals."""

from __future__ import annotations

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.hierarchy import Port
from bondgraph.graph.composing.library import ComponentLibrary
from bondgraph.graph.elements import MTF, One, R, Zero
from bondgraph.graph.modulation import external
from bondgraph.laws import Coulomb


def magnetorheological_damper(
    damping: float = 1e3, force: float = 100.0, sensitivity: float = 2.0
) -> BondGraph:
    """Damper whose fluid yields at a force that a command sets (Bingham model).

    ``F = c v + F_c (1 + a u) sign(v)`` with ``v = v_left - v_right`` and the command ``u``, an
    input ``in_current``; passive while ``1 + a u`` is not negative. Stanway, Sproston and Stevens,
    J. Electrostatics 20 (1987) 167. Ports ``left``, ``right`` (N). Parameters ``c`` (N s/m),
    ``F_c_yield`` (N), ``a`` (over the unit of ``u``).
    """
    with BondGraph("magnetorheological_damper") as g:
        a = g.parameter("a", sensitivity)
        body, between = Zero("body"), One("between")
        Port("left", unit="N") >> body >> between >> R("c", damping, unit="N*s/m")
        # the same lever of force and velocity keeps the power of the yielding fluid
        valve = MTF("valve", ratio=1 + a * external("current"))
        between >> valve >> R("yield", sp.S.Zero, law=Coulomb(force))
        body >> Port("right", unit="N")
    return g


MODULATED = ComponentLibrary(
    "modulated", {magnetorheological_damper.__name__: magnetorheological_damper}
)
"""All components of this file; `simulate` runs them, the exact step does not."""
