"""What an oracle could separate: one that knows the truth and leaves nothing but the noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bondgraph.support.arrays import Array
from tests.proof.exam.truths import ConcealedEffect, ExamTruth

__all__ = ["SURE", "kind_separable", "name_separable"]

SURE = 3.0
"""Standard errors over the stretches by which a wrong hypothesis must lose against the truth."""


def name_separable(truth: ExamTruth, evidence: Mapping[str, Any]) -> bool:
    """Whether every fit of another effect, or at another place, loses against the noise itself.

    Parameters
    ----------
    evidence : mapping
        What the first decision of an answer looked at, as `stored.recorded` keeps it: its fits
        are the rivals, the model without an effect among them. The truth is as good as can be:
        its prediction errors are the noise that was added to the recording.
    """
    main = truth.main
    assert main is not None
    laws = evidence.get("laws", ())
    right = [x["effect"] in main.names and x["element"] in main.places for x in laws]
    return _beaten(truth, evidence, right)


def kind_separable(truth: ExamTruth, evidence: Mapping[str, Any]) -> bool:
    """Whether every fit of an effect of another kind, or at another place, loses."""
    main = truth.main
    assert main is not None
    laws = evidence.get("laws", ())
    right = [_of_kind(x, main) and x["element"] in main.places for x in laws]
    return _beaten(truth, evidence, right)


def _of_kind(law: Mapping[str, Any], main: ConcealedEffect) -> bool:
    return law["effect"] in main.names or law["kind"] in main.kinds


def _beaten(truth: ExamTruth, evidence: Mapping[str, Any], right: list[bool]) -> bool:
    if not evidence.get("stretches"):
        return True  # nothing is known that would excuse the answer
    floors = evidence["floors"]
    noise = np.array([(truth.noise[n] / floors[n]) ** 2 for n in floors])
    plain, *laws = evidence["stretches"][: 1 + len(right)]
    rivals = [x for x, good in zip(laws, right, strict=True) if not good]
    return all(_behind(np.array(x), noise) > SURE for x in (plain, *rivals))


def _behind(square: Array, noise: Array) -> float:
    """Standard errors by which stretches agree on a misfit ``(B, n_y)`` above the noise.

    A misfit in few stretches is as sure as one in all: what is compared is the lead with what the
    noise alone would scatter it by, if that is less than the stretches themselves do.
    """
    lead = np.mean(square / noise - 1.0, axis=1)
    spread = float(np.std(lead, ddof=1))
    quiet = 1.4826 * float(np.median(np.abs(lead - np.median(lead))))
    spread = min(spread, quiet) if quiet > 0 else spread
    return float(np.mean(lead)) / spread * float(np.sqrt(lead.size)) if spread > 0 else np.inf
