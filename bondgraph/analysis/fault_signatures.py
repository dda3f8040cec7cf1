"""Which relation a fault breaks: the signature matrix, what is detectable and what isolable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from bondgraph.analysis.exact_algebra import modular, rank
from bondgraph.analysis.residual_space import Diagnostic, ResidualSpace, generic_space
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.support.errors import require_known
from bondgraph.support.html import html_table

Classes = tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class FaultSignatures:
    """Rows relations, columns elements, sources and sensors.

    Attributes
    ----------
    name : str
    relations : tuple of str
        Sensors whose residuals the rows are.
    elements : tuple of str
    matrix : tuple of tuple of bool, shape (n_relations, n_elements)
        Whether a fault of the element breaks the relation.
    inseparable : tuple of tuple of str
        Detectable elements that no other choice or combination of relations can separate either:
        their faults reach the residuals through proportional transfer functions.
    """

    name: str
    relations: tuple[str, ...]
    elements: tuple[str, ...]
    matrix: tuple[tuple[bool, ...], ...]
    inseparable: Classes

    def column(self, element: str) -> tuple[bool, ...]:
        """Return the signature of an element."""
        require_known("element", self.name, self.elements, element)
        j = self.elements.index(element)
        return tuple(row[j] for row in self.matrix)

    @property
    def detectable(self) -> tuple[str, ...]:
        """Elements whose faults break at least one relation."""
        return tuple(e for e in self.elements if any(self.column(e)))

    @property
    def classes(self) -> Classes:
        """Detectable elements with equal columns."""
        found: dict[tuple[bool, ...], list[str]] = {}
        for e in self.detectable:
            found.setdefault(self.column(e), []).append(e)
        return tuple(tuple(c) for c in found.values())

    @property
    def isolable(self) -> tuple[str, ...]:
        """Elements alone in their class."""
        return tuple(c[0] for c in self.classes if len(c) == 1)

    def class_of(self, element: str) -> tuple[str, ...]:
        """Return the elements with the same signature."""
        own = self.column(element)
        return tuple(e for e in self.elements if self.column(e) == own)

    def __str__(self) -> str:
        """Text table: elements down, relations across, detectable and isolable at the end."""
        width = max([7, *(len(e) for e in self.elements)])
        wide = [max(3, len(r)) for r in self.relations]
        names = " ".join(f"{r:>{w}}" for r, w in zip(self.relations, wide, strict=True))
        head = f"{'element':{width}} {names}  det iso"
        lines = [head, "-" * len(head)]
        for e, signature, found, alone in self._rows():
            marks = " ".join(f"{int(v):>{w}}" for v, w in zip(signature, wide, strict=True))
            lines.append(f"{e:{width}} {marks}  {found:>3} {alone:>3}")
        for text, classes in (("classes", self.classes), ("inseparable", self.inseparable)):
            shown = "; ".join(", ".join(c) for c in classes if len(c) > 1)
            lines.append(f"{text}: {shown or 'none'}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        rows = ((e, *map(int, marks), found, alone) for e, marks, found, alone in self._rows())
        return html_table(self.name, ("", *self.relations, "det", "iso"), rows)

    def _rows(self) -> list[tuple[str, tuple[bool, ...], int, int]]:
        alone = set(self.isolable)
        columns = [(e, self.column(e)) for e in self.elements]
        return [(e, c, int(any(c)), int(e in alone)) for e, c in columns]


def signatures(graph: BondGraph, made: Diagnostic) -> FaultSignatures:
    """Return the signature matrix at random exact parameter values, so without rounding."""
    space = generic_space(made)
    assert space is not None  # `diagnostic` has solved it
    elements = made.equations.owners
    matrix = tuple(tuple(e in row for e in elements) for row in space.touched)
    return FaultSignatures(
        graph.name, tuple(made.residuals), elements, matrix, _inseparable(space, elements)
    )


def _inseparable(space: ResidualSpace, elements: Sequence[str]) -> Classes:
    """Group elements whose fault directions span the same space."""
    q = space.diagnostic.equations
    spans: dict[str, list[list[int]]] = {}
    for e in elements:
        columns = [[modular(m.get(i, 0)) for m in space.multipliers] for i in q.rows_of(e)]
        if any(any(c) for c in columns):
            spans[e] = columns
    ranks = {e: rank(c) for e, c in spans.items()}
    groups: list[list[str]] = []
    for e in spans:
        for group in groups:
            other = group[0]
            if ranks[e] == ranks[other] == rank([*spans[e], *spans[other]]):
                group.append(e)
                break
        else:
            groups.append([e])
    return tuple(tuple(g) for g in groups)


def separated(before: Sequence[str], after: Classes) -> int:
    """Return how many pairs of a class are in different classes afterwards."""
    home = {e: k for k, c in enumerate(after) for e in c}
    return sum(home.get(a, -1) != home.get(b, -1) for a, b in combinations(before, 2))
