"""Bond graphs as a language: declare, assign causality, derive, compile, simulate."""

from bondgraph.support.lazy import attach

__getattr__, __dir__, __all__ = attach(__name__)
