"""Machines declared in the language: piezo stacks, ultrasonic and electrostatic drives."""

from bondgraph.support.lazy import attach

__getattr__, __dir__, __all__ = attach(__name__)
