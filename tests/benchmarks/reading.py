"""Seconds until a hostile graph file is refused, and growth for a good one."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress

from bondgraph import BondGraph
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph import elements as el
from bondgraph.graph.elements import Element
from bondgraph.support.errors import UnusableInput
from tests.benchmarks.bounds import Measured, best, judged
from tests.bondgraph.export.test_hostile_graph_json import HOSTILE


def refuse(text: str) -> None:
    """Read in vain."""
    with suppress(UnusableInput):
        from_json(text)


def million() -> str:
    """Return a document of a million junctions."""
    names = ",".join(f'{{"kind":"0","name":"j{i}"}}' for i in range(1_000_000))
    return '{"schema":"bondsight-graph/1","name":"m","elements":[' + names + "]}"


def chain(n: int) -> BondGraph:
    """Return a source with n junctions and resistors."""
    with BondGraph("chain") as g:
        tail: Element = el.Se("V")
        for i in range(n):
            tail = tail >> el.One(f"j{i}")
            tail >> el.R(f"R{i}", 1.0 + i)
    return g


def measured() -> Iterator[Measured]:
    """Slowest of the hostile ones, the million, and sixteen times the elements."""
    slowest = max(best(lambda t=t: refuse(t), 1) for t, _ in HOSTILE.values())  # type: ignore[misc]
    yield Measured("slowest hostile document", slowest, 5.0)
    text = million()
    yield Measured("a million elements", best(lambda: refuse(text), 3), 1.0)
    small, large = chain(500), chain(8000)
    share = best(lambda: from_json(to_json(small)), 3)
    yield Measured("8000 links", best(lambda: from_json(to_json(large)), 1), 16 * 3 * share)


def main() -> int:
    """Print; 1 beyond a bound."""
    return judged(measured())


if __name__ == "__main__":
    sys.exit(main())
