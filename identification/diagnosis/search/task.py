"""What the steps of one search share, and what one step has found before anything is decided."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from identification.diagnosis.evidence.hypotheses import Evidence, Thresholds
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.search.base import Base
from identification.diagnosis.search.candidates import Candidate, DiagnosisOptions
from identification.diagnosis.search.looks import Looks

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class SearchTask:
    """What every step of one search shares."""

    done: Looks
    options: DiagnosisOptions
    limits: Thresholds
    classes: Isolability
    say: Progress
    given: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Searched:
    """What one step has looked at and fitted, before anything is decided.

    Attributes
    ----------
    ranked : sequence of Screened
        Effects at the places in question, the most promising first.
    options : DiagnosisOptions
        Of this step: a fit that follows nothing is searched more widely.
    quiet : bool
        Nothing shows, so that nothing was fitted.
    """

    base: Base
    number: int
    seen: FittedModel
    ranked: Sequence[Screened]
    options: DiagnosisOptions
    evidence: Evidence
    trials: tuple[Candidate, ...] = ()
    quiet: bool = False


def told_within(task: SearchTask, number: int) -> Progress:
    """Tell the progress of one step as a part of all of them."""
    span = 0.8 / max(1, task.options.effects)
    low = 0.12 + span * number
    return lambda text, fraction: task.say(text, min(low + span * fraction, 0.94))
