"""Constitutive laws: what an element does beyond being linear; loaded when first asked for."""

from bondgraph.support.lazy import attach

__getattr__, __dir__, __all__ = attach(__name__)
