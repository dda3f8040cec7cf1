"""What a reading's own steps make within its noise is no error of the reading."""

from __future__ import annotations

import math
from dataclasses import replace

from identification.diagnosis.catalogue.measurement.grid_step import quantisation_step
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.remaining import Remaining
from identification.report.numbers import quantity
from identification.study.data import Data

BARELY = 1.1
"""Times the noise that rounding makes up to which a noise is of nothing else."""


def without_own_steps(
    decision: Decision, left: Remaining, data: Data, noise: float, units: dict[str, str]
) -> Decision:
    """Return a decision that takes the rest of a reading that counts for what its steps make.

    Rounding is no random noise where a reading moves slowly: a curve of the reading then follows
    it, below the noise. A law that is named stays; this is of a kind without a name.
    """
    told = decision.kind == "unknown_physics" and decision.answer == "kind"
    if not told or decision.physics != "sensing" or not left.is_noise(noise):
        return decision
    steps = {n: _step(data, n) for n in decision.places if n in data.names}
    floors = dict(zip(data.names, data.floor.tolist(), strict=True))
    if not steps or any(floors[n] > BARELY * s / math.sqrt(12.0) for n, s in steps.items()):
        return decision
    said = (
        f"the reading {n} counts in steps of {quantity(s, units.get(n, ''))}: what is left of it "
        "is within what they make"
        for n, s in steps.items()
    )
    return replace(
        decision, kind="explained", chosen=None, same_place=(), rivals=(), richer=(), share=0.0,
        confidence=0.0, reasons=tuple(said), answer="unknown", physics="", places=(),
        law_fit=float("nan"), kinds=(),
    )  # fmt: skip


def _step(data: Data, name: str) -> float:
    """Return the step of a reading as declared, or read off its values; 0 where it has none."""
    declared = data.resolution.get(name, 0.0)
    return declared or quantisation_step(data.readings[:, data.names.index(name)]) or 0.0
