"""What the steps of a search come to: the kind of the answer, what is named, its last fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bondgraph.signals.recording import Split
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.judged import judged_on
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.search.candidates import Candidate
from identification.estimation.single_record import Fit

QUIET = ("explained", "parameters_only")
"""Kinds of a diagnosis that finds nothing missing."""


def kind_of(decisions: Sequence[Decision], declared: Fit, nominal: Fit) -> str:
    """Return what a diagnosis comes to, from its steps and the model before and after its fit."""
    if any(d.kind == "missing_physics" for d in decisions):
        return "missing_physics"
    if any(d.kind == "unknown_physics" for d in decisions):
        return "unknown_physics"
    better = declared.chi2("test") > max(1.5 * nominal.chi2("test"), 1.3)
    return "parameters_only" if better else "explained"


def unforetold(nominal: Fit) -> tuple[str, ...]:
    """Say that held-out samples are missed by more than noise, and by more than the readings move.

    What passes for noise is then all that there is, and nobody can tell that nothing is missing.
    Empty where a reading tells more.
    """
    data = nominal.problem.data
    missed = np.array(list(nominal.rmse("test").values()))
    moved = np.nanstd(data.readings, axis=0)
    if not ((missed > moved) & (missed > ABOVE * data.floor)).all():
        return ()
    return (
        "held-out samples are missed by more than the readings move in the whole recording: record "
        "longer, or excite the system more evenly",
    )


ABOVE = 1.3
"""Times the noise that a misfit is at least which is not noise by its size alone."""


def last_named(decisions: Sequence[Decision], kind: str) -> Fit | None:
    """Return the fit with everything that was named, if anything was."""
    found = all_named(decisions, kind)
    return found[-1].fit if found else None


def all_named(decisions: Sequence[Decision], kind: str) -> tuple[Candidate, ...]:
    """Return every effect that was named, in the order they were found."""
    found = (d.chosen for d in decisions if d.kind == "missing_physics" and kind == d.kind)
    return tuple(t for t in found if t is not None)


def judged(decision: Decision, split: Split, n: int) -> Decision:
    """Return a decision whose repair is judged by `split`, if it was fitted to all samples."""
    chosen = decision.chosen
    if chosen is None or chosen.fit.problem.data.n != n:
        return decision
    return replace(decision, chosen=replace(chosen, fit=judged_on(chosen.fit, split)))


def unexplained(decision: Decision, left: Remaining) -> Decision:
    """Return a decision that found nothing, where samples that it has not seen say otherwise."""
    reason = f"nothing showed in what choices may look at, but {left.words}: that is no noise"
    return replace(decision, kind="unknown_physics", reasons=(reason,), remaining=left)
