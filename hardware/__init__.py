"""Benches: drivers behind one guard, takes that lose nothing, and simulators over the real wire."""

from bondgraph.support.lazy import attach

__getattr__, __dir__, __all__ = attach(__name__)
