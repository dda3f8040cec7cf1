"""All laws of the C code by name."""

from __future__ import annotations

from collections.abc import Mapping

from hardware.simulators.generator.law import CodedLaw
from hardware.simulators.generator.laws_exam import EXAM_LAWS
from hardware.simulators.generator.laws_other import OTHER_LAWS
from hardware.simulators.generator.laws_resistor import RESISTOR_LAWS
from hardware.simulators.generator.laws_storage import STORAGE_LAWS
from hardware.simulators.generator.laws_withheld import WITHHELD_LAWS

LAWS: Mapping[str, CodedLaw] = {
    **STORAGE_LAWS, **RESISTOR_LAWS, **OTHER_LAWS, **EXAM_LAWS, **WITHHELD_LAWS
}  # fmt: skip
"""The laws by name, without those of sensors and clocks."""
