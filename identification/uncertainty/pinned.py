"""Parameters that only the fixed numbers of a memory tell one by one, such as its thresholds."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, R
from bondgraph.laws.law import Law
from bondgraph.support.errors import BondsightError
from identification.report.words import listed
from identification.uncertainty.combinations import FlatBlock
from identification.uncertainty.structural import identifiability


def pinned(graph: BondGraph, free: Collection[str]) -> tuple[str, ...]:
    """Return a sentence on every group of `free` parameters that fixed thresholds alone split.

    A bank of stops or plays has thresholds that were chosen, not measured. They set the scale of
    its argument: where no reading does, what the model without the law tells only together then
    seems to be determined one by one.
    """
    groups = pinned_groups(graph, free)
    names = [n for own in dict(_chosen(graph)).values() for n in own] if groups else []
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return tuple(
        f"{names[0]}{more} are fixed and set a scale that no reading tells: without them "
        f"{listed(g.names)} are told only as {listed(map(str, g.determined)) or 'combinations'}; "
        "values and intervals of each of these alone are those of the chosen thresholds"
        for g in groups
    )


def pinned_groups(graph: BondGraph, free: Collection[str]) -> tuple[FlatBlock, ...]:
    """Return the groups themselves, with what is determined of them."""
    bare = graph
    try:
        for name, _ in _chosen(graph):
            bare = bare.with_element(name, law=None)
        own = [n for n in free if n in bare.parameters]
        return identifiability(bare, own).groups if own and bare is not graph else ()
    except BondsightError:  # a law that is the whole of its element
        return ()


def _chosen(graph: BondGraph) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield every element whose law remembers, with the numbers of the law that are fixed."""
    for e in graph.of_type(C, R, I):
        law: Law | None = e.law
        if law is None or not law.n_memory:
            continue
        names = tuple(p.name for p in law.parameters(e.name) if graph.parameters[p.name].fixed)
        if names:
            yield e.name, names
