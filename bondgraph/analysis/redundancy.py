"""Analytical redundancy relations: what inputs and readings must satisfy if the graph is right.

Sensors are inverted and storages take derivative causality where they can; the residual of a
sensor is what its junction then lacks (Samantaray and Ould Bouamama, Model-based Process
Supervision, 2008). Each relation is a polynomial in ``s = d/dt`` with no factor taken out that an
initial condition could excite, so it holds for every motion of the graph, not from rest only.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from bondgraph.analysis.fault_signatures import FaultSignatures, signatures
from bondgraph.analysis.redundancy_relation import RedundancyRelation as RedundancyRelation
from bondgraph.analysis.redundancy_relation import relation
from bondgraph.analysis.residual_space import ResidualSpace, blind, diagnostic, symbolic_space
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.support.errors import require_known, unknown_name
from bondgraph.support.html import html_table


@dataclass(frozen=True)
class Redundancy:
    """The redundancy relations of a graph and what they can tell.

    Attributes
    ----------
    name : str
    relations : tuple of RedundancyRelation
        As many as there are sensors.
    inverted : tuple of str
        Sensors that impose what they read; the others are compared with a computed reading.
    integrated : tuple of str
        Storages left in integral causality.
    signatures : FaultSignatures
    """

    name: str
    relations: tuple[RedundancyRelation, ...]
    inverted: tuple[str, ...]
    integrated: tuple[str, ...]
    signatures: FaultSignatures
    space: ResidualSpace = field(repr=False, compare=False)

    def __getitem__(self, sensor: str) -> RedundancyRelation:
        """Return the relation of a sensor."""
        for r in self.relations:
            if r.name == sensor:
                return r
        raise unknown_name("relation", sensor, self.name, [r.name for r in self.relations])

    def blind_to(self, *elements: str) -> tuple[RedundancyRelation, ...]:
        """Return relations that no fault of `elements` can break.

        Raises
        ------
        UnusableInput
            There is none with these sensors.
        """
        owners = self.space.diagnostic.equations.owners
        require_known("element", self.name, owners, *elements)
        found = blind(self.space, elements)
        label = "blind_" + "_".join(elements)
        names = [label if len(found) == 1 else f"{label}_{i}" for i in range(1, len(found) + 1)]
        return tuple(relation(self.space, m, n) for m, n in zip(found, names, strict=True))

    def __str__(self) -> str:
        """Relations, then signatures."""
        lines = [f"{self.name}: {len(self.relations)} redundancy relations"]
        for r in self.relations:
            how = "inverted" if r.name in self.inverted else "compared"
            lines.append(f"{r.name} ({how}, derivatives up to {r.order}): {r}")
        if self.integrated:
            lines.append("in integral causality: " + ", ".join(self.integrated))
        return "\n".join([*lines, str(self.signatures)])

    def _repr_html_(self) -> str:
        """Tables for notebooks."""
        rows = ((r.name, r.order, r) for r in self.relations)
        table = html_table(self.name, ("residual", "order", "relation"), rows)
        return table + self.signatures._repr_html_()


def redundancy(graph: BondGraph) -> Redundancy:
    """Return the redundancy relations of `graph`, one a sensor.

    Coefficients are exact in the parameters, which costs seconds from about 40 elements on, and
    more than 20 s in some larger graphs with rings of two-ports; signatures alone
    (`bondgraph.analysis.fault_signatures.signatures`) cost milliseconds.

    Nonlinear laws stay as deviations from their linear part: where they enter is exact, so their
    elements have a signature, but they are not evaluated.

    Raises
    ------
    GraphError
        There is no sensor, or an element is neither linear nor a law.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, De, R, Sf, Zero
    >>> with BondGraph("tank") as g:
    ...     level = Zero("level")
    ...     _ = Sf("Q") >> level >> C("C_t", 2.0)
    ...     _ = level >> R("R_v", 3.0)
    ...     _ = level >> De("p")
    >>> print(redundancy(g)["p"])
    0 = -C_t*d_p + Q - p/R_v
    """
    made = diagnostic(graph)
    space = symbolic_space(made)
    names = list(made.residuals)
    found = [relation(space, m, n) for m, n in zip(space.multipliers, names, strict=True)]
    return Redundancy(
        graph.name, tuple(found), made.inverted, made.integrated, signatures(graph, made), space
    )
