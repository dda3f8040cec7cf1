"""Bondsight: declare a machine as a bond graph, fit it, and find the physics it leaves out."""

from bondgraph.support.lazy import attach

__version__ = "0.1.0"
__getattr__, __dir__, __all__ = attach(__name__)
