"""All laws of the C code by name."""

from __future__ import annotations

from collections.abc import Mapping

from identification.blind.generator.law import Law
from identification.blind.generator.laws_other import OTHER_LAWS
from identification.blind.generator.laws_resistor import RESISTOR_LAWS
from identification.blind.generator.laws_storage import STORAGE_LAWS

__all__ = ["LAWS"]

LAWS: Mapping[str, Law] = {**STORAGE_LAWS, **RESISTOR_LAWS, **OTHER_LAWS}
"""The laws by name, without those of sensors and clocks."""
