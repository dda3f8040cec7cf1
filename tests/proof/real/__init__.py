"""Real recordings with known missing physics: impoverished models, fixed in advance."""

from __future__ import annotations

from tests.proof.real.case import Published, RealCase, Truth
from tests.proof.real.registry import REAL_CASES, chosen_cases

__all__ = ["REAL_CASES", "Published", "RealCase", "Truth", "chosen_cases"]
