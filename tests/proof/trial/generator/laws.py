"""All laws of the C code by name."""

from __future__ import annotations

from collections.abc import Mapping

from tests.proof.trial.generator.law import Law
from tests.proof.trial.generator.laws_exam import EXAM_LAWS
from tests.proof.trial.generator.laws_other import OTHER_LAWS
from tests.proof.trial.generator.laws_resistor import RESISTOR_LAWS
from tests.proof.trial.generator.laws_storage import STORAGE_LAWS
from tests.proof.trial.generator.laws_withheld import WITHHELD_LAWS

LAWS: Mapping[str, Law] = {
    **STORAGE_LAWS, **RESISTOR_LAWS, **OTHER_LAWS, **EXAM_LAWS, **WITHHELD_LAWS
}  # fmt: skip
"""The laws by name, without those of sensors and clocks."""
