"""What an oracle could separate: one that knows the truth and leaves nothing but the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from bondgraph.support.arrays import Array
from hardware.simulators.judging.claims import told_at
from hardware.simulators.judging.truths import ConcealedEffect, ExamTruth
from identification.diagnosis.catalogue import UNNAMED

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
    return _beaten(truth, evidence, lambda law, main: law["effect"] in main.names)


def kind_separable(truth: ExamTruth, evidence: Mapping[str, Any]) -> bool:
    """Whether every fit of an effect of another kind, or at another place, loses."""
    return _beaten(
        truth, evidence, lambda law, main: law["effect"] in main.names or law["kind"] in main.kinds
    )


def no_law_fits(truth: ExamTruth, evidence: Mapping[str, Any]) -> bool:
    """Whether every fit of a law with a name loses against the noise: physics outside can be told.

    A law that predicts as well as the truth would is refuted by nothing in the recording.
    """
    return _beaten(truth, evidence, lambda law, main: False)


def _beaten(
    truth: ExamTruth,
    evidence: Mapping[str, Any],
    right: Callable[[Mapping[str, Any], ConcealedEffect], bool],
) -> bool:
    main = truth.main
    assert main is not None
    if not evidence.get("stretches"):
        return True  # nothing is known that would excuse the answer
    floors = evidence["floors"]
    noise = np.array([(truth.noise[n] / floors[n]) ** 2 for n in floors])
    plain, *fitted = evidence["stretches"]
    rivals = [
        square
        for law, square in zip(evidence["laws"], fitted, strict=False)
        if told_at(law["effect"], law["element"], floors) not in main.places
        or not (right(law, main) or _contains(law, main))
    ]
    return all(_behind(np.array(x), noise) > SURE for x in (plain, *rivals))


def _contains(law: Mapping[str, Any], main: ConcealedEffect) -> bool:
    """Whether a law is no rival where it sits: the unnamed curve, or one with the truth in it."""
    return law["effect"] == UNNAMED.name or bool(main.names & set(law["simpler"]))


def _behind(square: Array, noise: Array) -> float:
    """Standard errors by which stretches agree on a misfit ``(B, n_y)`` above the noise.

    A misfit in few stretches is as sure as one in all: what is compared is the lead with what the
    noise alone would scatter it by, if that is less than the stretches themselves do.
    """
    lead = np.mean(square / noise - 1.0, axis=1)
    if lead.size < 2:
        return 0.0
    spread = float(np.std(lead, ddof=1))
    quiet = 1.4826 * float(np.median(np.abs(lead - np.median(lead))))
    spread = min(spread, quiet) if quiet > 0 else spread
    return float(np.mean(lead)) / spread * float(np.sqrt(lead.size)) if spread > 0 else np.inf
