"""Data meets physics: studies, fits, validation and diagnosis."""

from bondgraph.support.lazy import attach

__getattr__, __dir__, __all__ = attach(__name__)
