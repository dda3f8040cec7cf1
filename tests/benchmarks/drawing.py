"""Seconds of a drawing's layout."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from bondgraph.drawing.layout import layout
from tests.benchmarks.bounds import Measured, best, judged
from tests.bondgraph.drawing.test_draw_overlap import chain, random_graph


def measured() -> Iterator[Measured]:
    """Sixty elements with rings and signals; chains, the longer with five times the elements."""
    yield Measured("random graph of 60 elements", best(lambda: layout(random_graph(39)), 2), 1.0)
    small, large = (best(lambda n=n: layout(chain(n)), 2) for n in (17, 83))  # type: ignore[misc]
    yield Measured("chain of 500 elements", large, 2.0)
    yield Measured("the same by its share of a fifth", large, 15.0 * max(small, 0.01))


def main() -> int:
    """Print; 1 beyond a bound."""
    return judged(measured())


if __name__ == "__main__":
    sys.exit(main())
