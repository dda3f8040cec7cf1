"""Generator of the sealed trial: its plants, their concealed physics, and the recordings.

Stands alone: numpy, scipy and C code of its own; nothing of the project is imported, and equations,
integrator and step are its own. The nominal values in `parameters` are all that both sides know.

``draw`` -> ``generate`` -> ``seal``; the tool reads with ``load_case`` only.

The cells of trial 2 and of its development stand in `tests.proof.trial.design`. Those of trial 1,
which benches and tests still draw (`drawing`), are: ``control`` (nothing is missing, but
parameters, noise, outliers, offsets or a declared dead time disturb), ``single`` (an effect of the
vocabulary by its plain law),
``form`` (the same physics by another law), ``outside`` (physics without a name in the vocabulary),
``lookalike`` (`lookalikes`: twelve pairs, each with an excitation that can separate them and with
one that cannot) and ``pair`` (two effects). `vocabulary` says what may hide where, `laws_storage`,
`laws_resistor`, `laws_other` and `sensing` by which numbers, `sizing` how strong: the rms of the
difference that an effect makes, over the noise, comes near to a drawn level from -10 to 30 dB, or
as near as physical numbers allow. The difference is taken before any refit of the nominal
parameters, which may hide part of it.

The plants (``c/``) start from rest and are integrated by the classical Runge-Kutta method with 20
to 600 sub-steps between samples; dry friction passes zero speed over 0.4 % of the rms speed.

With the development exam (`tests.proof.exam`) came three plants (`EXAM_PLANTS`) and laws
(`laws_exam`), and commands with rare excursions, slow steps and even noise; with trial 2 four
plants more, laws that only sealed trials hide (`laws_withheld`), and converters.

A laboratory knows its converter and its wiring: the command's hold, a dead time that it declares
and the unit of a coarse converter are given to the tool with the recording.
"""

from __future__ import annotations

from tests.proof.trial.generator.case import Case
from tests.proof.trial.generator.drawing import COUNTS, draw
from tests.proof.trial.generator.parameters import PLANTS
from tests.proof.trial.generator.writing import generate, load_case, load_truths, seal

__all__ = [
    "COUNTS",
    "PLANTS",
    "Case",
    "draw",
    "generate",
    "load_case",
    "load_truths",
    "seal",
]
