"""Laws fitted once more from declared values, where the model's own values were carried far."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from joblib import Parallel, delayed

from bondgraph.support.errors import BondsightError
from identification.diagnosis.search.beginnings import FIRST, freed, misfit_at, resting
from identification.diagnosis.search.candidates import (
    HOPELESS,
    Candidate,
    DiagnosisOptions,
    alone,
    sound,
    trial_of,
)
from identification.diagnosis.search.hold_choice import rather
from identification.estimation.holds import possible
from identification.estimation.single_record import Fit, fit
from identification.estimation.sub_steps import settled_fit

AFRESH = 2
"""Laws that are fitted afresh."""
VALLEY = 0.1
"""Part of a law's misfit that a fit afresh has to stay below: it is another valley, or nothing."""


def begun_afresh(trials: Sequence[Candidate], options: DiagnosisOptions) -> list[Candidate]:
    """Fit the laws at the likeliest place once more from declared values; the better fit is kept.

    The nominal fit takes up what a large effect does by values far from the declared ones, or by
    another behaviour of the commands; a descent from there may never come back.
    """
    ahead = sorted(trials, key=lambda t: t.train)
    there = [t for t in ahead if t.element == ahead[0].element][:AFRESH]
    made = Parallel(n_jobs=options.jobs)(delayed(alone)(_afresh, t, options) for t in there)
    again = {t.label: t for t in made}
    return sorted((again.get(t.label, t) for t in trials), key=lambda t: t.test)


def _afresh(trial: Candidate, options: DiagnosisOptions) -> Candidate:
    """Fit a law from declared values, as commands may behave between samples."""
    old = trial.fit.problem
    if old.source_offsets and not old.dynamics.jumps:
        return trial
    free = [n for n, p in old.graph.parameters.items() if not p.fixed and n not in old.fixed]
    declared = {n: old.graph.parameters[n].value for n in free if n in old.starts}
    plainly = replace(old, known_states={}, known_offsets=(), correction=None)
    plainly = resting(plainly) if old.dynamics.jumps else plainly
    fitted = {n: trial.fit.values[n] for n in trial.insertion.strengths}
    short: list[Fit] = []
    for hold in possible(options.holds, old):
        posed = replace(
            plainly, data=replace(old.data, hold=hold), n_sub=4 if hold == "band-limited" else 1
        )
        begun = [
            replace(posed, starts={**old.starts, **declared, **s})
            for s in (fitted, *trial.insertion.starts)
        ]
        with suppress(BondsightError, np.linalg.LinAlgError, ValueError):
            short.append(fit(min(begun, key=misfit_at), max_iterations=2 * FIRST, judged=False))
    begun_well = min(filter(sound, short), key=lambda f: f.cost, default=None)
    if begun_well is None or begun_well.cost > HOPELESS[1] * trial.fit.cost:
        return trial
    try:
        made = settled_fit(begun_well.problem, options.final_iterations, begun_well.point)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return trial
    made = freed(made, options.final_iterations)
    same = made.problem.data.hold == old.data.hold
    better = sound(made) and made.cost < VALLEY * trial.fit.cost
    if better and (same or rather(made, trial.fit)):
        return trial_of(trial.insertion, trial.home, made)
    return trial
