"""Generator of the sealed trial: six plants, their concealed physics, and the recordings.

Stands alone: numpy, scipy and C code of its own; nothing of the project is imported, and equations,
integrator and step are its own. The nominal values in `parameters` are all that both sides know.

``draw`` -> ``generate`` -> ``seal``; the tool reads with ``load_case`` only.
"""

from __future__ import annotations

from identification.blind.generator.case import Case
from identification.blind.generator.drawing import COUNTS, draw
from identification.blind.generator.parameters import PLANTS
from identification.blind.generator.writing import generate, load_case, load_truths, seal

__all__ = ["COUNTS", "PLANTS", "Case", "draw", "generate", "load_case", "load_truths", "seal"]
