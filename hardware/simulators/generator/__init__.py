"""Virtual plants that conceal physics, for the demo and for the sealed trial, and their recordings.

Stands alone: numpy, scipy and C code of its own; nothing of the project is imported, and equations,
integrator and step are its own. The nominal values in `parameters` are all that both sides know.

``draw`` -> ``generate`` -> ``seal``; the tool reads with ``load_case`` only.

The cells of trial 2 and of its development stand with the proof, in a checkout. Those of trial 1,
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

With the development exam came three plants (`EXAM_PLANTS`) and laws
(`laws_exam`), and commands with rare excursions, slow steps and even noise; with trial 2 four
plants more, laws that only sealed trials hide (`laws_withheld`), and converters.

A laboratory knows its converter and its wiring: the command's hold, a dead time that it declares
and the unit of a coarse converter are given to the tool with the recording.
"""

from __future__ import annotations

from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.drawing import COUNTS, draw
from hardware.simulators.generator.parameters import PLANTS
from hardware.simulators.generator.writing import generate, load_case, load_truths, seal

__all__ = [
    "COUNTS",
    "PLANTS",
    "DrawnCase",
    "draw",
    "generate",
    "load_case",
    "load_truths",
    "seal",
]
