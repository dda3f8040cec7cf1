"""Whether strokes that are set can be completed at all: a question of matching.

Every junction takes one bond that sets its common variable. A bond between a 0 and a 1 junction
does so at both ends or at neither, one between two of a kind at one end; transformers and gyrators
pass it on; what ends a bond otherwise is free. So junctions are matched with each other, and the
algorithm of Edmonds answers in a moment where taking back choices in turn may try them all.

References
----------
Edmonds, Paths, trees, and flowers, Canadian Journal of Mathematics 17, 1965.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bondgraph.graph.bond_graph import Bond


def completable(
    at: Mapping[str, tuple[Bond, ...]], kinds: Mapping[str, str], decided: Mapping[Bond, str]
) -> bool:
    """Whether no junction must stay without a bond that sets its variable, or get two.

    Parameters
    ----------
    at : mapping of str to tuple of Bond
        Bonds of each element, without those of sensors that impose nothing.
    kinds : mapping of str to str
        How each element passes strokes on: ``0``, ``1``, ``TF``, ``GY``, or empty.
    decided : mapping of Bond to str
        Strokes with all that follows from them: bond -> end that receives the effort.
    """
    import networkx as nx

    junctions = [
        n for n, kind in kinds.items()
        if kind in ("0", "1") and not any((decided.get(b) == n) == (kind == "0") and b in decided
                                          for b in at[n])
    ]  # fmt: skip
    met: Any = nx.Graph()
    met.add_nodes_from(junctions)
    between = set[object]()
    for name in junctions:
        for bond in at[name]:
            if bond in decided:
                continue
            other, last, both = _far_end(at, kinds, name, bond)
            if other is None:
                met.add_edge(name, bond, weight=1)
            elif not both:
                path = frozenset((bond, last))
                between.add(path)
                met.add_edge(name, path, weight=2)
            elif other != name:
                met.add_edge(name, other, weight=2)
    matched = nx.max_weight_matching(met)
    met_by = sum(int(met.edges[pair]["weight"]) for pair in matched)
    return met_by == len(junctions) + len(between)


def _far_end(
    at: Mapping[str, tuple[Bond, ...]], kinds: Mapping[str, str], name: str, bond: Bond
) -> tuple[str | None, Bond, bool]:
    """Return the junction behind a bond, None if there is none, and the bond that reaches it.

    Also whether a stroke that sets the variable of `name` sets that of the other as well.
    """
    here, effort_in = name, kinds[name] == "1"
    while True:
        here = bond.head if bond.tail == here else bond.tail
        kind = kinds[here]
        if kind in ("0", "1"):
            return here, bond, effort_in == (kind == "0")
        if not kind:
            return None, bond, False
        first, second = at[here]
        bond = second if bond == first else first
        effort_in = effort_in == (kind == "TF")
